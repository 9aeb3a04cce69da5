"""Roots of small systems of non-linear equations."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import optimistix as optx
from jax import Array
from jaxtyping import PyTree

from .._numbers import Truth
from .affine import computed
from .elimination import SMALL, eliminated

ITERATIONS = 100
HUGE = 1e100
# Both methods converge quadratically: a last step this small leaves an error near rounding. A trust region stalls where
# rounding hides the progress of a step, so its tolerance stays well above.
NEWTON = optx.Newton(rtol=1e-9, atol=1e-9)
# Powell's dogleg: Newton's steps, shortened where they do not help, as where a diode's exponential overshoots.
DOGLEG = optx.Dogleg(rtol=1e-7, atol=1e-7)

Test = Callable[[Array, PyTree], Truth]


def scaled_root(
    residual: Callable[[Array, PyTree], Array], starts: Array, args: PyTree, is_inside: Test | None = None
) -> Array:
    """A root of a function of unknowns of size 1; NaN where none is found.

    Each residual is measured in the change that a step of size 1 makes in it where the search starts. The search goes
    from the first of the `starts`, [tries, unknowns], from which a root is found: by Newton's method; where that fails,
    or finds a root that is not inside what `is_inside(x, args)` admits, by Powell's, whose steps stay inside. Only the
    root is differentiated, by the implicit function theorem: where a method ends that fails, the function may have no
    derivative.
    """

    def scaled(x: Array, args: PyTree) -> Array:
        scale, args = args
        # A trial step into overflow must count as a bad one, which infinity or NaN do not in a comparison.
        value = residual(x, args) / scale
        return jnp.where(jnp.isfinite(value), value, HUGE)

    def fenced(x: Array, args: PyTree) -> Array:
        value = scaled(x, args)
        return value if is_inside is None else jnp.where(is_inside(x, args[1]), value, HUGE)

    def attempt(start: Array, args: PyTree) -> tuple[Array, Array]:
        scaling = row_scale(jax.jacfwd(residual)(start, args)), args
        root, is_good = _found(scaled, NEWTON, start, scaling)
        if is_inside is not None:
            is_good &= is_inside(root, args)
        return jax.lax.cond(is_good, lambda: (root, is_good), lambda: _found(fenced, DOGLEG, start, scaling))

    def search(starts: Array, args: PyTree) -> Array:
        if len(starts) == 1:
            return _or_nan(*attempt(starts[0], args))

        def another(tried: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            return tried[0] + 1, *attempt(starts[tried[0]], args)

        none = (jnp.asarray(0), starts[0], jnp.asarray(False))
        return _or_nan(*jax.lax.while_loop(lambda tried: ~tried[2] & (tried[0] < len(starts)), another, none)[1:])

    held, first = jax.lax.stop_gradient((args, starts))
    return jax.lax.custom_root(lambda x: residual(x, args), starts[0], lambda *_: search(first, held), _solved)


def row_scale(slopes: Array) -> Array:
    """How much a step of size 1 in the unknowns changes each residual; 1 where that is not known."""
    total = jnp.sum(jnp.abs(slopes), axis=1)
    return jnp.where(jnp.isfinite(total) & (total > 0), total, 1.0)


def _found(
    function: Callable[[Array, PyTree], Array], method: optx.Newton | optx.Dogleg, start: Array, args: PyTree
) -> tuple[Array, Array]:
    found = optx.root_find(function, method, start, args, max_steps=ITERATIONS, throw=False)
    return found.value, (found.result == optx.RESULTS.successful) & jnp.all(jnp.isfinite(found.value))


def _or_nan(root: Array, is_good: Array) -> Array:
    return jnp.where(is_good, root, jnp.nan)


def _solved(slope: Callable[[Array], Array], value: Array) -> Array:
    """The x of a linear function at which it has a value."""
    matrix = jax.jacfwd(slope)(jnp.zeros_like(value))
    scale = row_scale(matrix)
    matrix, value = matrix / scale[:, None], value / scale
    if len(value) > SMALL:
        return jnp.linalg.solve(matrix, value)
    return jnp.stack([computed(x) for x in eliminated([list(row) for row in matrix], list(-value))])
