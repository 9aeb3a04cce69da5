"""What a model that was started knows of its events."""

from typing import NamedTuple, TypeVar

from .._numbers import Numbers
from .fields import copied

T = TypeVar("T")


class Past(NamedTuple):
    """What has happened in a model whose start was searched for: what was due until `time`, and the events for which
    `holds` has 1, whose conditions are true then.
    """

    time: Numbers
    holds: Numbers


def past_of(model: object) -> Past | None:
    """What has happened in a model; None where it was never started."""
    return vars(model).get("_past")


def with_past(model: T, past: Past | None) -> T:
    """A copy of a model that knows what has happened in it."""
    return copied(model, {"_past": past})
