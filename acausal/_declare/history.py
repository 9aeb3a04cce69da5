"""The past of a model: histories of signals, which `remember` states and `recall` reads, and of events."""

from typing import NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers, Scalar
from .fields import copied

DEGREE = 4  # of the polynomials, as of the dense output of a step
# Positions in a step, from -1 to 1: the Chebyshev nodes at which a signal is recorded, and one near the largest error.
NODES = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
BETWEEN = 0.4
_COEFFICIENTS = np.linalg.inv(np.vander(NODES, increasing=True))
# Columns of a history: start time, its rounding error, order of the break there, width of the step, first coefficient
START, REST, ORDER, WIDTH, FIRST = 0, 1, 2, 3, 4
ROW = FIRST + DEGREE + 1  # numbers in the row of a step


class Remember(NamedTuple):
    """A signal to record, by the name of the discrete variable that holds its history, and the delay of the reads."""

    delay: Numbers
    signals: dict[str, Numbers]
    check_units: bool = True


def remember(delay: Numbers, **signal: Numbers) -> Remember:
    """State that a run keeps the history of a signal, as in `remember(self.T, past=self.u.value)`, for `recall`.

    The history is declared as `past: Discrete[Vector, "", shape("n", ROW)] = -jnp.inf`. Each step adds a row to it: the
    polynomial of degree 4 through five values of the signal. The error of the polynomial counts as an error of the
    step. `delay` in s is positive and computed from parameters and discrete variables. No step is longer, so a value is
    recorded before it is recalled. A jump of the signal, and a kink at an event, are events again after `delay`. A run
    fails if n rows do not reach back by `delay`.
    """
    return Remember(delay, signal)


def recall(history: Array, time: Scalar, before: Scalar) -> Scalar:
    """The recorded signal at a time in the past; `before` for times before the start of the run.

    `time` must be a variable of the component, stated by an equation such as `eq(self.since, self.t - self.T)`. A
    history holds times and values without units, so use `eq(..., check_units=False)` for a signal with a unit.
    """
    starts, n = history[:, START], len(history)
    # The last row is empty until the end of its step.
    n_full = n - (history[-1, WIDTH] <= 0.0)
    i = jnp.clip(jnp.minimum(jnp.sum(starts <= time), n_full) - 1, 0)
    row = history[i]
    is_known = row[START] > -jnp.inf
    return jnp.where(is_known, polynomial(jnp.where(is_known, row, 1.0), time), before)


def returns(history: Array, delay: Numbers) -> tuple[Array, Array]:
    """The times at which jumps and kinks of the signal return, infinite in other rows, and their rounding errors.

    With its error, the sum of a time and many delays is as exact as the delays, so that breaks on different ways to one
    time coincide (T. J. Dekker, `A floating-point technique for extending the available precision`, 1971).
    """
    start, more = history[..., START], delay + history[..., REST]
    time = start + more
    added = time - start
    rest = (start - (time - added)) + (more - added)
    is_break = history[..., ORDER] >= 0.0
    return jnp.where(is_break, time, jnp.inf), jnp.where(is_break, rest, 0.0)


def coefficients(values: Array) -> Array:
    """The polynomials through values at the nodes, along the first axis."""
    return jnp.asarray(_COEFFICIENTS) @ values


def horner(coefficients: Array, x: Numbers) -> Array:
    """The value at a position in a step, from -1 to 1. Coefficients are along the last axis."""
    value = coefficients[..., DEGREE]
    for power in reversed(range(DEGREE)):
        value = value * x + coefficients[..., power]
    return value


def polynomial(row: Array, time: Numbers) -> Array:
    """The value at a time by a row of a history."""
    return horner(row[..., FIRST:], 2.0 * (time - row[..., START]) / row[..., WIDTH] - 1.0)


T = TypeVar("T")


class Past(NamedTuple):
    """The event history of a model with computed start values: events were processed up to `time`, and `holds` is 1 for
    events whose conditions are true then.
    """

    time: Numbers
    holds: Numbers


def past_of(model: object) -> Past | None:
    """The event history of a model; None before the first start."""
    return vars(model).get("_past")


def with_past(model: T, past: Past | None) -> T:
    """A copy of a model with an event history."""
    return copied(model, {"_past": past})
