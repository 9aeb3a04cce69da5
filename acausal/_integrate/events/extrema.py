"""Maxima of functions along the path of a step, with derivatives of their values and times.

A maximum within a step is a zero of the rate along the dense output. With the rate r and its slope r' close to it,

    t* = t - r / r',    g* = g - r^2 / (2 r')

is a Newton step. Its derivatives are those of the extremum, by the implicit function theorem and the envelope theorem.
A kink is the intersection of the tangents from both sides. A second Newton step, from points that move with the result
of the first one, also has the correct second derivatives.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..step.interval import MOST, SLACK, TURN, PathSample, advance, over

NODES = 2  # number of parts of a step at whose ends rates are evaluated, if no phase changes fast
# Shortest part relative to the step; faster phases are only sampled. Also the width, relative to its part, to which a
# maximum is bracketed: from there, one Newton step finds it.
CLOSE = 1e-5
FIRST = 5  # Newton steps; a maximum that needs more is not smooth, or not simple
DERIVATIVES = 2  # highest correct order of differentiation; each order takes one Newton step


class Peak(NamedTuple):
    """The largest value of a function, and its time."""

    value: Array
    time: Array


class Turn(NamedTuple):
    """Maxima of functions: each lies between `low` and `high`, which are close, with the second derivative `bend`.

    A maximum at a kink, where the rate jumps, is not smooth.
    """

    low: Array
    high: Array
    bend: Array
    is_smooth: Array
    exists: Array


class _Walk(NamedTuple):
    """State of the search for each function: all maxima before `node` have been examined.

    While the search `narrows` the bracket of a maximum, this is from `low` to `high`, on a part on which the rate falls
    by `fall`. `last` is the previously evaluated point, `x` the time of the next one.
    """

    node: PathSample
    low: PathSample
    high: PathSample
    last: PathSample
    part: Array
    fall: Array
    narrows: Array
    age: Array
    x: Array
    best: Array
    top: Turn


def highest_turns(sample: Callable[[Numbers], PathSample], start: Numbers, end: Numbers, best: Array) -> Turn:
    """The highest maximum of each function of `sample` between two times, if it exceeds the `best` value so far.

    Rates are evaluated at both ends and in the middle, and at more points if the phase of a sine or of a stair function
    changes fast: while the states rest, steps are longer than the periods of functions of time or of an angle. Between
    two points each function may have one maximum. The tangents at the ends of a part intersect above a concave
    function, so a maximum is bracketed only if they intersect above the best value so far.
    """
    n, width = len(best), end - start
    angle = 0.5 * TURN  # the square of a sine has twice its frequency

    def evaluated(walk: _Walk) -> _Walk:
        points = jax.vmap(sample)(walk.x)
        new = points._replace(g=jnp.diagonal(points.g), rate=jnp.diagonal(points.rate))
        return _pick(walk.narrows, narrowed(walk, new), walked(walk, new))

    def walked(walk: _Walk, new: PathSample) -> _Walk:
        """The state after evaluating the end of a part, which becomes a node unless a phase changes too much on it."""
        node, wide = walk.node, new.t - walk.node.t
        turned = jax.vmap(advance)(node, new)
        is_far = (turned > angle * (1.0 + SLACK)) & (wide > 2.0 * CLOSE * width)
        fall = node.rate - new.rate
        turns = (node.rate > 0.0) & (new.rate <= 0.0) & ~is_far
        meet = node.g + node.rate * (new.g - node.g - new.rate * wide) / jnp.where(turns, fall, 1.0)
        opens = turns & (meet > walk.best)
        secant = _within(node.t + wide * node.rate / jnp.where(turns, fall, 1.0), node, new, wide)
        back = node.t + jnp.maximum(jnp.minimum(0.5, over(angle * jnp.ones(n), turned)) * wide, CLOSE * width)
        return walk._replace(
            node=_pick(is_far, node, new),
            low=node,
            high=new,
            last=node,
            part=wide,
            fall=fall,
            narrows=opens,
            age=jnp.zeros(n, int),
            x=jnp.where(is_far, back, jnp.where(opens, secant, onward(new))),
        )

    def onward(node: PathSample) -> Array:
        speed = jnp.max(jnp.where(jnp.isfinite(node.speed), jnp.abs(node.speed), 0.0), axis=1, initial=0.0)
        part = jnp.maximum(over(angle * jnp.ones(n), speed), CLOSE * width)
        return jnp.minimum(node.t + jnp.minimum(width / NODES, part), end)

    def narrowed(walk: _Walk, new: PathSample) -> _Walk:
        """The state after an evaluation between `low` and `high`."""
        rises = new.rate > 0.0
        low, high = _pick(rises, new, walk.low), _pick(rises, walk.high, new)
        gap, fall = high.t - low.t, low.rate - high.rate
        is_closed = (gap <= CLOSE * walk.part) | (walk.age >= MOST)
        value = jnp.maximum(low.g, high.g)
        is_better = is_closed & (value > walk.best)
        is_smooth = fall <= jnp.sqrt(jnp.abs(gap / jnp.where(walk.part == 0.0, 1.0, walk.part))) * walk.fall
        turn = Turn(low.t, high.t, -over(fall, gap), is_smooth, is_closed)
        # Newton's method for the rate, with the slope between the last two points; at a kink, intersect the tangents.
        slope = over(new.rate - walk.last.rate, new.t - walk.last.t)
        newton = new.t - over(new.rate, slope)
        middle, meet = low.t + 0.5 * gap, low.t + over(high.g - low.g - high.rate * gap, fall)
        is_inside = (slope < 0.0) & (newton > low.t) & (newton < high.t)
        first = jnp.where(is_inside, newton, middle)
        later = jnp.where(walk.age % 3 == 0, meet, jnp.where(walk.age % 3 == 1, first, middle))
        aim = jnp.where((walk.age < FIRST) | ~jnp.isfinite(later), first, later)
        return walk._replace(
            low=low,
            high=high,
            last=new,
            narrows=~is_closed,
            age=walk.age + 1,
            x=jnp.where(is_closed, onward(walk.node), _within(aim, low, high, walk.part)),
            best=jnp.where(is_better, value, walk.best),
            top=_pick(is_better, turn, walk.top),
        )

    def is_on_the_way(walk: _Walk) -> Array:
        return jnp.any(walk.narrows | (walk.node.t < end) | (walk.x < end))

    nothing, none = jnp.zeros(n), jnp.zeros(n, bool)
    angles = jax.eval_shape(sample, start).angle.shape
    unknown = jnp.full((n, *angles), jnp.inf)
    point = PathSample(jnp.full(n, start), nothing, nothing, unknown, jnp.zeros((n, *angles)), nothing)
    first = _Walk(
        node=point, low=point, high=point, last=point, part=nothing, fall=nothing, narrows=none,
        age=jnp.zeros(n, int), x=jnp.full(n, start), best=best, top=Turn(point.t, point.t, nothing - 1.0, ~none, none),
    )  # fmt: skip
    return jax.lax.while_loop(is_on_the_way, evaluated, first).top


def located(turn: Turn, along: Callable[[Array], tuple[Array, Array]], others: Array) -> tuple[Peak, Array]:
    """The maxima with their derivatives, and the functions at `others`, further positions.

    `along` gives the functions and their rates at positions, [positions, functions]. One loop evaluates it, so that it
    is compiled once.
    """
    n = len(turn.low)

    def again(shift: Array, _: None) -> tuple[Array, tuple[Peak, Array]]:
        x = jnp.concatenate([turn.low + shift, turn.high + shift, others])
        found, rates = along(x)
        low, high = ((_own(found[part]), _own(rates[part]), x[part]) for part in (slice(n), slice(n, 2 * n)))
        top = _extremum(turn, low, high)
        # Zero, with the derivatives of the time of the extremum.
        return jnp.where(turn.exists, top.time - jax.lax.stop_gradient(top.time), 0.0), (top, found[2 * n :])

    tops, found = jax.lax.scan(again, jnp.zeros(n), None, length=DERIVATIVES)[1]
    return Peak(tops.value[-1], tops.time[-1]), found[-1]


def _own(part: Array) -> Array:
    """The diagonal of [functions, positions]: each function at the position of its own peak."""
    return jnp.diagonal(part)


def _extremum(turn: Turn, low: tuple[Array, Array, Array], high: tuple[Array, Array, Array]) -> Peak:
    """The peaks between two times, from the values and rates at both times."""
    (g, rate, t), (g_high, rate_high, t_high) = low, high
    bend = jnp.where(turn.bend < 0.0, turn.bend, -jnp.inf)
    smooth = Peak(g - rate**2 / (2.0 * bend), t - rate / bend)
    fall = rate - rate_high
    ahead = (g_high - g - rate_high * (t_high - t)) / jnp.where(turn.is_smooth | (fall == 0.0), 1.0, fall)
    kink = Peak(g + rate * ahead, t + ahead)
    return Peak(*(jnp.where(turn.is_smooth, a, b) for a, b in zip(smooth, kink, strict=True)))


def _within(x: Array, low: PathSample, high: PathSample, part: Array) -> Array:
    """A time limited to the inside of an interval, so that both ends converge to a maximum near one of them."""
    least = 0.5 * CLOSE * part
    return jnp.clip(x, low.t + least, high.t - least)


def _pick(condition: Array, a: PyTree, b: PyTree) -> PyTree:
    """Selects from a or b for each function."""
    return jax.tree.map(lambda x, y: jnp.where(condition.reshape(-1, *[1] * (x.ndim - 1)), x, y), a, b)
