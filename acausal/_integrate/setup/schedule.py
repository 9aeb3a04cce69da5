"""Scheduled times, their periodic repetitions, and the time resolution."""

import jax
import jax.numpy as jnp
from jax import Array

from ..._numbers import Numbers

COUNTABLE = 1e8  # largest number of periods that floating-point arithmetic can count exactly enough


def tick(t: Numbers, t0: Numbers) -> Numbers:
    """Time resolution at t of times counted from t0, which carry the rounding errors of both."""
    least = jnp.finfo(jax.dtypes.canonicalize_dtype(float))
    return 4.0 * least.eps * jnp.maximum(jnp.abs(t), jnp.abs(t0)) + 1e18 * least.tiny


def next_after(times: Array, every: Array | None, t: Numbers, after: Array) -> Array:
    """The first time of each row, including repetitions, that is later than `after`; `t` must be near it. Without
    `every`, times do not repeat.
    """
    due = _repeated(times, every, t)
    due = jnp.where(due > after[:, None], due, jnp.inf)
    return jnp.take_along_axis(due, jnp.argmin(due, axis=1, keepdims=True), axis=1)[:, 0]


def last_before(times: Array, every: Array | None, t: Numbers) -> Array:
    """The last time of each row, including repetitions, that is not after t; infinite if there is none."""
    due = _repeated(times, every, t)
    # Rows are padded with infinity. Its tick is infinite too and would match every time.
    near = jnp.max(jnp.where(jnp.isfinite(times), tick(times, t), 0.0), axis=1, keepdims=True)
    last = jnp.max(jnp.where(due - t <= near, due, -jnp.inf), axis=1)
    return jnp.where(jnp.isfinite(last), last, jnp.inf)


def farthest(times: Array, every: Array, t0: Numbers) -> Array:
    """The largest magnitude of the origins of periodic times, except those after t0 or too many periods before it."""
    counts = jnp.isfinite(every) & (times < t0) & (t0 - times < COUNTABLE * every)
    return jnp.max(jnp.where(counts, jnp.abs(times), 0.0))


def _repeated(times: Array, every: Array | None, t: Numbers) -> Numbers:
    """Times and their repetitions around t: enough of them that rounding cannot hide the next or the last one."""
    if every is None:
        return times
    repeats = jnp.isfinite(every)
    turn = jnp.floor((t - times) / jnp.where(repeats, every, 1.0))
    turns = jnp.maximum(turn[..., None] + jnp.arange(-1.0, 3.0), 0.0)
    due = times[..., None] + jax.lax.stop_gradient(turns) * jnp.where(repeats, every, 0.0)[..., None]
    return due.reshape(len(due), -1)
