"""Tests for values that jax is tracing."""

import contextlib
from contextlib import AbstractContextManager
from typing import Any

import jax
import numpy as np

from ._jax_private import Tracer, get_opaque_trace_state

_OUTSIDE = get_opaque_trace_state()


def is_traced(value: object) -> bool:
    """Whether `value` is being traced by a transformation such as `jax.jit` or `jax.grad`."""
    return isinstance(value, Tracer)


def are_traced(*values: object) -> bool:
    """Whether any number in some pytrees is being traced."""
    return any(map(is_traced, jax.tree.leaves(values)))


def within_transformation() -> bool:
    """Whether a function is being traced, even if its numbers are known."""
    return get_opaque_trace_state() != _OUTSIDE


def evaluated_now(*values: object) -> AbstractContextManager[Any]:
    """A context in which functions of `values` have known results if the values are known, also within a function that
    jax traces.
    """
    if are_traced(*values) or not within_transformation():
        return contextlib.nullcontext()
    return jax.ensure_compile_time_eval()


def known(value: object) -> np.ndarray | None:
    """The numbers of a value, also during differentiation; None if `jax.jit` or `jax.vmap` trace it."""
    # The primal of a value that is only differentiated.
    value = jax.lax.stop_gradient(value)
    return None if is_traced(value) else np.asarray(value)
