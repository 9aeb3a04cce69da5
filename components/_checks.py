"""Range checks beyond the sign that a declaration can state."""

from collections.abc import Callable

import numpy as np
from jax.core import Tracer

from acausal import Component, ParameterError, Record


def check(
    owner: Component | Record, name: str, admits: Callable[[np.ndarray], np.ndarray | bool], expected: str
) -> None:
    """Raise `ParameterError` unless the parameter's value is known and admissible."""
    value = getattr(owner, name)
    if not isinstance(value, Tracer) and not np.all(admits(np.asarray(value))):
        raise ParameterError(f"{type(owner).__name__}.{name} must be {expected}, got {value}.")


def increasing(knots: np.ndarray) -> bool:
    return bool(np.all(np.diff(knots) > 0.0))


def check_order(owner: Component | Record, low: str, high: str, *, equal: bool = False) -> None:
    """Raise `ParameterError` unless the parameter `low` is smaller than `high`, or `equal`, where both are known."""
    above = getattr(owner, high)
    if isinstance(above, Tracer):
        return
    if equal:
        check(owner, low, lambda value: value <= np.asarray(above), f"at most {high} = {above}")
    else:
        check(owner, low, lambda value: value < np.asarray(above), f"smaller than {high} = {above}")


def check_shape(owner: Component | Record, name: str, shape: tuple[int, ...]) -> None:
    """Raise `ParameterError` unless the value has the given shape."""
    found = np.shape(getattr(owner, name))
    if found != shape:
        raise ParameterError(f"{type(owner).__name__}.{name} must have shape {shape}, got {found}.")


def check_samples(owner: Component | Record, values: str, *knots: str) -> None:
    """Raise `ParameterError` unless the knots increase, two or more on each axis, and there is a value for each."""
    for name in knots:
        check(owner, name, lambda given: given.size > 1 and increasing(given), "two or more increasing numbers")
    check_shape(owner, values, tuple(len(getattr(owner, name)) for name in knots))
