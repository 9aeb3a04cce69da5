"""The search for a point that satisfies conditions, near another one."""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array
from jaxtyping import PyTree

from ..._evaluate.constraints import CLOSE
from ..._evaluate.implicit import nearest, refined
from ..._evaluate.roots import row_scale

ITERATIONS = 200
METHOD = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
STAGES = 20  # steps of a homotopy
# Singular values below this share of the largest count as zero: what moves a point no more than that is undetermined.
RANK = 1e-9


class NearestPoint(eqx.Module):
    """The point at which a search ended, and the largest `violation` of a condition there; the rest explains a failure.

    `residual` is relative to the size of each condition, `slopes` the matrix by which they depend on the unknowns.
    `freedom` says of each unknown how far it can move with all conditions kept, between 0 and 1.
    """

    x: Array
    violation: Array
    residual: Array
    slopes: Array
    freedom: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """For the x nearest to x0, by `weight` and `sizes`, with residual(x, numbers) = 0; a weight of 0 lets nothing move.

    `residual` must not close over numbers that are differentiated.
    """

    residual: Callable[[Array, PyTree], Array]
    sizes: np.ndarray
    weight: np.ndarray

    @property
    def _scale(self) -> np.ndarray:
        return self.sizes * np.sqrt(self.weight)

    def _measured(self, z: Array, args: PyTree) -> Array:
        x0, numbers, rows = args
        return self.residual(x0 + self._scale * z, numbers) / rows

    def _rows(self, x0: Array, numbers: Array) -> Array:
        """The size of each condition: what it changes by where all unknowns that move change by their sizes."""
        step = np.where(self.weight > 0, self.sizes, 0.0)
        return row_scale(jax.jacfwd(lambda z: self.residual(x0 + step * z, numbers))(jnp.zeros_like(x0)))

    def best(self, x0: Array, numbers: PyTree, easy: PyTree = None) -> tuple[Array, Array]:
        """The x that comes nearest to satisfying the conditions, or the nearest one that does, and what is lacking
        there; constants.

        Directly, or in stages where that fails: from `easy` numbers to the real ones, or else from what the conditions
        lack at x0 to nothing.
        """
        x0, numbers, easy = jax.lax.stop_gradient((x0, numbers, easy))
        args = (x0, numbers, self._rows(x0, numbers))
        direct = _least(self._measured, jnp.zeros_like(x0), args)
        z, lack = jax.lax.cond(is_met(direct[1]), lambda: direct, lambda: _in_stages(self._measured, args, easy))
        return self._refined(z, args), lack

    def direct(self, x0: Array, numbers: PyTree) -> Array:
        """As `best`, but without stages; x0 where nothing satisfies the conditions."""
        x0, numbers = jax.lax.stop_gradient((x0, numbers))
        args = (x0, numbers, self._rows(x0, numbers))
        z, lack = _least(self._measured, jnp.zeros_like(x0), args)
        return jnp.where(is_met(lack), self._refined(z, args), x0)

    def _refined(self, z: Array, args: PyTree) -> Array:
        return args[0] + self._scale * refined(self._measured, _inverse, z, jnp.zeros_like(z), args)

    def found(self, best: Array, x0: Array, numbers: PyTree) -> NearestPoint:
        """The point that `best` found as the implicit function of x0 and numbers that it is."""
        moves, held = self._scale > 0, self._held(x0, numbers)
        z = self._moved(best, held[0])
        slopes, final = jax.jacfwd(self._measured)(z, held), self._measured(z, held)
        violation = jnp.max(jnp.abs(final), initial=0.0)
        x = self._nearest(z, x0, numbers, held[2])
        freedom = jnp.where(moves, 1.0 - jnp.sum(_inverse(slopes).T * slopes, axis=0), 0.0)
        return NearestPoint(x, violation, final, slopes, freedom)

    def followed(self, best: Array, x0: Array, numbers: PyTree) -> Array:
        """The end of `best`, made differentiable by x0 and numbers, also where conditions are not met."""
        held = self._held(x0, numbers)
        return self._nearest(self._moved(best, held[0]), x0, numbers, held[2])

    def _held(self, x0: Array, numbers: Array) -> PyTree:
        x0, numbers = jax.lax.stop_gradient((x0, numbers))
        return x0, numbers, self._rows(x0, numbers)

    def _moved(self, x: Array, x0: Array) -> Array:
        """How far x is from x0, in the unit of each unknown."""
        return jnp.where(self._scale > 0, (x - x0) / np.where(self._scale > 0, self._scale, 1.0), 0.0)

    def _nearest(self, z: Array, x0: Array, numbers: PyTree, rows: Array) -> Array:
        return x0 + self._scale * nearest(self._measured, _inverse, z, jnp.zeros_like(x0), (x0, numbers, rows))


def _inverse(matrix: Array) -> Array:
    return jnp.linalg.pinv(matrix, rtol=RANK)


def is_met(lack: Array) -> Array:
    """Whether conditions are met that lack this much."""
    return jnp.all(jnp.abs(lack) <= CLOSE)


def _in_stages(measured: Callable[[Array, PyTree], Array], args: PyTree, easy: PyTree) -> tuple[Array, Array]:
    """Along a homotopy, each stage from where the last one ended; and what is lacking at its end."""
    origin = jnp.zeros_like(args[0])
    if easy is None:
        first, others, lacking = origin, args, measured(origin, args)
    else:
        others = (args[0], easy, args[2])
        first, lacking = _least(measured, origin, others)[0], 0.0

    def stage(z: Array, s: Array) -> tuple[Array, Array]:
        # Equal numbers are left as they are: both may be infinite, as the place of a stop that a model leaves out.
        between = jax.tree.map(lambda a, b: jnp.where(a == b, a, a + (1.0 - s) * (b - a)), args, others)
        return _least(lambda z, args: measured(z, args) - (1.0 - s) * lacking, z, between)

    z, lacks = jax.lax.scan(stage, first, jnp.linspace(0.0, 1.0, STAGES + 1)[1:])
    return z, lacks[-1]


def _least(function: Callable[[Array, PyTree], Array], z: Array, args: PyTree) -> tuple[Array, Array]:
    found = optx.least_squares(function, METHOD, z, args, max_steps=ITERATIONS, throw=False).value
    return found, function(found, args)
