"""Roots of small systems of nonlinear equations."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._linear_solver import factors_of
from .._numbers import Numbers, Truth
from .._tracing import pushed
from .affine import computed
from .elimination import SMALL, eliminated


def powell_step(value: Array, slopes: Array, newton: Array, radius: Array) -> Array:
    """The step that reduces |value + slopes step| on the dogleg path (Nocedal and Wright, Numerical Optimization, 2006,
    section 4.1). The path ends at the minimum along the steepest descent if Newton's step is not finite.
    """
    gradient = value @ slopes
    image = slopes @ gradient
    descent = -(gradient @ gradient) / (image @ image) * gradient
    end = jnp.where(jnp.all(jnp.isfinite(newton)), newton, descent)
    rest = end - descent
    first, last = jnp.linalg.norm(descent), jnp.linalg.norm(end)
    a, b, c = rest @ rest, descent @ rest, radius**2 - descent @ descent
    share = c / (b + jnp.sqrt(jnp.maximum(b**2 + a * c, 0.0)))
    across = descent + jnp.where(jnp.isfinite(share), share, 0.0) * rest
    return jnp.where(last <= radius, end, jnp.where(first >= radius, radius / first * descent, across))


ITERATIONS = 200
CLOSE = 1e-9  # step of Newton's method that leaves an error near rounding
NEAR = 1e-7  # the same in a trust region, which stalls where rounding hides the progress of a step

Residual = Callable[[Array, PyTree], tuple[Array, Truth]]


def scaled_root(residual: Residual, starts: Array, args: PyTree) -> Array:
    """A root of a function of unknowns of size 1; NaN if none is found.

    The function gives its value and whether the unknowns are in their ranges. The search starts from each of the
    `starts`, [tries, unknowns], until it finds a root: by Newton's method; if that fails, or finds a root outside the
    ranges, by Powell's method, whose steps stay inside. The function may not close over numbers of the run. Only the
    root is differentiated, as an implicit function: at the end of a failed search, the function may have no derivative.
    """
    return _root(residual, jax.lax.stop_gradient(starts), args)


@ft.partial(jax.custom_jvp, nondiff_argnums=(0,))
def _root(residual: Residual, starts: Array, args: PyTree) -> Array:
    return searched(residual, starts, args)


@ft.partial(_root.defjvp, symbolic_zeros=True)
def _tangent(residual: Residual, primals: Sequence[PyTree], tangents: Sequence[PyTree]) -> tuple[Array, Numbers]:
    starts, args = primals
    x = _root(residual, starts, args)
    slopes = jax.jacfwd(lambda x: residual(x, args)[0])(x)
    _, lack = pushed(lambda args: residual(x, args)[0], (args,), (tangents[1],))
    return x, _solved(slopes, -lack)


class _Point(NamedTuple):
    """A point with the residual, its slopes and their factors, and the Newton step from it."""

    x: Array
    value: Array
    slopes: Array
    factors: Any
    step: Array
    is_inside: Array

    def is_close(self, size: float) -> Array:
        return jnp.all(jnp.abs(self.step) <= size * (1.0 + jnp.abs(self.x)))

    def is_finite(self) -> Array:
        return jnp.all(jnp.isfinite(self.value)) & jnp.all(jnp.isfinite(self.slopes))


class _Search(NamedTuple):
    """A search: its best point, the next one, the index of the start, and the number of iterations from it. `share` is
    the damping factor of Newton's step, `radius` that of the trust region.
    """

    at: _Point
    next: Array
    start: Array
    tried: Array
    uses_powell: Array
    share: Array
    radius: Array
    scale: Array
    is_root: Array


@ft.partial(jax.jit, static_argnums=0)
def searched(residual: Residual, starts: Array, args: PyTree) -> Array:
    """The root found from the first start that leads to one. Traced once for equal functions.

    Both methods are one loop, so that the equations are compiled once.
    """

    def evaluated(x: Array) -> _Point:
        def both(x: Array) -> tuple[Array, tuple[Array, Truth]]:
            value, is_inside = residual(x, args)
            return value, (value, is_inside)

        slopes, (value, is_inside) = jax.jacfwd(both, has_aux=True)(x)
        factors = factors_of(slopes)
        return _Point(x, value, slopes, factors, factors.solve(value), jnp.asarray(is_inside))

    def goes_on(search: _Search) -> Array:
        return ~search.is_root & (search.start < len(starts))

    def another(search: _Search) -> _Search:
        new = evaluated(search.next)
        return _either(search.uses_powell, _powell(search, new, starts), _newton(search, new, starts))

    nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(evaluated, starts[0]))
    last = jax.lax.while_loop(goes_on, another, _begun(nothing, starts, jnp.asarray(0), jnp.asarray(False)))
    return jnp.where(last.is_root, last.at.x - last.at.step, jnp.nan)


def _either(truth: Array, first: PyTree, second: PyTree) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(truth, a, b), first, second)


def _begun(at: _Point, starts: Array, start: Array, uses_powell: Array) -> _Search:
    """A search at one of the starts, before its first iteration."""
    first = starts[jnp.minimum(start, len(starts) - 1)]
    one, no = jnp.asarray(1.0), jnp.asarray(False)
    return _Search(at, first, start, jnp.asarray(0), uses_powell, one, one, jnp.ones_like(first), no)


def _newton(search: _Search, new: _Point, starts: Array) -> _Search:
    """One iteration of Newton's method.

    A step is shortened until the next simplified step, with the same Jacobian, is shorter than it: the natural
    monotonicity test (Deuflhard, `Newton Methods for Nonlinear Problems`, 2004, section 3.3). It does not depend on the
    units and slopes of the equations. The residual itself may fall along a path away from the root, such as that of a
    closed valve.
    """
    at, share, is_first = search.at, search.share, search.tried == 0
    simplified, length = jnp.linalg.norm(at.factors.solve(new.value)), jnp.linalg.norm(at.step)
    is_better = is_first | (simplified <= (1.0 - 0.25 * share) * length)
    is_close = is_better & new.is_close(CLOSE)
    is_outside = is_close & ~is_first & at.is_close(CLOSE) & ~new.is_inside
    at = _either(is_better, new, at)
    share = jnp.where(is_better, jnp.where(is_first, 1.0, jnp.minimum(4.0 * share, 1.0)), 0.5 * share)
    went = search._replace(
        at=at, next=at.x - share * at.step, tried=search.tried + 1, share=share, is_root=is_close & new.is_inside
    )
    fails = is_outside | ~jnp.all(jnp.isfinite(at.step)) | (~went.is_root & (went.tried >= ITERATIONS))
    return _either(fails, _begun(at, starts, search.start, jnp.asarray(True)), went)


def _powell(search: _Search, new: _Point, starts: Array) -> _Search:
    """One iteration of Powell's method in a trust region. Each residual is scaled by its change over a step of size 1
    from the start. Points outside the ranges are rejected.
    """
    at, is_first = search.at, search.tried == 0
    scale = jnp.where(is_first, row_scale(new.slopes), search.scale)
    move = search.next - at.x
    before, after, expected = (
        jnp.sum((value / scale) ** 2) for value in (at.value, new.value, at.value + at.slopes @ move)
    )
    ratio = (before - after) / (before - expected)
    is_better = is_first | ((ratio > 0.01) & new.is_inside & new.is_finite())
    length = jnp.linalg.norm(move)
    grown = jnp.where((ratio > 0.75) & (length > 0.99 * search.radius), 2.0 * search.radius, search.radius)
    radius = jnp.where(is_better & (ratio > 0.25), grown, 0.25 * length)
    reach = jnp.linalg.norm(new.step)
    radius = jnp.where(is_first, jnp.where(jnp.isfinite(reach), reach, 1.0), radius)
    at = _either(is_better, new, at)
    is_root = is_better & new.is_close(NEAR) & new.is_inside
    following = at.x + powell_step(at.value / scale, at.slopes / scale[:, None], -at.step, radius)
    went = search._replace(at=at, next=following, tried=search.tried + 1, radius=radius, scale=scale, is_root=is_root)
    fails = ~is_root & ((went.tried >= ITERATIONS) | ~jnp.all(jnp.isfinite(following)))
    return _either(fails, _begun(at, starts, search.start + 1, jnp.asarray(False)), went)


def row_scale(slopes: Array) -> Array:
    """The change of each residual by a step of size 1 in the unknowns; 1 if unknown."""
    total = jnp.sum(jnp.abs(slopes), axis=1)
    return jnp.where(jnp.isfinite(total) & (total > 0), total, 1.0)


def _solved(matrix: Array, value: Array) -> Array:
    """The solution of a linear system."""
    scale = jax.lax.stop_gradient(row_scale(matrix))
    matrix, value = matrix / scale[:, None], value / scale
    if len(value) > SMALL:
        return jnp.linalg.solve(matrix, value)
    return jnp.stack([computed(x) for x in eliminated([list(row) for row in matrix], list(-value))])
