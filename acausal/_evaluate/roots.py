"""Roots of small systems of nonlinear equations."""

import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jax import Array
from jaxtyping import PyTree

from .._linear_solver import factors_of
from .._numbers import Truth
from .affine import computed
from .elimination import SMALL, eliminated

ITERATIONS = 200
HUGE = 1e100
CLOSE = 1e-9  # last step of Newton's method that leaves an error near rounding
# Powell's dogleg: a trust region stalls where rounding hides the progress of a step, so its tolerance stays well above.
DOGLEG = optx.Dogleg(rtol=1e-7, atol=1e-7)

Residual = Callable[[Array, PyTree], Array]
Test = Callable[[Array, PyTree], Truth]


def scaled_root(residual: Residual, starts: Array, args: PyTree, is_inside: Test | None = None) -> Array:
    """A root of a function of unknowns of size 1; NaN if none is found.

    The search starts from each of the `starts`, [tries, unknowns], until it finds a root: by Newton's method; if that
    fails, or finds a root outside `is_inside(x, args)`, by Powell's method, whose steps stay inside. Neither function
    may close over numbers of the run. Only the root is differentiated, by the implicit function theorem: at the end of
    a failed search, the function may have no derivative.
    """

    held, first = jax.lax.stop_gradient((args, starts))
    return jax.lax.custom_root(
        lambda x: residual(x, args), starts[0], lambda *_: _searched(residual, is_inside, first, held), _solved
    )


@ft.partial(jax.jit, static_argnums=(0, 1))
def _searched(residual: Residual, is_inside: Test | None, starts: Array, args: PyTree) -> Array:
    """The root found from the first start that leads to one. Traced once for equal functions."""

    def attempt(start: Array) -> tuple[Array, Array]:
        root, is_good = newton(residual, start, args)
        if is_inside is not None:
            is_good &= is_inside(root, args)
        return jax.lax.cond(is_good, lambda: (root, is_good), lambda: _dogleg(residual, start, args, is_inside))

    if len(starts) == 1:
        return _or_nan(*attempt(starts[0]))

    def another(tried: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        return tried[0] + 1, *attempt(starts[tried[0]])

    none = (jnp.asarray(0), starts[0], jnp.asarray(False))
    return _or_nan(*jax.lax.while_loop(lambda tried: ~tried[2] & (tried[0] < len(starts)), another, none)[1:])


class _Iterate(NamedTuple):
    """An iterate of Newton's method: the point, its step, the factors of its Jacobian, and the next step length."""

    x: Array
    step: Array
    factors: Any
    share: Array
    tried: Array
    is_root: Array


def newton(function: Callable[[Array, PyTree], Array], start: Array, args: PyTree) -> tuple[Array, Array]:
    """A root by Newton's method, and whether it has converged.

    A step is shortened until the next simplified step, with the same Jacobian, is shorter than it: the natural
    monotonicity test (Deuflhard, `Newton Methods for Nonlinear Problems`, 2004, section 3.3). It does not depend on the
    units and slopes of the equations. The residual itself may fall along a path away from the root, such as that of a
    closed valve.
    """

    def residual(x: Array) -> tuple[Array, Array]:
        value = function(x, args)
        return value, value

    def linearised(x: Array) -> tuple[Array, Any]:
        slopes, value = jax.jacfwd(residual, has_aux=True)(x)
        return value, factors_of(slopes)

    def goes_on(at: _Iterate) -> Array:
        return ~at.is_root & (at.tried < ITERATIONS) & jnp.all(jnp.isfinite(at.step))

    def another(at: _Iterate) -> _Iterate:
        x = at.x - at.share * at.step
        value, factors = linearised(x)
        step = factors.solve(value)
        simplified, length = jnp.linalg.norm(at.factors.solve(value)), jnp.linalg.norm(at.step)
        is_better = (at.tried == 0) | (simplified <= (1.0 - 0.25 * at.share) * length)
        is_root = is_better & jnp.all(jnp.abs(step) <= CLOSE * (1.0 + jnp.abs(x)))
        new = _Iterate(x, step, factors, jnp.minimum(4.0 * at.share, 1.0), at.tried + 1, is_root)
        old = at._replace(share=0.5 * at.share, tried=at.tried + 1)
        return jax.tree.map(lambda a, b: jnp.where(is_better, a, b), new, old)

    nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(linearised, start)[1])
    first = _Iterate(start, jnp.zeros_like(start), nothing, jnp.asarray(1.0), jnp.asarray(0), jnp.asarray(False))
    last = jax.lax.while_loop(goes_on, another, first)
    return last.x - last.step, last.is_root


def _dogleg(
    residual: Callable[[Array, PyTree], Array], start: Array, args: PyTree, is_inside: Test | None
) -> tuple[Array, Array]:
    """A root by Powell's method. Each residual is scaled by its change over a step of size 1 from the start."""

    def fenced(x: Array, args: PyTree) -> Array:
        scale, args = args
        # A trial step into overflow must be rejected; comparisons with infinity or NaN do not reject it.
        value = residual(x, args) / scale
        is_good = jnp.isfinite(value)
        return jnp.where(is_good if is_inside is None else is_good & is_inside(x, args), value, HUGE)

    scaling = row_scale(jax.jacfwd(residual)(start, args)), args
    found = optx.root_find(fenced, DOGLEG, start, scaling, max_steps=ITERATIONS, throw=False)
    return found.value, (found.result == optx.RESULTS.successful) & jnp.all(jnp.isfinite(found.value))


def row_scale(slopes: Array) -> Array:
    """The change of each residual by a step of size 1 in the unknowns; 1 if unknown."""
    total = jnp.sum(jnp.abs(slopes), axis=1)
    return jnp.where(jnp.isfinite(total) & (total > 0), total, 1.0)


def _or_nan(root: Array, is_good: Array) -> Array:
    return jnp.where(is_good, root, jnp.nan)


def _solved(slope: Callable[[Array], Array], value: Array) -> Array:
    """The x at which a linear function has a value."""
    matrix = jax.jacfwd(slope)(jnp.zeros_like(value))
    scale = row_scale(matrix)
    matrix, value = matrix / scale[:, None], value / scale
    if len(value) > SMALL:
        return jnp.linalg.solve(matrix, value)
    return jnp.stack([computed(x) for x in eliminated([list(row) for row in matrix], list(-value))])
