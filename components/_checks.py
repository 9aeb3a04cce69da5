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
