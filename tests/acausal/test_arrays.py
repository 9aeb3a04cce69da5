"""Array-valued variables, and arrays of components."""

import re
from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import Chain
from scipy.linalg import expm

from acausal import (
    Array as Parts,
)
from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    UnknownPartError,
    Var,
    Vector,
    eq,
    linearise,
    positive,
    repeat,
    shape,
    simulate,
    stack,
    structure,
    when,
)
from components.rotational import Inertia, Spring


class Chains(Component):
    chains: Parts[Chain]


def chain(n: int, w0: float) -> Chain:
    start = jnp.zeros(n).at[0].set(w0)
    return Chain(masses=repeat(Inertia(J=2.0, w=start), n), springs=repeat(Spring(c=3.0), n - 1))


@pytest.mark.thorough
def test_arrays_within_arrays() -> None:
    alone = simulate(chain(3, 1.0), 1.0, save="end", rtol=1e-9)
    many = simulate(Chains(chains=repeat(chain(3, 1.0), 4)), 1.0, save="end", rtol=1e-9)
    expected = np.broadcast_to(alone.final.masses.item.w, (4, 3))
    np.testing.assert_allclose(many.final.chains.item.masses.item.w, expected, rtol=1e-9)
    np.testing.assert_allclose(many["chains[2].masses[1].w"][-1], expected[0, 1], rtol=1e-9)


class Watched(Component):
    """Its equations read single members of an array of parts and the sum over all of them."""

    rate: Param[Scalar, "1/s"] = 2.0
    first: Var[Scalar, "rad/s"] = 0.0
    last: Var[Scalar, "rad/s"] = 0.0
    mean: Var[Scalar, "rad/s"] = 0.0
    chain: Chain

    def equations(self, d: Self) -> Equations:
        masses = self.chain.masses
        return dict(
            first=eq(d.first, self.rate * (masses[0].w - self.first)),
            last=eq(d.last, self.rate * (masses[-1].w - self.last)),
            mean=eq(self.mean, jnp.mean(masses.item.w)),
        )


def _lags(t1: float, rate: float, w0: float) -> np.ndarray:
    """First, last and mean in Watched(chain(3, w0)), with matrices."""
    ends = -(3.0 / 2.0) * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    lags = rate * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    a = np.block(
        [
            [np.zeros((3, 3)), np.eye(3), np.zeros((3, 2))],
            [ends, np.zeros((3, 5))],
            [np.zeros((2, 3)), lags, -rate * np.eye(2)],
        ]
    )
    x = expm(t1 * a) @ np.array([0.0, 0.0, 0.0, w0, 0.0, 0.0, 0.0, 0.0])
    return np.array([*x[6:], np.mean(x[3:6])])


@pytest.mark.thorough
def test_equations_read_members_of_an_array_of_parts() -> None:
    def seen(rate: Any) -> Any:
        end = simulate(Watched(rate=rate, chain=chain(3, 1.0)), 1.0, save="end", rtol=1e-10).final
        return jnp.stack([end.first, end.last, end.mean])

    values, along = jax.jit(seen)(2.0), jax.jit(jax.jacfwd(seen))(2.0)
    np.testing.assert_allclose(values, _lags(1.0, 2.0, 1.0), rtol=1e-8)
    differences = (_lags(1.0, 2.0 + 1e-5, 1.0) - _lags(1.0, 2.0 - 1e-5, 1.0)) / 2e-5
    np.testing.assert_allclose(along, differences, rtol=1e-6, atol=1e-9)


class Beyond(Component):
    """Its equations read a part by a number; None: all, one after the other."""

    number: int | None
    first: Var[Scalar, "rad/s"] = 0.0
    chain: Chain

    def equations(self, d: Self) -> Equations:
        masses = self.chain.masses
        read = [m.w for m in masses] if self.number is None else [masses[self.number].w]
        return dict(first=eq(self.first, jnp.sum(jnp.stack(read))))


