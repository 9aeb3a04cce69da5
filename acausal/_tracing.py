"""Whether a value is a number or stands for one that is not known yet."""

from typing import Any

from jax.core import Tracer


def is_traced(value: Any) -> bool:
    """Whether `value` is being traced by a transformation such as `jax.jit` or `jax.grad`."""
    return isinstance(value, Tracer)
