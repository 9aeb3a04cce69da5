"""What is compiled again, and what must be."""

import types
from typing import Any

import jax
import numpy as np
import pytest
from _models import rc

from acausal import simulate
from acausal._integrate.run import run

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


def compiled_by(action: Any) -> int:
    size: Any = getattr(run, "_cache_size")  # noqa: B009  # of a function under `jax.jit`
    before = size()
    action()
    return size() - before


def above(level: float) -> Any:
    return lambda s: s.c.v - level


@pytest.fixture(scope="module")
def known() -> None:
    """One run with a stop condition, so that what is counted is compiled beyond it."""
    simulate(rc(), 1.0, until=above(2.0), rtol=1e-9, save="end")


SAME = {
    "another level": lambda: simulate(rc(), 1.0, until=above(3.0), rtol=1e-9, save="end"),
    "an equal function": lambda: simulate(rc(), 1.0, until=lambda s: s.c.v - 1.5, rtol=1e-9, save="end"),
    "other parameters": lambda: simulate(rc(R=50, C=2e-3, V=6), 1.0, until=above(2.0), rtol=1e-9, save="end"),
    "another start value": lambda: simulate(rc(v0=1.0), 1.0, until=above(2.0), rtol=1e-9, save="end"),
    "other times and tolerance": lambda: simulate(rc(), 2, t0=0.1, until=above(2.0), rtol=1e-7, save="end"),
    "no error": lambda: simulate(rc(), 1.0, until=above(2.0), rtol=1e-9, save="end", throw=False),
}


@pytest.mark.usefixtures("known")
@pytest.mark.parametrize("change", SAME)
def test_what_is_not_compiled_again(change: str) -> None:
    assert compiled_by(SAME[change]) == 0


@pytest.mark.usefixtures("known")
def test_what_is_compiled_again() -> None:
    """Another condition; and its numbers are not mixed up with those of the one before."""
    times = []
    condition = lambda s: s.c.v**2 - 4.0  # noqa: E731
    added = compiled_by(lambda: times.append(simulate(rc(), 1.0, until=condition, rtol=1e-9, save="end").t1))
    assert added == 1
    np.testing.assert_allclose(times, [charging_time(2.0)], rtol=1e-7)


@pytest.mark.usefixtures("known")
def test_a_new_level_is_honoured_without_compiling() -> None:
    for level in (1.0, 4.5):
        t1 = simulate(rc(), 1.0, until=above(level), rtol=1e-9, save="end").t1
        np.testing.assert_allclose(t1, charging_time(level), rtol=1e-7)
