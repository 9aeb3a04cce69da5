"""The time of an event as a function of all numbers of a run, differentiable to second order in both modes."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..._tracing import array_of, pushed

STILL = 1e-8  # rate of an event indicator, relative to that on the path, below which only an error moved it to zero


class Approach(NamedTuple):
    """Data of a step just before an event: a time just `before` it, and the `rates` of the event indicators on the path
    of the step. The function `rate_correction`, if any, corrects the rates by the equations, which amplify the errors
    of stiff components, towards the rates on the path.
    """

    before: Numbers
    rates: Array
    rate_correction: Callable[[Array], Array] | None = None


class Laws(Protocol):
    """The rates of the stepped vector, and the event indicators of the events."""

    def rates(self, t: Numbers, y: Array, args: PyTree, happened: Array, ahead: Numbers) -> Numbers:
        """The time derivative of the vector. Equations with an instant that has `happened` are `ahead` of t."""
        ...

    def indicator(self, number: Array, t: Numbers, y: Array, due: Array, args: PyTree) -> Array:
        """The event indicator of an event, which is zero at its moment."""
        ...


@ft.partial(jax.custom_jvp, nondiff_argnums=(0,))
def carried_to_moment(
    laws: Laws, number: Array, t: Numbers, approach: Approach, ys: Array, due: Array, happened: Array, args: PyTree
) -> tuple[Numbers, Numbers]:
    r"""The moment t of event `number` and the vectors `ys` there, with their derivatives.

    The moment is already located, so the values of t and `ys` are unchanged, but the moment $t^*$ depends on everything
    that the run depends on. With $y(t^*)$ on the solution through $(t, y)$, and the event indicator $g$ of the first
    vector,

    $$g(t^*, y(t^*)) = 0, \qquad \mathrm{d}t^* = -\frac{\mathrm{d}g}{g_t + g_y f}, \qquad
    \mathrm{d}y^* = \mathrm{d}y + f\,\mathrm{d}t^*,$$

    where dg and dy are changes at a fixed time. An event indicator that does not change with time does not determine
    the moment. Neither does one that decays to zero and changes its sign by the error of a step: the path of the step
    crosses zero although the rates by the equations have vanished. The equations may change at the moment, so the rates
    f are those at the time `before`, with the changes by the events of the instant that have `happened`, [ys, events].
    """
    del laws, number, approach, due, happened, args
    return t, ys


@ft.partial(carried_to_moment.defjvp, symbolic_zeros=True)
def _derivative(laws: Laws, primals: Sequence[PyTree], tangents: Sequence[PyTree]) -> tuple[PyTree, PyTree]:
    number, t, approach, ys, due, happened, args = primals
    _, dt, _, dys, ddue, _, dargs = tangents
    moment, there = carried_to_moment(laws, number, t, approach, ys, due, happened, args)
    dt, dys = array_of(dt), array_of(dys)
    early = jax.lax.stop_gradient(approach.before - t)

    def rates(t: Numbers, ys: Array, args: PyTree) -> Numbers:
        return jax.vmap(lambda y, happened: laws.rates(t, y, args, happened, -early))(ys, happened)

    f, df = pushed(rates, (early + moment, there, args), (dt, dys, dargs))
    # From t to the moment the tangents change by (moment - t) df. The difference is zero, but not its derivative.
    dys = dys + (moment - t) * df

    def indicator(t: Numbers, y: Array, due: Array, args: PyTree) -> Array:
        return laws.indicator(number, t, y, due, args)

    _, dg = pushed(indicator, (moment, there[0], due, args), (dt, dys[0], ddue, dargs))
    _, push = jax.linearize(lambda t, y: indicator(t, y, due, args), moment, there[0])
    slope = push(jnp.ones_like(moment), f[0])
    # Products of rates below the square root of the smallest number lose their digits.
    is_still = jnp.abs(slope) <= STILL * jnp.abs(approach.rates[number]) + np.finfo(float).tiny ** 0.5
    if approach.rate_correction is not None:
        correction = jax.lax.stop_gradient(approach.rate_correction(f[0]))
        slope, f = slope + push(jnp.zeros_like(moment), correction), f + correction
    later = jnp.where(is_still, 0.0, -dg / jnp.where(is_still, 1.0, slope))
    return (moment, there), (dt + later, dys + f * later)
