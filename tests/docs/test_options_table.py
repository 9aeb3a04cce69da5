"""The options of functions are those that their documentation names."""

import inspect
from collections.abc import Callable
from typing import Any

import pytest

from acausal import simulate
from docs.options import _entries, options


def example(first: int, *, n: int = 3, rate: float = 0.5) -> None:
    """Do something.

    - `n`: how often.
    - `rate(s)`: how fast,
      in 1/s.

    Raises nothing.
    """


def test_listing() -> None:
    assert options(example) == "n           3        how often.\nrate        0.5      how fast, in 1/s."


@pytest.mark.parametrize("function", [simulate])
def test_every_option_is_documented_once_and_nothing_else(function: Callable[..., Any]) -> None:
    arguments = inspect.signature(function).parameters.values()
    expected = [argument.name for argument in arguments if argument.default is not argument.empty]
    assert [entry["name"] for entry in _entries(function)] == expected
