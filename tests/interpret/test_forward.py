"""Jaxprs for values and Jacobians: the results of `jax.jacfwd`."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _functions import CALLING, FUNCTIONS
from jax import lax

from acausal._interpret.forward import with_jacobian
from acausal._interpret.interpreter import JaxprInterpreter, as_numpy
from acausal._interpret.simplify import simplified
from acausal._jax_private import jaxpr_as_fun

REFUSED = ("custom vjp", "equinox", "for transformations")  # by jax too
VALUES = np.array([0.3, -1.2, 2.5])


def floating(tree: Any) -> list[Any]:
    return [x for x in jax.tree.leaves(tree) if jnp.issubdtype(jnp.result_type(x), jnp.floating)]


def of_real_inputs(function: Callable[..., Any], values: tuple[Any, ...]) -> tuple[Callable[..., Any], list[int]]:
    """The floating-point results by the floating-point arguments, and the places of these arguments."""
    places = [i for i, value in enumerate(values) if np.issubdtype(np.result_type(value), np.floating)]

    def of_moving(*moving: Any) -> Any:
        whole = dict(enumerate(values)) | dict(zip(places, moving, strict=True))
        return floating(function(*whole.values()))

    return of_moving, places


@pytest.mark.parametrize("case", [case for case in [*FUNCTIONS, *CALLING] if case not in REFUSED])
def test_derivatives_are_those_of_jax(case: str) -> None:
    """Interpreted, and compiled."""
    function, values = (FUNCTIONS | CALLING)[case]
    of_moving, places = of_real_inputs(function, values)
    moving = [jnp.asarray(values[i], float) for i in places]
    n = sum(np.size(value) for value in moving)
    by_jax = jax.jacfwd(lambda *moving: (of_moving(*moving),) * 2, argnums=tuple(range(len(places))), has_aux=True)
    # The axes of the arguments in one row, which comes first.
    by_argument, expected_values = jax.jit(by_jax)(*moving)
    expected = [
        np.concatenate([np.reshape(np.asarray(d), (-1, m.size)) for d, m in zip(ds, moving, strict=True)], -1).T
        for ds in by_argument
    ]
    closed = with_jacobian(jax.make_jaxpr(function)(*values), places)
    count = len(jax.tree.leaves(jax.eval_shape(function, *values)))
    with np.errstate(all="ignore"):
        interpreted = JaxprInterpreter().closed(simplified(closed))(*map(as_numpy, values))
    for found in (interpreted, jax.jit(jaxpr_as_fun(closed))(*values)):
        for value, own in zip(floating(found[:count]), expected_values, strict=True):
            np.testing.assert_allclose(value, own, rtol=1e-13, atol=1e-15)
        for derivative, own in zip(found[count:], expected, strict=True):
            assert derivative.shape[0] == n
            np.testing.assert_allclose(derivative.reshape(own.shape), own, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("case", REFUSED)
def test_functions_without_forward_mode_are_refused_as_by_jax(case: str) -> None:
    function, values = FUNCTIONS[case]
    of_moving, places = of_real_inputs(function, values)
    with pytest.raises((TypeError, RuntimeError)):
        jax.jacfwd(of_moving)(*(jnp.asarray(values[i], float) for i in places))
    with pytest.raises((TypeError, RuntimeError)):
        with_jacobian(jax.make_jaxpr(function)(*values), places)


def loop(x: Any) -> Any:
    """Only the first carried values move, one of them after two iterations; the third one decides about the end."""

    def body(carry: Any) -> Any:
        a, b, c, n = carry
        return c * 2.0, jnp.sin(a) + b, x[1] * 0.5, n + 1

    return lax.while_loop(lambda carry: carry[3] < 5, body, (1.0, 2.0, 0.0, 0))


def test_tangents_spread_over_carried_values() -> None:
    closed = with_jacobian(jax.make_jaxpr(loop)(VALUES), [0])
    found = JaxprInterpreter().closed(simplified(closed))(VALUES)[4:]
    expected = jax.jit(jax.jacfwd(lambda x: loop(x)[:3]))(VALUES)
    for derivative, own in zip(found, expected, strict=True):
        np.testing.assert_allclose(derivative, own, rtol=1e-14)


def test_loops_over_batches_go_on_by_member() -> None:
    """As many directions as members, which all inputs change."""

    def member(start: Any, x: Any) -> Any:
        return lax.while_loop(lambda s: s[0] < 3.0, lambda s: (s[0] * x[1] + x[0], s[1] + s[0] * x[2]), (start, x[0]))

    def function(x: Any) -> Any:
        return jax.vmap(lambda start: member(start, x)[1])(jnp.array([0.1, 1.0, 2.5]) * x[0])

    x = jnp.array([0.9, 1.3, 0.7])
    assert len(set(jax.vmap(lambda start: member(start, x)[0])(jnp.array([0.1, 1.0, 2.5])).tolist())) == 3
    found = JaxprInterpreter().closed(simplified(with_jacobian(jax.make_jaxpr(function)(x), [0])))(np.asarray(x))
    np.testing.assert_allclose(found[1], jax.jit(jax.jacfwd(function))(x).T, rtol=1e-13)


def through_complex(x: Any) -> Any:
    """Real numbers in and out, with complex ones between, also in a branch, a loop and a call."""
    z = lax.cond(x[0] > 0.0, lambda z: jnp.exp(1j * z), lambda z: 2j * z, x)
    z = lax.fori_loop(0, 3, lambda _, z: z * (1.0 + 0.1j * x), z)
    return jnp.abs(jax.jit(lambda z: z**2 + x[1])(z)), jnp.real(jnp.fft.fft(x)), jnp.imag(jnp.sum(z))


def test_derivatives_pass_through_complex_numbers() -> None:
    closed = with_jacobian(jax.make_jaxpr(through_complex)(VALUES), [0])
    found = JaxprInterpreter().closed(simplified(closed))(VALUES)[3:]
    for derivative, own in zip(found, jax.jit(jax.jacfwd(through_complex))(VALUES), strict=True):
        assert np.any(own)
        np.testing.assert_allclose(derivative, own.T, rtol=1e-12, atol=1e-13)


def test_results_that_do_not_move_have_no_derivative() -> None:
    def function(x: Any) -> Any:
        return jnp.floor(x), lax.stop_gradient(x) * 2.0, jnp.sign(x) * 3.0, jnp.argmax(x), jnp.ones(2)

    found = JaxprInterpreter().closed(simplified(with_jacobian(jax.make_jaxpr(function)(VALUES), [0])))(VALUES)
    assert [d.shape for d in found[5:]] == [(3, 3), (3, 3), (3, 3), (3, 2)]
    assert not any(np.any(d) for d in found[5:])


def test_the_second_derivative_is_that_of_the_first() -> None:
    def function(x: Any) -> Any:
        return jnp.sum(lax.cond(x[0] > 0.0, jnp.sin, jnp.cos, x) * x[::-1] ** 3)

    once = with_jacobian(jax.make_jaxpr(function)(VALUES), [0])
    twice = with_jacobian(once, [0])
    found = JaxprInterpreter().closed(simplified(twice))(VALUES)
    np.testing.assert_allclose(found[1], jax.jit(jax.grad(function))(VALUES), rtol=1e-14)
    np.testing.assert_allclose(found[3], jax.jit(jax.hessian(function))(VALUES), rtol=1e-13)
