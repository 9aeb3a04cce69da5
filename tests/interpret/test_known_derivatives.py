"""Derivatives that jax takes at known numbers, outside of `jit`: those of the same functions under `jit`."""

import re
from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _runs import Ball, Clock, Lag, Struck, charged, stick_slip
from jax.custom_derivatives import SymbolicZero

from acausal import Component, Equations, Param, Scalar, SimulationError, Var, eq, initialise, replace, simulate
from acausal._interpret import known_derivatives
from acausal._interpret.in_parts import in_parts

pytestmark = pytest.mark.interpreted

PUSHED = {"parts[0].amplitude": 5.0, "parts[2].F_Coulomb": 2.0}


class Unreachable(Component):
    """No start value of x gives this rate."""

    k: Param[Scalar, ""] = 1.0
    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, self.k + self.x**2, check_units=False))

    def initial_equations(self, d: Self) -> Equations:
        return dict(falls=eq(d.x, -1.0, check_units=False))


def pushed(x: Any) -> Any:
    return replace(stick_slip(), dict(zip(PUSHED, x, strict=True)))


FUNCTIONS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "end": (lambda x: simulate(charged(x[0]), x[1], save="end").final.parts[2].v, [5.0, 0.1]),
    "steps": (lambda x: simulate(charged(x[0]), x[1]).final.parts[1].p.i, [5.0, 0.1]),
    "rebounds": (lambda x: simulate(Ball(e=x[0], h=x[1]), 1.2, save="end").final.h, [0.7, 1.0]),
    "stop time": (
        lambda x: simulate(Ball(e=x[0], h=x[1]), 0.9, until=lambda s: s.h - 0.3 * s.impacts, direction="up").t1,
        [0.7, 1.0],
    ),
    "saved": (lambda x: jnp.sum(simulate(Clock(knee=x[0]), 0.1, save=x[1] * jnp.arange(3.0)).x), [0.05, 0.031]),
    "integral": (
        lambda x: simulate(Ball(e=x[0], h=x[1]), 0.9, integrals=lambda s: s.h**2, save="end").integrals[-1],
        [0.7, 1.0],
    ),
    "peak": (lambda x: simulate(Ball(v=x[0], h=x[1]), 0.4, peaks=lambda s: s.h).peaks.value, [3.0, 1.0]),
    "start": (lambda x: simulate(Lag(k=x[0]), x[1]).final.x, [2.0, 0.5]),
    "found start": (lambda x: initialise(Lag(k=x[0]), t0=x[1]).x, [2.0, 0.5]),
    "impact": (lambda x: simulate(Struck(m=x[0], J=x[1]), 0.1).final.w, [2.0, 0.5]),
    "friction": (lambda x: simulate(pushed(x), 0.5).final.parts[2].v, list(PUSHED.values())),
}


QUICK = ("end", "rebounds", "found start")


def _case(name: str) -> Any:
    return pytest.param(name, marks=[] if name in QUICK else pytest.mark.thorough)


@pytest.mark.parametrize("case", list(map(_case, FUNCTIONS)))
def test_derivatives_are_those_under_jit(case: str) -> None:
    function, numbers = FUNCTIONS[case]
    x = jnp.array(numbers)
    value, expected = jax.jit(jax.value_and_grad(function))(x)
    np.testing.assert_allclose(function(x), value, rtol=1e-9)
    for found in (jax.grad(function)(x), jax.jacfwd(function)(x), jax.jacrev(function)(x)):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    direction = jnp.array([1.0, -0.5])
    found = jax.jvp(function, (x,), (direction,))[1]
    np.testing.assert_allclose(found, expected @ direction, rtol=1e-9, atol=1e-12)


