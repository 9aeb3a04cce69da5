"""The search for a point that satisfies conditions, near another one."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from .._evaluate.blocks import row_scale
from .._evaluate.constraints import CLOSE
from .._evaluate.implicit import nearest, settled

ITERATIONS = 200
METHOD = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
STAGES = 20  # of a homotopy
# Singular values below this share of the largest count as zero: what moves a point no more than that is undetermined.
RANK = 1e-9


class NearestPoint(eqx.Module):
    """The point, and the largest `violation` of a condition there; the rest explains a failure.

    `residual` is relative to the size of each condition, `slopes` the matrix by which they depend on the unknowns.
    `freedom` says of each unknown how far it can move with all conditions kept, between 0 and 1.
    """

    x: Any
    violation: Any
    residual: Any
    slopes: Any
    freedom: Any


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """For the x nearest to x0, by `weight` and `sizes`, with residual(x, numbers) = 0; a weight of 0 lets nothing move.

    `residual` must not close over numbers that are differentiated.
    """

    residual: Callable[[Any, Any], Any]
    sizes: np.ndarray
    weight: np.ndarray

    @property
    def _scale(self) -> np.ndarray:
        return self.sizes * np.sqrt(self.weight)

    def _measured(self, z: Any, args: Any) -> Any:
        x0, numbers, rows = args
        return self.residual(x0 + self._scale * z, numbers) / rows

    def _rows(self, x0: Any, numbers: Any) -> Any:
        """The size of each condition: what it changes by where all unknowns that move change by their sizes."""
        step = np.where(self.weight > 0, self.sizes, 0.0)
        return row_scale(jax.jacfwd(lambda z: self.residual(x0 + step * z, numbers))(jnp.zeros_like(x0)))

    def best(self, x0: Any, numbers: Any, easy: Any) -> Any:
        """The x that comes nearest to satisfying the conditions, or the nearest one that does; a constant."""
        x0, numbers, easy = jax.lax.stop_gradient((x0, numbers, easy))
        rows = self._rows(x0, numbers)
        z = _searched(self._measured, (x0, numbers, rows), (x0, easy, rows))
        return x0 + self._scale * settled(self._measured, _inverse, z, jnp.zeros_like(x0), (x0, numbers, rows))

    def found(self, best: Any, x0: Any, numbers: Any) -> NearestPoint:
        """The point that `best` found as the implicit function of x0 and numbers that it is."""
        origin, rows = jnp.zeros_like(x0), self._rows(*jax.lax.stop_gradient((x0, numbers)))
        held = jax.lax.stop_gradient((x0, numbers, rows))
        moves = self._scale > 0
        z = jnp.where(moves, (best - held[0]) / np.where(moves, self._scale, 1.0), 0.0)
        slopes, final = jax.jacfwd(self._measured)(z, held), self._measured(z, held)
        violation = jnp.max(jnp.abs(final), initial=0.0)
        x = x0 + self._scale * nearest(self._measured, _inverse, z, origin, (x0, numbers, rows))
        freedom = jnp.where(moves, 1.0 - jnp.sum(_inverse(slopes).T * slopes, axis=0), 0.0)
        return NearestPoint(jnp.where(violation <= CLOSE, x, jnp.nan), violation, final, slopes, freedom)


def _inverse(matrix: Any) -> Any:
    return jnp.linalg.pinv(matrix, rtol=RANK)


def _searched(measured: Callable[[Any, Any], Any], args: Any, easy: Any) -> Any:
    """Directly, or in stages where that fails: from easy numbers to the real ones, conditions taken on bit by bit."""
    direct, missed = _least(measured, jnp.zeros_like(args[0]), args)

    def in_stages() -> Any:
        lacking = measured(jnp.zeros_like(args[0]), easy)
        is_easier = any(a is not b for a, b in zip(jax.tree.leaves(args), jax.tree.leaves(easy), strict=True))
        share = 0.0 if is_easier else 1.0

        def stage(z: Any, s: Any) -> tuple[Any, None]:
            between = jax.tree.map(lambda a, b: a + (1.0 - s) * (b - a), args, easy)
            found, _ = _least(lambda z, args: measured(z, args) - share * (1.0 - s) * lacking, z, between)
            return found, None

        first, _ = _least(measured, jnp.zeros_like(args[0]), easy) if is_easier else (jnp.zeros_like(args[0]), None)
        return jax.lax.scan(stage, first, jnp.linspace(0.0, 1.0, STAGES + 1)[1:])[0]

    return jax.lax.cond(missed <= CLOSE, lambda: direct, in_stages)


def _least(function: Callable[[Any, Any], Any], z: Any, args: Any) -> tuple[Any, Any]:
    found = optx.least_squares(function, METHOD, z, args, max_steps=ITERATIONS, throw=False).value
    return found, jnp.max(jnp.abs(function(found, args)), initial=0.0)
