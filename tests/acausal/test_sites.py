"""The number of places in the program of a run that evaluate the equations, each of which is compiled."""

from collections.abc import Iterator
from typing import Any, Self

import jax
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, eq, prefer, replace, simulate, when
from acausal._evaluate import roots


class Decay(Component, partial=True):
    """An equation with an operation that occurs nowhere else."""

    k: Param[Scalar, "1/s"] = 1.0
    x: Var[Scalar, ""] = 1.0
    z: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.z), bend=eq(self.z, jax.scipy.special.erf(self.x)))


class PlainDecay(Decay):
    """Without events."""


class Many(Component):
    """Parts beside each other."""

    parts: tuple[PlainDecay, ...]


class RenewedDecay(Decay):
    """With an event whose condition needs the equations."""

    def events(self) -> Events:
        return dict(renew=when(self.z < 0.5, x=1.0))


class CountedDecay(Decay):
    """With events that set one discrete variable."""

    n: Discrete[Scalar, "1"] = 0.0

    def events(self) -> Events:
        return dict(
            renew=when(self.z < 0.5, x=1.0, n=self.n + 1.0),
            again=when(self.n > 2.5, n=0.0),
        )


def _operations(jaxpr: Any, loops: int = 0) -> Iterator[str]:
    """The operations inside of at least this number of nested loops."""
    for eqn in jaxpr.eqns:
        if loops <= 0:
            yield eqn.primitive.name
        for value in eqn.params.values():
            for item in value if isinstance(value, tuple | list) else [value]:
                inner = getattr(item, "jaxpr", item)
                if hasattr(inner, "eqns"):
                    yield from _operations(inner, loops - (eqn.primitive.name == "while"))


def _sites(function: Any, k: float) -> int:
    return list(_operations(jax.make_jaxpr(function)(k).jaxpr)).count("erf")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("model", "sites"),
    [
        # The guess of the first step, the Jacobian of a step, its later stages, the check of the end.
        (PlainDecay, 4),
        # Besides, the margins of conditions, and what happens at the start and at an event.
        (RenewedDecay, 7),
    ],
)
def test_sites_at_which_a_run_evaluates_the_equations(model: type[Decay], sites: int) -> None:
    def end(k: Scalar) -> Scalar:
        return simulate(model(k=k), 2.0, save="end").t1

    assert _sites(end, 1.0) == sites
    # Derivatives along a few parameters are a batch beside the run; those of the moments of events are added.
    assert _sites(jax.grad(lambda k: simulate(model(k=k), 2.0, save="end").final.x), 1.0) <= 2 * sites


@pytest.mark.thorough
def test_derivatives_by_one_start_value_of_many() -> None:
    """They are along that one, not along the start values of all parts."""
    many = Many(parts=tuple(PlainDecay() for _ in range(60)))

    def end(x: Scalar) -> Scalar:
        return simulate(replace(many, {"parts[3].x": x}), 1.0, save="end").final.parts[3].x

    value, gradient = (jax.make_jaxpr(f)(1.0).jaxpr for f in (end, jax.grad(end)))
    assert len(list(_operations(gradient))) < 1.5 * len(list(_operations(value)))
    assert float(jax.grad(end)(1.0)) == pytest.approx(float(end(1.0001) - end(0.9999)) / 2e-4, rel=1e-6)


class Tied(Component):
    """A decay and what is tied to it, which an event sets: the state follows by way of the constraint."""

    k: Param[Scalar, "1/s"] = 1.0
    x: Var[Scalar, "", prefer] = 1.0
    y: Var[Scalar, ""] = 2.0
    rate: Var[Scalar, "1/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x), tie=eq(self.y, 2.0 * self.x), rate=eq(self.rate, d.y))

    def events(self) -> Events:
        return dict(renew=when(self.y < 0.5, y=2.0))


@pytest.mark.parametrize("model", [RenewedDecay, Tied])
def test_steps_call_no_other_library(model: type[RenewedDecay] | type[Tied]) -> None:
    """XLA on the CPU does not compile a loop as one function in which LAPACK is called: also with many integrals."""

    def end(k: Scalar) -> Scalar:
        return simulate(model(k=k), 2.0, save="end", integrals=lambda s: [s.x] * 50).t1

    program = jax.make_jaxpr(end)(1.0)
    found = set(_operations(program.jaxpr, loops=1))
    assert "mul" in found
    assert not found & {"lu", "geqrf", "householder_product", "qr", "triangular_solve", "cholesky", "svd", "eigh"}


@pytest.mark.parametrize("model", [RenewedDecay, CountedDecay])
def test_steps_add_up_nothing_by_index(model: type[Decay]) -> None:
    """XLA on the CPU does not compile a loop as one function in which numbers are added up at places of an index."""
    program = jax.make_jaxpr(lambda k: simulate(model(k=k), 2.0, save="end").t1)(1.0)
    found = set(_operations(program.jaxpr, loops=1))
    assert "mul" in found
    assert "scatter-add" not in found


class Bent(Component):
    """A state and an unknown of a nonlinear equation."""

    x: Var[Scalar, ""] = 1.0
    z: Var[Scalar, ""] = 0.5

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, -self.z, check_units=False), bend=eq(self.z + self.z**3, self.x))


@pytest.mark.thorough
def test_the_search_for_a_root_is_traced_once_for_all_places(monkeypatch: pytest.MonkeyPatch) -> None:
    traced: list[Any] = []

    def iteration(*args: Any) -> Any:
        traced.append(args)
        return newton(*args)

    newton = roots._newton  # pyright: ignore[reportPrivateUsage]
    monkeypatch.setattr(roots, "_newton", iteration)
    jax.make_jaxpr(lambda x: simulate(Bent(x=x), 1.0, save="end").final.z)(1.0)
    assert len(traced) == 3  # from several guesses, as at the start, and from one, with and without derivatives
