"""Results of iterations as implicit functions of their inputs, differentiable to any order in both modes."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._linear_solver import linear_solver
from .._numbers import Numbers
from .._tracing import array_of, pushed

MOST = 20  # maximum number of Newton iterations for the nearest point
STILL = 1e-14  # step size, in the unit of the unknowns, that ends the iteration
FARTHER = 1e-6  # relative growth of the distance that rounding may cause

Function = Callable[[Array, PyTree], Array]
Inverse = Callable[[Array], Array]


class _Here(NamedTuple):
    """The value of g at a point, and derivatives with multipliers m: C = dg/dx, its pseudo-inverse, H = d(C^T m)/dx."""

    value: Array
    slopes: Array
    inverse: Array
    multipliers: Array
    bend: Array

    def step(self, pull: Array, lack: Array) -> Numbers:
        """The solution dx of (1 + H) dx + C^T dm = -pull and C dx = -lack."""
        onto = -(self.inverse @ lack)
        if not onto.size:  # a model without states, parameters to find and unknowns
            return onto
        one = jnp.eye(len(onto))
        free = one - self.inverse @ self.slopes
        along = free @ (pull + self.bend @ onto)
        return onto - free @ linear_solver(one + free @ self.bend @ free, is_refined=True)(along)


def nearest(g: Function, inverse: Inverse, x: Array, start: Array, args: PyTree) -> Array:
    r"""The point `x`, made differentiable: the solution of g(x, args) = 0 nearest to `start`.

    Its value is unchanged. Its derivatives are those of the solution of

    $$x - x_0 + C^T m = 0, \qquad g(x, p) = 0, \qquad C = \partial g / \partial x,$$

    with multipliers m. If g determines x, it is a root and does not depend on the start. `inverse` computes the
    pseudo-inverse of a matrix; if the rows of C are dependent, m has minimum norm. The tangent is
    expressed by this function, so that it can itself be differentiated. Neither function may close over numbers
    that are differentiated.
    """
    x, start, args = jax.tree_util.tree_map(jnp.asarray, (jax.lax.stop_gradient(x), start, args))
    return _nearest(g, inverse, x, start, args)


@ft.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _nearest(g: Function, inverse: Inverse, x: Array, start: Array, args: PyTree) -> Array:
    del g, inverse, start, args
    return x


@ft.partial(_nearest.defjvp, symbolic_zeros=True)
def _tangent(
    g: Function, inverse: Inverse, primals: Sequence[PyTree], tangents: Sequence[PyTree]
) -> tuple[Array, Numbers]:
    x, start, args = primals
    _, dstart, dargs = tangents
    x = _nearest(g, inverse, x, start, args)
    here = _here(g, inverse, x, start, args)
    _, lack = pushed(lambda args: g(x, args), (args,), (dargs,))
    _, pull = pushed(lambda args: _pull(g, here.multipliers, x, args), (args,), (dargs,))
    return x, here.step(pull - array_of(dstart), lack)


def refined(g: Function, inverse: Inverse, x: Array, start: Array, args: PyTree) -> Array:
    """The point nearest to `start` with g(x, args) = 0, by Newton's method on the equations of `nearest`, from such a
    point x near it; x itself if that does not converge.
    """

    def step(carry: PyTree) -> PyTree:
        count, _, x = carry
        here = _here(g, inverse, x, start, args)
        move = here.step(x - start, here.value)
        return count + 1, jnp.max(jnp.abs(move), initial=0.0), x + move

    def goes_on(carry: PyTree) -> Numbers:
        count, size, x = carry
        return (count < MOST) & (size > STILL * (1.0 + jnp.max(jnp.abs(x), initial=0.0)))

    _, size, end = jax.lax.while_loop(goes_on, step, (0, jnp.asarray(jnp.inf), x))
    before, after = (jnp.linalg.norm(point - start) for point in (x, end))
    # Newton's method may have found another root: the result must not be farther from `start` than x, except for about
    # the first step, which meets the conditions.
    slopes, value = valued_slopes(g)(x, args)
    needed = 2.0 * jnp.linalg.norm(inverse(slopes) @ value)
    # Rounding may keep the last step above STILL: below FARTHER, it also counts as converged.
    is_good = (size < FARTHER) & (after <= before + needed + FARTHER * (1.0 + before))
    return jnp.where(is_good, end, x)


def _here(g: Function, inverse: Inverse, x: Array, start: Array, args: PyTree) -> _Here:
    slopes, value = valued_slopes(g)(x, args)
    found = inverse(slopes)
    multipliers = -(found.T @ (x - start))
    return _Here(value, slopes, found, multipliers, jax.jacfwd(lambda x: _pull(g, multipliers, x, args))(x))


def valued_slopes(g: Callable[..., Array]) -> Callable[..., tuple[Array, Array]]:
    """The Jacobian of a function by its first argument, and its value, from one evaluation."""

    def twice(*arguments: Any) -> tuple[Array, Array]:
        value = g(*arguments)
        return value, value

    return jax.jacfwd(twice, has_aux=True)


def _pull(g: Function, multipliers: Array, x: Array, args: PyTree) -> Array:
    """C^T m."""
    return jax.vjp(lambda x: g(x, args), x)[1](multipliers)[0]
