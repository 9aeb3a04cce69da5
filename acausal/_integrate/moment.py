"""The moment of an event as a function of all numbers of a run, differentiable to the second order in both modes."""

import functools as ft
from collections.abc import Sequence
from typing import Any, Protocol

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero


class Laws(Protocol):
    """What moves a stepped vector, and the margins whose zeros are moments."""

    def rates(self, t: Any, y: Any, given: Any) -> Any:
        """The derivative of the vector in time."""
        ...

    def margin(self, number: Any, t: Any, y: Any, due: Any, given: Any) -> Any:
        """What is zero at the moment of an event."""
        ...


@ft.partial(jax.custom_jvp, nondiff_argnums=(0,))
def carried_to_moment(laws: Laws, number: Any, t: Any, before: Any, ys: Any, due: Any, given: Any) -> tuple[Any, Any]:
    r"""The moment of event `number`, which is at t, and the vectors `ys` there.

    As numbers both are what they were: t has been located. But $t^*$ depends on whatever the run depends on. With
    $y(t^*)$ on the solution through $(t, y)$, and the margin $g$ of the first vector,

    $$g(t^*, y(t^*)) = 0, \qquad \mathrm{d}t^* = -\frac{\mathrm{d}g}{g_t + g_y f}, \qquad
    \mathrm{d}y^* = \mathrm{d}y + f\,\mathrm{d}t^*,$$

    where dg and dy are changes at a fixed time. A margin that does not change with time has no moment of its own. The
    rates f are those up to the moment, at the time `before`, since equations may change their law with it.
    """
    del laws, number, before, due, given
    return t, ys


@ft.partial(carried_to_moment.defjvp, symbolic_zeros=True)
def _derivative(laws: Laws, primals: Sequence[Any], tangents: Sequence[Any]) -> tuple[Any, Any]:
    number, t, before, ys, due, given = primals
    _, dt, _, dys, ddue, dgiven = tangents
    moment, there = carried_to_moment(laws, number, t, before, ys, due, given)
    dt, dys = _array(dt), _array(dys)

    def rates(t: Any, ys: Any, given: Any) -> Any:
        return jax.vmap(lambda y: laws.rates(t, y, given))(ys)

    f, df = _pushed(rates, (jax.lax.stop_gradient(before - t) + moment, there, given), (dt, dys, dgiven))
    # The vectors a little later have changed by this much; the time that has elapsed is zero, but has a derivative.
    dys = dys + (moment - t) * df

    def margin(t: Any, y: Any, due: Any, given: Any) -> Any:
        return laws.margin(number, t, y, due, given)

    _, dg = _pushed(margin, (moment, there[0], due, given), (dt, dys[0], ddue, dgiven))
    _, slope = jax.jvp(lambda t, y: margin(t, y, due, given), (moment, there[0]), (jnp.ones_like(moment), f[0]))
    later = jnp.where(slope != 0, -dg / jnp.where(slope != 0, slope, 1.0), 0.0)
    return (moment, there), (dt + later, dys + f * later)


def _array(tangent: Any) -> Any:
    return jnp.zeros(tangent.shape) if isinstance(tangent, SymbolicZero) else tangent


def _pushed(function: Any, primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Any, Any]:
    """`jax.jvp` along those leaves only that change."""
    leaves, structure = jax.tree_util.tree_flatten(primals)
    directions = jax.tree_util.tree_leaves(tangents, is_leaf=lambda x: isinstance(x, SymbolicZero))
    moving = [i for i, direction in enumerate(directions) if not isinstance(direction, SymbolicZero)]

    def of_moving(*values: Any) -> Any:
        whole = list(leaves)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return function(*structure.unflatten(whole))

    return jax.jvp(of_moving, tuple(leaves[i] for i in moving), tuple(directions[i] for i in moving))
