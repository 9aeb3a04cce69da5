"""Times known ahead and their repetitions, and when two of them are one and the same."""

import jax
import jax.numpy as jnp
from jax import Array

from ..._numbers import Numbers

COUNTABLE = 1e8  # periods, of which more are not counted exactly enough to tell one instant from another


def tick(t: Numbers, t0: Numbers) -> Numbers:
    """Times closer than this are one and the same if counted from t0: they are sums of numbers as large as either."""
    least = jnp.finfo(jax.dtypes.canonicalize_dtype(float))
    return 4.0 * least.eps * jnp.maximum(jnp.abs(t), jnp.abs(t0)) + 1e18 * least.tiny


def next_after(times: Array, every: Array | None, t: Numbers, after: Array) -> Array:
    """The first of each row of times, or of their repetitions, that comes after; t is near. With no `every`, times do
    not repeat.
    """
    due = _repeated(times, every, t)
    due = jnp.where(due > after[:, None], due, jnp.inf)
    return jnp.take_along_axis(due, jnp.argmin(due, axis=1, keepdims=True), axis=1)[:, 0]


def last_before(times: Array, every: Array | None, t: Numbers) -> Array:
    """The last of each row of times, or of their repetitions, that is not after t; infinite where there is none."""
    due = _repeated(times, every, t)
    # Rows are filled up with infinity, whose tick would make all times near.
    near = jnp.max(jnp.where(jnp.isfinite(times), tick(times, t), 0.0), axis=1, keepdims=True)
    last = jnp.max(jnp.where(due - t <= near, due, -jnp.inf), axis=1)
    return jnp.where(jnp.isfinite(last), last, jnp.inf)


def farthest(times: Array, every: Array, t0: Numbers) -> Array:
    """The size of the time farthest from zero, but for what does not repeat, comes after t0, or is too many periods
    before it.
    """
    counts = jnp.isfinite(every) & (times < t0) & (t0 - times < COUNTABLE * every)
    return jnp.max(jnp.where(counts, jnp.abs(times), 0.0))


def _repeated(times: Array, every: Array | None, t: Numbers) -> Numbers:
    """Times and their repetitions about t; which of them is the next or the last one, rounding does not tell."""
    if every is None:
        return times
    repeats = jnp.isfinite(every)
    turn = jnp.floor((t - times) / jnp.where(repeats, every, 1.0))
    turns = jnp.maximum(turn[..., None] + jnp.arange(-1.0, 3.0), 0.0)
    due = times[..., None] + jax.lax.stop_gradient(turns) * jnp.where(repeats, every, 0.0)[..., None]
    return due.reshape(len(due), -1)
