"""The outcomes of a simulation."""

from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax import Array

from ..._tracing import are_traced, is_traced


class Result(eqx.Enumeration):
    """The outcome of a run. Each member is a message that states the cause and the remedy."""

    reached_end = "The end time was reached."
    stopped = "The stop condition was met."
    never_stopped = (
        "The stop condition was never met before the end time. Simulate longer, check that the design can reach it, or "
        "pass throw=False to get an infinite time instead of this error."
    )
    too_many_steps = "The maximum number of steps was reached. Increase max_steps or loosen rtol."
    step_too_small = (
        "The step size fell below dtmin, because the solution is not smooth there or grows without bound. Smooth the "
        "equations of the component that changes, or loosen rtol. If the solution only changes very fast compared with "
        "the time span of the run, pass a smaller dtmin."
    )
    events_accumulate = (
        "Events follow each other ever faster, and the run cannot resolve the next one: a rebound that dies out, or "
        "switches between which a variable swings ever less. End the rebound below a small speed, or give the switches "
        "a hysteresis."
    )
    events_endless = (
        "Events at one instant trigger each other without end, as comparators and switches do in a loop without "
        "storage. Add a hysteresis to one of them, or a storage or a filter to the loop. In a component of your own, "
        "the condition of an event must be false after the opposite event."
    )
    bad_reset = (
        "An event sets variables to values that contradict the constraints between them. Set fewer of them: the "
        "constraints determine the others."
    )
    refused = "A component cannot do what is asked of it."
    history_full = (
        "The history of a delayed signal does not reach back by its delay, because the run takes more steps in this "
        "time. Increase the number n of steps that the history holds, or loosen rtol."
    )
    undetermined = "Equations are singular to within rounding errors, so any result is arbitrary."
    not_finite = "A variable became infinite or not a number."
    bad_parameter = "A parameter or start value is outside its range, or contradicts another parameter."
    bad_option = "An option of the run has an invalid value: a time, a step size or a tolerance."
    bad_start = "The start values contradict the equations."


def sentence(result: Any) -> str:
    """The message of a result."""
    return Result[result]  # pyright: ignore[reportInvalidTypeArguments, reportReturnType]


def is_success(result: Any) -> Array | np.ndarray:
    """Whether a run reached its end time or met its stop condition. NumPy compares known results."""
    result = jax.tree.map(lambda x: x if is_traced(x) else np.asarray(x), result)
    is_end, is_stop = result == Result.reached_end, result == Result.stopped
    return is_end | is_stop if are_traced(is_end, is_stop) else np.logical_or(is_end, is_stop)
