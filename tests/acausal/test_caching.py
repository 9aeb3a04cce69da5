"""What is compiled again, and what must be."""

import types
from typing import Any

import jax
import numpy as np
import pytest
from _models import rc

from acausal import simulate

LIMITS = types.ModuleType("limits")


def charging_time(limit: float) -> float:
    return -0.1 * np.log(1.0 - limit / 5.0)


def test_a_changed_attribute_of_a_module_is_honoured(monkeypatch: pytest.MonkeyPatch) -> None:
    def until(s: Any) -> Any:
        return s.c.v - LIMITS.voltage

    for limit in (2.0, 3.0):
        monkeypatch.setattr(LIMITS, "voltage", limit, raising=False)
        np.testing.assert_allclose(simulate(rc(), 1.0, until=until, rtol=1e-9).t1, charging_time(limit), rtol=1e-7)


def test_arrays_inside_a_compiled_function_are_honoured() -> None:
    """Two conditions of one form that close over different arrays within `jax.jit`."""

    def above(limits: np.ndarray) -> Any:
        return jax.jit(lambda v: (v - limits).sum())

    for limit in (2.0, 3.0):
        level = above(np.full(2, limit))
        t1 = simulate(rc(), 1.0, until=lambda s, level=level: level(s.c.v), rtol=1e-9).t1
        np.testing.assert_allclose(t1, charging_time(limit), rtol=1e-7)