def test_a_run_is_not_traced_as_under_jit(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> Any:
        raise AssertionError

    monkeypatch.setattr(known_derivatives, "pushed", refused)  # is needed only where jax differentiates the function
    function, x = FUNCTIONS["friction"]
    assert np.all(np.isfinite(jax.grad(function)(jnp.array(x))))
    with pytest.raises(AssertionError):
        jax.hessian(function)(jnp.array(x))


@pytest.mark.parametrize("outer", [jax.grad, jax.jacfwd, jax.jacrev])
def test_higher_derivatives_are_those_under_jit(outer: Callable[..., Any]) -> None:
    function, numbers = FUNCTIONS["end"]
    x = jnp.array(numbers)
    second = outer(lambda x: jnp.sum(jax.grad(function)(x) ** 2))
    np.testing.assert_allclose(second(x), jax.jit(second)(x), rtol=1e-9)


def test_within_vmap_and_jit_jax_differentiates() -> None:
    function, numbers = FUNCTIONS["rebounds"]
    x = jnp.array([numbers, [0.6, 1.1]])
    expected = jnp.stack([jax.grad(function)(row) for row in x])
    np.testing.assert_allclose(jax.vmap(jax.grad(function))(x), expected, rtol=1e-9)
    np.testing.assert_allclose(jax.grad(lambda x: jnp.sum(jax.vmap(function)(x)))(x), expected, rtol=1e-9)


def test_many_numbers_are_differentiated_in_reverse_mode(monkeypatch: pytest.MonkeyPatch) -> None:
    function, numbers = FUNCTIONS["end"]
    x = jnp.array(numbers)
    expected = jax.grad(function)(x)
    monkeypatch.setattr(known_derivatives, "FEW", 1)
    monkeypatch.setattr("acausal._integrate.differentiated_run.FEW", 1)
    np.testing.assert_allclose(jax.grad(function)(x), expected, rtol=1e-9)


def test_a_failed_run_says_why() -> None:
    with pytest.raises(Exception, match="max_steps"):
        jax.grad(lambda x: simulate(charged(x), 0.3, max_steps=2).final.parts[2].v)(5.0)


def test_a_failed_search_for_a_start_is_explained() -> None:
    def start(k: Any) -> Any:
        return simulate(Unreachable(k=k), 1.0, save="end").final.x

    with pytest.raises(SimulationError) as expected:
        start(1.0)
    with pytest.raises(SimulationError, match=re.escape(str(expected.value))):
        jax.grad(start)(1.0)


def test_functions_in_parts() -> None:
    """Also of integers, with results that do not move."""

    def function(x: Any, n: Any) -> Any:
        return dict(power=jax.lax.fori_loop(0, n, lambda _, y: y * x, 1.0), n=n + 1, kind=jnp.floor(x))

    call = in_parts(function)
    found, changes = jax.jvp(lambda x: call(x, 3), (2.5,), (2.0,))
    assert (found["power"], found["n"], found["kind"]) == (2.5**3, 4, 2.0)
    assert (changes["power"], changes["kind"]) == (3 * 2.5**2 * 2.0, 0.0)
    assert changes["n"].dtype == jax.dtypes.float0
    np.testing.assert_allclose(jax.grad(lambda x: call(x, 3)["power"])(2.5), 3 * 2.5**2, rtol=1e-14)


def test_functions_of_other_types() -> None:
    """In single precision, with complex inputs, and with complex results."""
    single = in_parts(lambda x: x.astype(np.float32) ** 2)
    value, change = jax.jvp(single, (jnp.array([1.5, 2.0]),), (jnp.array([1.0, 2.0]),))
    assert (value.dtype, change.dtype) == (np.float32, np.float32)
    np.testing.assert_allclose(change, [3.0, 8.0], rtol=1e-6)
    of_single = in_parts(lambda x: 3.0 * x)
    assert jax.grad(of_single)(np.float32(2.0)) == 3.0
    modulus = in_parts(lambda z: jnp.abs(z) ** 2)
    np.testing.assert_allclose(jax.grad(lambda x: modulus(x + 2j))(3.0), 6.0)
    turned = in_parts(lambda x: jnp.exp(1j * x))
    np.testing.assert_allclose(jax.grad(lambda x: jnp.real(turned(x)))(3.0), -np.sin(3.0))


def test_callbacks_receive_numbers_in_every_evaluation() -> None:
    seen: list[float] = []

    def function(x: Any) -> Any:
        jax.debug.callback(lambda value: seen.append(float(value)), 2.0 * x)
        return x**2

    call = in_parts(function)
    for x in (1.0, 2.0, 3.0):
        jax.grad(call)(x)
    jax.effects_barrier()
    assert seen == [2.0, 4.0, 6.0]


def test_jax_differentiates_only_what_varies() -> None:
    """A rule of the user sees which inputs are constant, also in a function that only jax can evaluate."""

    @jax.custom_jvp
    def product(x: Any, y: Any) -> Any:
        return jax.pure_callback(lambda x, y: x * y, jax.ShapeDtypeStruct((), float), x, y, vmap_method="sequential")

    def rule(primals: Any, tangents: Any) -> Any:
        assert isinstance(tangents[1], SymbolicZero)
        return product(*primals), tangents[0] * primals[1]

    product.defjvp(rule, symbolic_zeros=True)
    call = in_parts(product)
    assert jax.grad(lambda x: call(x, 3.0))(2.0) == 3.0


def test_the_progress_of_a_differentiated_run_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    """In each call, though a run without progress has a program."""

    def end(V: Any, progress: bool | None) -> Any:
        return simulate(charged(V), 0.3, save="end", progress=progress).final.parts[2].v

    for progress in (None, True, True):
        jax.grad(end)(5.0, progress)
        jax.effects_barrier()
        assert ("%" in capfd.readouterr().out) == (progress is True)
