"""The event history of a model with computed start values."""

from typing import NamedTuple, TypeVar

from .._numbers import Numbers
from .fields import copied

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
