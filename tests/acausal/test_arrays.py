"""Array-valued variables, and arrays of components."""

from typing import Self

import jax.numpy as jnp
import numpy as np

from acausal import (
    Array as Parts,
)
from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    Var,
    Vector,
    connect,
    eq,
    positive,
    repeat,
    shape,
    simulate,
)
from components.rotational import Inertia, Spring


class Chain(Component):
    """Inertias joined by springs, free at both ends."""

    masses: Parts[Inertia]
    springs: Parts[Spring]

    def connections(self) -> Connections:
        return (
            connect(self.masses[:-1].b, self.springs[:].a),
            connect(self.masses[1:].a, self.springs[:].b),
        )


class Chains(Component):
    chains: Parts[Chain]


def chain(n: int, w0: float) -> Chain:
    start = jnp.zeros(n).at[0].set(w0)
    return Chain(masses=repeat(Inertia(J=2.0, w=start), n), springs=repeat(Spring(c=3.0), n - 1))


def test_arrays_within_arrays() -> None:
    alone = simulate(chain(3, 1.0), 1.0, save="end", rtol=1e-9)
    many = simulate(Chains(chains=repeat(chain(3, 1.0), 4)), 1.0, save="end", rtol=1e-9)
    expected = np.broadcast_to(alone.final.masses.item.w, (4, 3))
    np.testing.assert_allclose(many.final.chains.item.masses.item.w, expected, rtol=1e-9)
    np.testing.assert_allclose(many["chains[2].masses[1].w"][-1], expected[0, 1], rtol=1e-9)


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