def test_a_part_that_there_is_not_is_an_error() -> None:
    """Also where equations are traced; iteration ends there."""
    for number in (3, -4):
        with pytest.raises(UnknownPartError, match=rf"3 parts of the class Inertia has none at \[{number}\]"):
            structure(Beyond(number=number, chain=chain(3, 1.0)))
    system = linearise(Beyond(number=None, chain=chain(3, 1.0)), outputs=["first"])
    weights = dict(zip(system.states, np.asarray(system.C[0]).tolist(), strict=True))
    assert {name for name, weight in weights.items() if weight} == {f"chain.masses[{i}].w" for i in range(3)}
    assert len(list(chain(3, 1.0).masses)) == 3


@pytest.mark.thorough
def test_parts_are_indexed_in_batches_of_trajectories() -> None:
    """With their parameters, which have no axis of time of their own."""

    def run(w: Any) -> Any:
        masses = repeat(Inertia(J=jnp.array([1.0, 2.0, 3.0]), w=w * jnp.ones(3)), 3)
        return simulate(Chain(masses=masses, springs=repeat(Spring(c=3.0), 2)), 1.0, save=jnp.linspace(0.0, 1.0, 5))

    last = jax.vmap(run)(jnp.array([1.0, 2.0])).masses[-1]
    np.testing.assert_allclose(last.w, np.outer([1.0, 2.0], np.ones(5)), rtol=1e-9)
    np.testing.assert_array_equal(last.J, np.full((2, 5), 3.0))


class Accelerations(Component):
    first: Var[Scalar, "rad/s2"] = 0.0
    total: Var[Scalar, "rad/s2"] = 0.0
    chain: Chain

    def equations(self, d: Self) -> Equations:
        masses = d.chain.masses
        return dict(first=eq(self.first, masses[0].w), total=eq(self.total, jnp.sum(masses.item.w)))


@pytest.mark.thorough
def test_equations_read_derivatives_in_an_array_of_parts() -> None:
    end: Any = simulate(Accelerations(chain=chain(3, 1.0)), 1.0, save="end", rtol=1e-9).final
    torques = end.chain.springs.item.tau
    np.testing.assert_allclose(end.first, end.chain.masses[0].b.tau / 2.0, rtol=1e-12)
    np.testing.assert_allclose(abs(end.first), abs(torques[0]) / 2.0, rtol=1e-12)
    np.testing.assert_allclose(end.total, 0.0, atol=1e-12)  # without torque from outside


class Alarmed(Component):
    """Its events read single members of an array of parts."""

    limit: Param[Scalar, ""] = 1.0
    alarms: Discrete[Scalar, ""] = 0.0
    chain: Chain

    def events(self) -> Events:
        return dict(
            fast=when(self.chain.masses[-1].w > self.limit, alarms=1.0),
            strained=when(self.chain.springs[0].tau > self.limit, alarms=2.0),
        )


@pytest.mark.thorough
def test_the_steps_of_a_run_whose_events_read_members_are_one_function() -> None:
    def end(limit: Any) -> Any:
        return simulate(Alarmed(limit=limit, chain=chain(3, 1.0)), 2.0, save="end").final.chain.masses[0].w

    program = jax.jit(end).lower(1.0).compile().as_text()
    assert program is not None
    main = program[program.index("\nENTRY ") :]
    # XLA calls a loop that it compiles as one function; else the loop is an operation of the main program.
    assert " while(" in program
    assert " while(" not in main


class SeveralWatched(Component):
    parts: Parts[Watched]


@pytest.mark.thorough
def test_equations_read_members_of_arrays_within_an_array() -> None:
    speeds = jnp.array([1.0, 0.5])
    starts = jnp.zeros((2, 3)).at[:, 0].set(speeds)
    springs = repeat(Spring(c=3.0), 2)
    parts = [Watched(chain=Chain(masses=repeat(Inertia(J=2.0, w=w), 3), springs=springs)) for w in starts]
    end: Any = simulate(SeveralWatched(parts=stack(parts)), 1.0, save="end", rtol=1e-10).final.parts.item
    for i, w0 in enumerate(speeds.tolist()):
        np.testing.assert_allclose(np.array([end.first[i], end.last[i], end.mean[i]]), _lags(1.0, 2.0, w0), rtol=1e-8)


