"""Reading a solution."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from _models import rc

from acausal import Solution, simulate

RESISTANCES = jnp.array([50.0, 100.0])
CAPACITIES = jnp.array([1e-3, 2e-3, 3e-3])


def test_solutions_mapped_twice() -> None:
    def run(R: Any, C: Any) -> Solution:
        return simulate(eqx.tree_at(lambda m: (m.r.R, m.c.C), rc(), (R, C)), 0.1, save="end", rtol=1e-9)

    sols = jax.vmap(lambda C: jax.vmap(lambda R: run(R, C))(RESISTANCES))(CAPACITIES)
    expected = 5.0 * (1.0 - np.exp(-0.1 / (np.asarray(CAPACITIES)[:, None] * np.asarray(RESISTANCES))))
    np.testing.assert_allclose(sols.final.c.v, expected, rtol=1e-7)
    np.testing.assert_allclose(sols["c.v"][..., 0], expected, rtol=1e-7)


def test_dense_batch() -> None:
    def run(R: Any) -> Solution:
        return simulate(eqx.tree_at(lambda m: m.r.R, rc(), R), 0.1, save="dense", rtol=1e-9)

    sols = jax.vmap(run)(RESISTANCES)
    expected = 5.0 * (1.0 - np.exp(-0.05 / (1e-3 * np.asarray(RESISTANCES))))
    np.testing.assert_allclose(sols.at(0.05).c.v, expected, rtol=1e-7)
