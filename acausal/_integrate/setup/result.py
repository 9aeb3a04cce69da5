"""What can become of a simulation."""

from typing import Any

import equinox as eqx
from jax import Array


class Result(eqx.Enumeration):
    """The outcome of a run; each member is a sentence with its remedy."""

    reached_end = "The end time was reached."
    stopped = "The stop condition was met."
    never_stopped = (
        "The stop condition was never met before the end time. Simulate longer, check that the design can reach it, or "
        "pass throw=False to get an infinite time instead of this error."
    )
    too_many_steps = "The maximum number of steps was reached. Increase max_steps or loosen rtol."
    step_too_small = (
        "The step size fell below dtmin: the solution is not smooth there, or grows without bound. Smooth the "
        "equations of the component that changes, or loosen rtol. If it only changes very fast beside the time span of "
        "the run, pass a smaller dtmin."
    )
    events_accumulate = (
        "Events follow one another ever faster, and time stands still: a rebound that dies out, a switch without "
        "hysteresis, or equations that have no solution after an event. Let the rebound end below a small speed, or "
        "give the switch a band."
    )
    events_endless = (
        "Events at one instant cause one another without end. Let no two conditions undo each other: they must not "
        "both be true where one leads to the other."
    )
    bad_reset = (
        "An event sets variables to values that contradict the constraints between them. Set fewer of them: those that "
        "are tied to others follow."
    )
    refused = "A component cannot do what is asked of it."
    undetermined = "Equations are singular but for errors of rounding, so that any result is arbitrary."
    not_finite = "A variable became infinite or not a number."
    bad_parameter = "A parameter or start value is outside its range, or contradicts another parameter."
    bad_option = "A time, a step or a tolerance that the run was asked for is not one that it can have."
    bad_start = "The start values contradict the equations."


def sentence(result: Any) -> str:
    """What a result says."""
    return Result[result]  # pyright: ignore[reportInvalidTypeArguments, reportReturnType]


def is_success(result: Any) -> Array:
    """Whether a run came to its end or was stopped as it was asked to."""
    return (result == Result.reached_end) | (result == Result.stopped)
