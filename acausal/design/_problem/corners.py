"""Corners of the bounds at which a model cannot be built, found before anything is compiled."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._errors import reason_of
from .free import Free

T = TypeVar("T")
ALL = 6  # most variables for which all corners are tried


def unbuilt_corners(model: Component, free: Free, scenarios: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Combinations of bounds at which a component refuses its parameters, with the reason.

    A missing bound is replaced by the start. For many variables, the corners combine both bounds of any two variables.
    """
    start = np.array([variable.start for variable in free.variables])
    built = {
        name: change for name, change in scenarios.items() if not why_not_built(lambda c=change: replace(model, c))
    }
    low, high = (np.where(np.isfinite(bound), bound, start) for bound in (free.low, free.high))
    for is_high in _corners(len(start)):
        x = np.where(is_high, high, low)
        for name, change in built.items():
            if reason := why_not_built(lambda x=x, change=change: replace(free.with_values(model, x), change)):
                yield f"{free.text(x)}{f' in {name}' if name else ''} cannot be built: {reason}"
                break


def _corners(n: int) -> Iterator[np.ndarray]:
    """Marks of the variables at their upper bound."""
    if n <= ALL:
        yield from map(np.array, itertools.product((False, True), repeat=n))
        return
    # The numbers of any two variables differ in a bit.
    for bit in range(n.bit_length() + 1):
        is_high = (np.arange(n) >> bit) % 2 == 1
        yield is_high
        yield ~is_high


def why_not_built(build: Callable[[], object]) -> str:
    """The reason why a model cannot be built; empty if it can."""
    return model_or_reason(build)[1]


def model_or_reason(build: Callable[[], T]) -> tuple[T | None, str]:
    """A model, or None and the reason why it cannot be built."""
    try:
        return build(), ""
    except Exception as error:  # of any constructor
        return None, reason_of(error)
