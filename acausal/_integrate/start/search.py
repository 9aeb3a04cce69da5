"""Nonlinear least-squares search for the point nearest to a given one that satisfies conditions."""

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
# Rank tolerance: directions with singular values below this fraction of the largest are undetermined.
RANK = 1e-9


class NearestPoint(eqx.Module):
    """The point at which a search ended, and the largest `violation` of a condition there.

    The other fields explain a failure. `residual` is relative to the size of each condition, and `slopes` is its
    Jacobian. `freedom` is the diagonal of the projector onto the null space of `slopes`, between 0 (determined) and 1.
    """

    x: Array
    violation: Array
    residual: Array
    slopes: Array
    freedom: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Search:
    """Search for the x nearest to x0 with residual(x, numbers) = 0. `weight` and `sizes` scale the distance, and an
    unknown of weight 0 is fixed. `residual` must not close over differentiated numbers.
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
        """The size of each condition: its change if all free unknowns change by their sizes."""
        step = np.where(self.weight > 0, self.sizes, 0.0)
        return row_scale(jax.jacfwd(lambda z: self.residual(x0 + step * z, numbers))(jnp.zeros_like(x0)))

    def best(self, x0: Array, numbers: PyTree, easy: PyTree = None) -> tuple[Array, Array]:
        """The solution x nearest to x0, or the x with the smallest residual if there is no solution. Returns x and the
        residual, as constants.

        If the direct search fails, a homotopy follows in stages: from the `easy` numbers to the actual ones or,
        without `easy`, from the residual at x0 to zero.
        """
        x0, numbers, easy = jax.lax.stop_gradient((x0, numbers, easy))
        args = (x0, numbers, self._rows(x0, numbers))
        direct = _least(self._measured, jnp.zeros_like(x0), args)
        z, lack = jax.lax.cond(is_met(direct[1]), lambda: direct, lambda: _in_stages(self._measured, args, easy))
        return self._refined(z, args), lack

    def direct(self, x0: Array, numbers: PyTree) -> Array:
        """The same as `best`, without the homotopy. Returns x0 if the search finds no solution."""
        x0, numbers = jax.lax.stop_gradient((x0, numbers))
        args = (x0, numbers, self._rows(x0, numbers))
        z, lack = _least(self._measured, jnp.zeros_like(x0), args)
        return jnp.where(is_met(lack), self._refined(z, args), x0)

    def _refined(self, z: Array, args: PyTree) -> Array:
        end = refined(self._measured, _inverse, z, jnp.zeros_like(z), args)
        return args[0] + self._scale * jnp.where(is_met(self._measured(end, args)), end, z)

    def found(self, best: Array, x0: Array, numbers: PyTree) -> NearestPoint:
        """The point that `best` found, as an implicit function of x0 and numbers."""
        moves, held = self._scale > 0, self._held(x0, numbers)
        z = self._distance(best, held[0])
        slopes, final = jax.jacfwd(self._measured)(z, held), self._measured(z, held)
        violation = jnp.max(jnp.abs(final), initial=0.0)
        x = self._nearest(z, x0, numbers, held[2])
        freedom = jnp.where(moves, 1.0 - jnp.sum(_inverse(slopes).T * slopes, axis=0), 0.0)
        return NearestPoint(x, violation, final, slopes, freedom)

    def followed(self, best: Array, x0: Array, numbers: PyTree) -> Array:
        """The end point of `best`, differentiable in x0 and numbers even if the conditions are not satisfied."""
        held = self._held(x0, numbers)
        return self._nearest(self._distance(best, held[0]), x0, numbers, held[2])

    def _held(self, x0: Array, numbers: Array) -> PyTree:
        x0, numbers = jax.lax.stop_gradient((x0, numbers))
        return x0, numbers, self._rows(x0, numbers)

    def _distance(self, x: Array, x0: Array) -> Array:
        """The distance of x from x0, in the scale of each unknown; zero for fixed unknowns."""
        return jnp.where(self._scale > 0, (x - x0) / np.where(self._scale > 0, self._scale, 1.0), 0.0)

    def _nearest(self, z: Array, x0: Array, numbers: PyTree, rows: Array) -> Array:
        return x0 + self._scale * nearest(self._measured, _inverse, z, jnp.zeros_like(x0), (x0, numbers, rows))


def _inverse(matrix: Array) -> Array:
    """The pseudo-inverse. Rows are scaled, since the rank depends on their directions; those below RANK are noise."""
    rows = jnp.maximum(jax.lax.stop_gradient(row_scale(matrix)), RANK)
    return jnp.linalg.pinv(matrix / rows[:, None], rtol=RANK) / rows


def is_met(lack: Array) -> Array:
    """Whether these residuals satisfy the conditions to within the tolerance."""
    return jnp.all(jnp.abs(lack) <= CLOSE)


def _in_stages(measured: Callable[[Array, PyTree], Array], args: PyTree, easy: PyTree) -> tuple[Array, Array]:
    """Follows the homotopy, starting each stage from the previous solution. Returns the solution and its residual."""
    origin = jnp.zeros_like(args[0])
    if easy is None:
        first, others, lacking = origin, args, measured(origin, args)
    else:
        others = (args[0], easy, args[2])
        first, lacking = _least(measured, origin, others)[0], 0.0

    def stage(z: Array, s: Array) -> tuple[Array, Array]:
        # Equal numbers are not interpolated: both may be infinite, such as the position of an absent stop.
        between = jax.tree.map(
            lambda a, b: a if a is b else jnp.where(a == b, a, a + (1.0 - s) * (b - a)), args, others
        )
        return _least(lambda z, args: measured(z, args) - (1.0 - s) * lacking, z, between)

    z, lacks = jax.lax.scan(stage, first, jnp.linspace(0.0, 1.0, STAGES + 1)[1:])
    return z, lacks[-1]


def _least(function: Callable[[Array, PyTree], Array], z: Array, args: PyTree) -> tuple[Array, Array]:
    found = optx.least_squares(function, METHOD, z, args, max_steps=ITERATIONS, throw=False).value
    return found, function(found, args)
