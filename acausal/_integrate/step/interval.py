"""Functions, their rates and the angles that they are computed with, at times within a step."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..._reduce.angles import with_angles

TURN = 0.5 * math.pi  # most by which the fastest angle turns on a part of a step: half a wave is not passed over
MOST = 200  # evaluations in one search, all of them safeguarded by bisection; what takes more comes to no end
LOOKS = 2  # evaluations at a time on a path that is corrected: more, with one matrix, would not converge everywhere


class Seen(NamedTuple):
    """Margins and the angles that they are computed with, the rates of both at a time, and the sum of the steps of
    stairs on which they are. Where the path is corrected, `shift` is by how much the states are moved, and its rate.
    """

    t: Any
    g: Array
    rate: Array
    angle: Array
    speed: Array
    steps: Any
    shift: tuple[Array, ...] = ()


def seen(margins: Callable[[Array], PyTree], t: Numbers) -> Seen:
    """What is there at a time."""
    here, rates = jax.jvp(with_angles(margins), (t,), (jnp.ones_like(t),))
    return Seen(t, here.value, rates.value, here.angles, rates.angles, here.steps)


def seen_on_course(
    values: Callable[[Numbers, Array], tuple[Array, Array]],
    path: Callable[[Array], Array],
    error: Callable[[Array, Array], Array],
    t: Numbers,
) -> Seen:
    """What is there at a time on a path from which `error(t, rates)` is missing, to be added to its states.

    `values` gives the margins and the rates of the states at a point. It is evaluated at one place of the program, on
    the path as it is, and again where this leads to.
    """
    y, slope = jax.jvp(path, (t,), (jnp.ones_like(t),))

    def again(shift: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], Seen]:
        n = len(shift[0])
        place, pace = (jnp.concatenate([a[:n] + b, a[n:]]) for a, b in zip((y, slope), shift, strict=True))
        here, rates = jax.jvp(with_angles(values), (t, place), (jnp.ones_like(t), pace))
        lacking = jax.jvp(error, (t, here.value[1]), (jnp.ones_like(t), rates.value[1]))
        following = shift[0] + lacking[0], shift[1] + lacking[1]
        return following, Seen(t, here.value[0], rates.value[0], here.angles, rates.angles, here.steps, shift)

    nothing = jnp.zeros(jax.eval_shape(values, t, y)[1].shape)
    _, looks = jax.lax.scan(again, (nothing, nothing), None, length=LOOKS)
    return jax.tree.map(lambda x: x[-1], looks)


def advance(low: Seen, high: Seen) -> Array:
    """By how much the fastest angle turns on an interval: by the difference, and lest it turns there and back, by what
    the rates at both ends agree on.
    """
    turned = (high.t - low.t) * jnp.minimum(jnp.abs(low.speed), jnp.abs(high.speed))
    turned = jnp.maximum(turned, jnp.abs(high.angle - low.angle))
    return jnp.max(jnp.where(jnp.isfinite(turned), turned, 0.0), initial=0.0)


def over(a: Numbers, b: Array) -> Array:
    return jnp.where(b != 0, a / jnp.where(b != 0, b, 1.0), jnp.inf)
