"""Functions, their rates and their phases at times within a step."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..._reduce.angles import with_angles

TURN = 0.5 * math.pi  # largest change of the fastest phase on a part of a step, so that no half-wave is missed
SLACK = 1e-6  # by which a share of a step may exceed its limit, due to rounding
MOST = 200  # limit on the evaluations of one search; bisection safeguards it, so a longer search would never end
EVALUATIONS = 2  # evaluations per time on a corrected path; with one matrix, more of them would not converge everywhere


class PathSample(NamedTuple):
    """Event indicators `g` and their phases at a time, the rates of both, and the sum of the step numbers of stair
    functions such as floor. If the path is corrected, `shift` is the correction of the states and its rate.
    """

    t: Any
    g: Array
    rate: Array
    angle: Array
    speed: Array
    steps: Any
    shift: tuple[Array, ...] = ()


def sample(functions: Callable[[Array], PyTree], t: Numbers) -> PathSample:
    """The functions and their phases at a time."""
    here, rates = jax.jvp(with_angles(functions), (t,), (jnp.ones_like(t),))
    return PathSample(t, here.value, rates.value, here.angles, rates.angles, here.steps)


def corrected_sample(
    values: Callable[[Numbers, Array], tuple[Array, Array]],
    path: Callable[[Array], Array],
    error: Callable[[Array, Array], Array],
    t: Numbers,
    n_states: int,
) -> PathSample:
    """The functions and their phases at a time on a path whose states need the correction `error(t, rates)`.

    `values` gives the event indicators and the rates of the `n_states` states at a point. It is compiled once, and
    evaluated first on the uncorrected path and then at the corrected states.
    """
    y, slope = jax.jvp(path, (t,), (jnp.ones_like(t),))

    def again(shift: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], PathSample]:
        place, slope_there = (
            jnp.concatenate([a[:n_states] + b, a[n_states:]]) for a, b in zip((y, slope), shift, strict=True)
        )
        here, rates = jax.jvp(with_angles(values), (t, place), (jnp.ones_like(t), slope_there))
        lacking = jax.jvp(error, (t, here.value[1]), (jnp.ones_like(t), rates.value[1]))
        following = shift[0] + lacking[0], shift[1] + lacking[1]
        return following, PathSample(t, here.value[0], rates.value[0], here.angles, rates.angles, here.steps, shift)

    nothing = jnp.zeros(n_states)
    _, samples = jax.lax.scan(again, (nothing, nothing), None, length=EVALUATIONS)
    return jax.tree.map(lambda x: x[-1], samples)


def advance(low: PathSample, high: PathSample) -> Array:
    """Change of the fastest phase on an interval: the difference between its ends, or the width times the smaller rate
    at the ends if that is larger, because a phase may go back and forth.
    """
    turned = (high.t - low.t) * jnp.minimum(jnp.abs(low.speed), jnp.abs(high.speed))
    turned = jnp.maximum(turned, jnp.abs(high.angle - low.angle))
    return jnp.max(jnp.where(jnp.isfinite(turned), turned, 0.0), initial=0.0)


def over(a: Numbers, b: Array) -> Array:
    return jnp.where(b != 0, a / jnp.where(b != 0, b, 1.0), jnp.inf)
