"""Both modes of differentiation from a function that has one."""

import itertools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.custom_derivatives import SymbolicZero

from acausal import Scalar
from acausal._integrate.step.derivative import FEW, LARGEST_JACOBIAN, differentiable

MODES = {"forward": jax.jacfwd, "reverse": jax.jacrev}


def powers(arrays: list[Any]) -> Any:
    """x^n y by a loop that reverse mode cannot pass, and how many rounds it took."""
    x, y, n = arrays
    count, value = jax.lax.while_loop(lambda s: s[0] < n, lambda s: (s[0] + 1, s[1] * x), (0, y))
    return {"value": value, "count": count}


def unrolled(arrays: list[Any]) -> Any:
    x, y, _ = arrays
    return {"value": x**4 * y, "count": jnp.asarray(4)}


class WasCalled(Exception):
    """A function was called that must not be called."""


def not_called(_: list[Any]) -> Any:
    raise WasCalled


def product(quick: Callable[..., Any], reversible: Callable[..., Any], size: int = 1) -> Callable[[Any, Any], Any]:
    function = differentiable(quick, reversible, size)
    return lambda x, y: function([x, y, jnp.asarray(4)])["value"]


@pytest.mark.parametrize("first", MODES)
@pytest.mark.parametrize("second", MODES)
@pytest.mark.parametrize("third", MODES)
def test_derivatives_of_any_order_in_any_mode(first: str, second: str, third: str) -> None:
    x, y = jnp.asarray(1.5), jnp.asarray(0.7)
    derivative = product(powers, unrolled)
    for mode, expected in zip((first, second, third), (4 * x**3 * y, 12 * x**2 * y, 24 * x * y), strict=True):
        derivative = MODES[mode](derivative)
        np.testing.assert_allclose(jax.jit(derivative)(x, y), expected, rtol=1e-14)
    mixed = MODES[second](MODES[first](product(powers, unrolled)), argnums=1)(x, y)
    np.testing.assert_allclose(mixed, 4 * x**3, rtol=1e-14)


@pytest.mark.parametrize("mode", MODES)
def test_arrays_and_batches(mode: str) -> None:
    def total(arrays: list[Any]) -> Any:
        return jax.lax.while_loop(lambda s: s[0] < 3, lambda s: (s[0] + 1, s[1] * arrays[0] + arrays[1]), (0, 1.0))[1]

    def by_hand(x: Scalar, y: Scalar) -> Scalar:
        return x**3 + y * (x**2 + x + 1.0)

    function = differentiable(lambda a: total([a[0].sum(), a[1]]), not_called, 1)
    x, y = jnp.arange(6.0).reshape(2, 3) / 5.0, jnp.asarray([0.1, 0.2])
    found = jax.vmap(MODES[mode](lambda x, y: function([x, y]), argnums=(0, 1)))(x, y)
    expected = jax.vmap(jax.grad(lambda x, y: by_hand(x.sum(), y), argnums=(0, 1)))(x, y)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14)


@pytest.mark.parametrize("mode", MODES)
def test_a_result_does_not_depend_on_the_numbers_of_a_batch(mode: str) -> None:
    """Its tangent is a product with those of all numbers, so it has the axis of the batch."""
    function = differentiable(lambda arrays: (2.0 * arrays[0], jnp.sum(arrays[0]) * arrays[1]), not_called, 1)
    each = jax.vmap(jax.jit(lambda x, y: jnp.append(*function([x, y]))[1:]), (None, 0))
    x, y = jnp.array([0.3, 0.5]), jnp.array([1.0, 2.0, 3.0])
    by_x, by_y = MODES[mode](each, argnums=(0, 1))(x, y)
    np.testing.assert_allclose(by_x, [[[0.0, 2.0], [a, a]] for a in y], rtol=1e-14)
    np.testing.assert_allclose(by_y, 0.8 * np.eye(3)[:, None] * [[0.0], [1.0]], rtol=1e-14)


def test_where_many_numbers_vary_or_the_value_is_large_the_reversible_one_is_differentiated() -> None:
    x, y = jnp.asarray(1.5), jnp.asarray(0.7)
    with pytest.raises(WasCalled):
        jax.grad(product(powers, not_called, size=LARGEST_JACOBIAN + 1))(x, y)
    np.testing.assert_allclose(jax.grad(product(powers, unrolled, size=LARGEST_JACOBIAN + 1))(x, y), 4 * x**3 * y)
    numbers = {n: jnp.linspace(0.0, 1.0, n) for n in (FEW, FEW + 1)}
    quick, slow = (lambda a, f=f: f(a[0]) for f in (lambda x: jnp.sum(x**2), lambda x: jnp.sum(x**3)))
    function = differentiable(quick, slow, 1)
    np.testing.assert_allclose(jax.grad(lambda x: function([x]))(numbers[FEW]), 2.0 * numbers[FEW])
    np.testing.assert_allclose(jax.grad(lambda x: function([x]))(numbers[FEW + 1]), 3.0 * numbers[FEW + 1] ** 2)


def test_what_does_not_vary_costs_nothing() -> None:
    """The derivatives are those along the numbers that vary, however many there are besides."""
    function = differentiable(lambda arrays: arrays[0] * jnp.sum(arrays[1]), not_called, 1)
    for mode, n in itertools.product(MODES.values(), (3, FEW // 2, 10 * FEW)):
        derivative = mode(lambda x, n=n: function([x, jnp.ones(n)]))
        np.testing.assert_allclose(derivative(2.0), n)
        assert f"[{n + 1}," not in str(jax.make_jaxpr(derivative)(2.0))  # a batch of derivatives along all numbers


@pytest.mark.thorough
def test_value_and_derivatives_are_made_from_one_trace() -> None:
    traces = []

    def quick(arrays: list[Any]) -> Any:
        traces.append(np.shape(arrays[0]))
        return jnp.sum(arrays[0] ** 2)

    function = differentiable(quick, not_called, 1)
    for mode, x in itertools.product(MODES.values(), (jnp.ones(()), jnp.ones(3))):
        jax.jit(lambda x: function([x]))(x)
        np.testing.assert_allclose(mode(mode(lambda x: function([x])))(x), 2.0 * np.eye(x.size).reshape(2 * x.shape))
    assert traces == [(), (3,)]


def test_reverse_mode_is_taken_along_what_varies_only() -> None:
    """A rule of the user sees which inputs are constant, also if the Jacobian would be too large."""

    @jax.custom_jvp
    def scaled(x: Any, y: Any) -> Any:
        return x * y

    def rule(primals: Any, tangents: Any) -> Any:
        assert isinstance(tangents[1], SymbolicZero)
        return scaled(*primals), tangents[0] * primals[1]

    scaled.defjvp(rule, symbolic_zeros=True)
    function = differentiable(not_called, lambda arrays: scaled(*arrays), LARGEST_JACOBIAN + 1)
    assert jax.grad(lambda x: function([x, jnp.asarray(3.0)]))(2.0) == 3.0