class Idle(Component):
    """A vector whose rate vanishes identically."""

    n: int
    k: Param[Scalar, "1", positive]
    x: Var[Vector, "m", shape("n")] = 1.0  # pyright: ignore[reportAssignmentType]
    rate: Var[Vector, "m/s", shape("n")] = 0.0  # pyright: ignore[reportAssignmentType]
    zero: Var[Vector, "m/s", shape("n")] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        return dict(
            integrate=eq(d.x, self.rate),
            scaled=eq(self.k * self.rate, self.zero),
            nothing=eq(self.zero),
        )


def test_vector_that_vanishes() -> None:
    sol = simulate(Idle(n=3, k=2.0), 1.0, save="end")
    np.testing.assert_array_equal(sol.final.x, np.ones(3))
    np.testing.assert_array_equal(sol.final.rate, np.zeros(3))


class Gains(Component):
    """Reads members of a vector by what `read` gives."""

    read: Callable[[Any], Any]
    k: Param[Vector, "", shape("n")]
    x: Var[Scalar, ""] = 1.0
    n: int = 3

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.read(self.k) * self.x, check_units=False))


def gains(read: Callable[[Any], Any]) -> Gains:
    return Gains(read=read, k=jnp.array([1.0, 2.0, 3.0]))


# By an index that jax moves into the array, also where it is used within a function of its own.
BEYOND: dict[str, tuple[Callable[[Any], Any], str]] = {
    "after the last": (lambda k: k[3], "[3]"),
    "before the first": (lambda k: k[-4], "[-4]"),
    "one of several": (lambda k: jnp.sum(k[np.array([0, 5, 1])]), "[5]"),
    "in a matrix": (lambda k: jnp.outer(k, k)[0, 7], "[7]"),
    "in a compiled function": (jax.jit(lambda k: k[9]), "[9]"),
    "in a condition": (lambda k: jax.lax.cond(k[0] > 0.0, lambda: k[1], lambda: k[8]), "[8]"),
    "in a batch": (lambda k: jnp.sum(jax.vmap(lambda i: k[i] + k[4])(np.arange(3))), "[4]"),
}
WITHIN: tuple[Callable[[Any], Any], ...] = (
    lambda k: k[2] + k[-3],
    lambda k: jnp.sum(k[1:9]) - 1.0,
    lambda k: jnp.sum(k[np.array([0, -1])]),
    lambda k: jnp.outer(k, k)[0, 2] + jnp.outer(k, k)[-3, 0],
    lambda k: 4.0 * jnp.take(k, 7, mode="clip") / 3.0,
)


@pytest.mark.parametrize("case", BEYOND)
def test_members_that_a_vector_does_not_have(case: str) -> None:
    read, index = BEYOND[case]
    with pytest.raises(IndexError, match=re.escape(f"Gains.equations reads member {index} of an array of 3: its mem")):
        structure(gains(read))
    with pytest.raises(ModelError, match=re.escape(f"until reads member {index} of an array of 3")):
        simulate(gains(WITHIN[0]), 1.0, until=lambda s: read(s.k))


def test_members_that_a_vector_has() -> None:
    for read in WITHIN:
        assert float(read(jnp.array([1.0, 2.0, 3.0]))) == pytest.approx(4.0)
        structure(gains(read))


class Pair(Component):
    """Two scalars that one equation between arrays determines."""

    x: Var[Scalar, "1"] = 1.0
    y: Var[Scalar, "1"] = 0.0
    z: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        both = jnp.stack([self.y, self.z])
        return {"decay": eq(d.x, -self.x, check_units=False), "both": eq(both, self.x * jnp.array([2.0, 3.0]))}


def test_an_equation_between_arrays_determines_scalars() -> None:
    solution = simulate(Pair(), 1.0, save="end", rtol=1e-9)
    assert jnp.allclose(jnp.array([solution["y"][-1], solution["z"][-1]]), jnp.exp(-1.0) * jnp.array([2.0, 3.0]))
