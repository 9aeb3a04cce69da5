"""Runs that need a new compilation, and runs that do not."""

import types
from typing import Any, Self

import jax
import jax.monitoring
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

from acausal import Component, Equations, Scalar, Var, eq, simulate
from acausal._evaluate.building import system_of
from acausal._integrate import stored_run
from acausal._integrate.programs import stored_program
from acausal._integrate.results import reading, trajectories
from acausal._integrate.setup.user_function import trace

LIMITS = types.ModuleType("limits")


def charging_time(limit: float) -> float:
    return -0.1 * np.log(1.0 - limit / 5.0)


@pytest.mark.thorough
def test_a_changed_attribute_of_a_module_is_honoured(monkeypatch: pytest.MonkeyPatch) -> None:
    def until(s: Any) -> Any:
        return s.c.v - LIMITS.voltage

    for limit in (2.0, 3.0):
        monkeypatch.setattr(LIMITS, "voltage", limit, raising=False)
        np.testing.assert_allclose(simulate(rc(), 1.0, until=until, rtol=1e-9).t1, charging_time(limit), rtol=1e-7)


@pytest.mark.thorough
def test_arrays_inside_a_compiled_function_are_honoured() -> None:
    """Two conditions of one form that close over different arrays within `jax.jit`."""

    def above(limits: np.ndarray) -> Any:
        return jax.jit(lambda v: (v - limits).sum())

    for limit in (2.0, 3.0):
        level = above(np.full(2, limit))
        t1 = simulate(rc(), 1.0, until=lambda s, level=level: level(s.c.v), rtol=1e-9).t1
        np.testing.assert_allclose(t1, charging_time(limit), rtol=1e-7)


class Limited(Component):
    """Grows by one a second; how far it is from the limit is a property, which a condition may be."""

    factor = 1.0
    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(growth=eq(d.x, 1.0, check_units=False))

    @property
    def margin(self) -> Any:
        return self.x - LIMITS.voltage


@pytest.mark.thorough
@pytest.mark.parametrize(
    "until", [lambda s: s.margin, lambda s: s.x - s.factor], ids=["a property", "an attribute of the class"]
)
def test_what_a_condition_reads_of_a_class_is_honoured(until: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for limit in (2.0, 3.0):
        monkeypatch.setattr(LIMITS, "voltage", limit, raising=False)
        monkeypatch.setattr(Limited, "factor", limit)
        np.testing.assert_allclose(simulate(Limited(), 9.0, until=until, rtol=1e-9).t1, limit, rtol=1e-7)


class Halved(Component):
    """Grows by one a second; its half is a property that reads nothing outside of the class."""

    x: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(growth=eq(d.x, 1.0, check_units=False))

    @property
    def half(self) -> Any:
        return 0.5 * self.x


@pytest.mark.thorough
def test_a_condition_that_reads_a_property_is_traced_once() -> None:
    """And anew where the property is another one."""

    def until(s: Any) -> Any:
        return s.half - 1.0

    flat = system_of(Halved()).flat
    first = trace(until, flat, "until")
    assert trace(until, flat, "until") is first
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Halved, "half", property(lambda self: 2.0 * self.x))
        assert trace(until, flat, "until") is not first
        np.testing.assert_allclose(simulate(Halved(), 9.0, until=until, rtol=1e-9).t1, 0.5, rtol=1e-7)
    assert trace(until, flat, "until") is first
    np.testing.assert_allclose(simulate(Halved(), 9.0, until=until, rtol=1e-9).t1, 2.0, rtol=1e-7)


def compiled_by(action: Any) -> int:
    before = _compiled()
    action()
    return _compiled() - before


def _compiled() -> int:
    """The number of programs that start, step, end and read runs, interpreted or compiled as a whole."""
    functions: list[Any] = [
        stored_run._RunPart.__call__,
        reading.Reading.__call__,
        trajectories._Trajectories.__call__,
    ]
    interpreted = stored_program._program._places.cache_info().misses
    return sum(function._cache_size() for function in functions) + interpreted


def above(level: float) -> Any:
    return lambda s: s.c.v - level


@pytest.fixture(scope="module")
def known() -> None:
    """One run with a stop condition, so that what is counted is compiled beyond it; and one that is read."""
    simulate(rc(), 1.0, until=above(2.0), rtol=1e-9, save="end")
    simulate(rc(), 1.0, save=np.linspace(0.0, 1.0, 101)).peak(lambda s: s.c.v)


SAME = {
    "another level": lambda: simulate(rc(), 1.0, until=above(3.0), rtol=1e-9, save="end"),
    "an equal function": lambda: simulate(rc(), 1.0, until=lambda s: s.c.v - 1.5, rtol=1e-9, save="end"),
    "other parameters": lambda: simulate(rc(R=50, C=2e-3, V=6), 1.0, until=above(2.0), rtol=1e-9, save="end"),
    "another start value": lambda: simulate(rc(v0=1.0), 1.0, until=above(2.0), rtol=1e-9, save="end"),
    "other times and tolerance": lambda: simulate(rc(), 2, t0=0.1, until=above(2.0), rtol=1e-7, save="end"),
    "more times to save at": lambda: simulate(rc(), 1.0, save=np.linspace(0.0, 1.0, 117)),
    "fewer times to save at": lambda: simulate(rc(), 2.0, save=[0.5]),
    "steps instead of times": lambda: simulate(rc(), 1.0),
    "the end instead of times": lambda: simulate(rc(), 1.0, save="end"),
    "what is between the steps": lambda: simulate(rc(), 1.0, save="dense").at(np.linspace(0.0, 1.0, 7)),
    "more steps and events": lambda: simulate(rc(), 1.0, max_steps=5000, max_events=7),
    "an integral after the run": lambda: simulate(rc(), 1.0).integral(lambda s: s.c.v),
    "no error": lambda: simulate(rc(), 1.0, until=above(2.0), rtol=1e-9, save="end", throw=False),
}


@pytest.mark.usefixtures("known")
@pytest.mark.parametrize("change", SAME)
def test_what_is_not_compiled_again(change: str) -> None:
    assert compiled_by(SAME[change]) == 0


@pytest.mark.thorough
@pytest.mark.parametrize("n", [1, 15, 16, 17, 128, 129, 1100])
def test_as_many_rows_are_saved_as_times_are_asked_for(n: int) -> None:
    times = np.linspace(0.2, 0.9, n)

    def saved(capacity: Any) -> Any:
        sol = simulate(rc(C=capacity), 1.0, save=times, integrals=lambda s: dict(v=s.c.v), rtol=1e-9)
        return sol.ts, sol["c.v"], sol.integrals["v"]

    exact = 5.0 * (1.0 - np.exp(-times / 0.1)), 5.0 * (times - 0.1 * (1.0 - np.exp(-times / 0.1)))
    slope, batch = jax.jacfwd(saved)(1e-3), jax.vmap(saved)(np.array([1e-3, 2e-3]))
    for found in (saved(1e-3), jax.tree.map(lambda x: x[0], batch)):
        np.testing.assert_array_equal(found[0], times)
        np.testing.assert_allclose(found[1:], exact, rtol=1e-6)
    assert [x.shape for x in slope] == [(n,)] * 3
    np.testing.assert_allclose(slope[1], -5e3 * (times / 0.1) * np.exp(-times / 0.1), rtol=1e-5, atol=1e-2)


@pytest.mark.thorough
@pytest.mark.usefixtures("known")
def test_what_is_compiled_again() -> None:
    """Another condition; and its numbers are not mixed up with those of the one before."""
    times = []
    condition = lambda s: s.c.v**2 - 4.0  # noqa: E731
    added = compiled_by(lambda: times.append(simulate(rc(), 1.0, until=condition, rtol=1e-9, save="end").t1))
    assert added == 3  # its start, its steps and its end
    np.testing.assert_allclose(times, [charging_time(2.0)], rtol=1e-7)


@pytest.mark.usefixtures("known")
def test_a_new_level_is_honoured_without_compiling() -> None:
    for level in (1.0, 4.5):
        t1 = simulate(rc(), 1.0, until=above(level), rtol=1e-9, save="end").t1
        np.testing.assert_allclose(t1, charging_time(level), rtol=1e-7)


def with_slope(slope: float) -> Any:
    """The voltage, whose derivative is stated."""

    @jax.custom_jvp
    def same(x: Any) -> Any:
        return x

    same.defjvp(lambda point, rates: (same(*point), slope * rates[0]))
    return lambda s: same(s.c.v)


def with_reverse_slope(slope: float) -> Any:
    @jax.custom_vjp
    def same(x: Any) -> Any:
        return x

    same.defvjp(lambda x: (x, None), lambda _, rate: (slope * rate,))
    return lambda s: same(s.c.v)


def with_sign(zero: float) -> Any:
    return lambda s: s.c.v + jnp.copysign(1.0, zero)


def with_power(n: float) -> Any:
    return lambda s: s.c.v * (2.0 if n is True else 3.0)


def outside(function: Any) -> Any:
    return lambda s: jax.pure_callback(function, jax.ShapeDtypeStruct((), float), s.c.v)


OTHERS: dict[str, tuple[Any, Any]] = {
    "a derivative of its own": (with_slope(1.0), with_slope(2.0)),
    "a derivative of its own in reverse": (with_reverse_slope(1.0), with_reverse_slope(2.0)),
    "signs of zero": (with_sign(0.0), with_sign(-0.0)),
    "one or true": (with_power(1), with_power(True)),
    "a function of Python": (outside(lambda x: np.sin(x)), outside(lambda x: np.cos(x))),
}


def made_of(function: Any) -> Any:
    found, constants = trace(function, system_of(rc()).flat, "until")
    return found, [(np.signbit(number).tolist(), np.asarray(number).tolist()) for number in constants]


@pytest.mark.parametrize("case", OTHERS)
def test_functions_that_only_look_alike_are_told_apart(case: str) -> None:
    one, other = OTHERS[case]
    assert made_of(one) == made_of(one) != made_of(other)


def test_functions_with_equal_derivatives_of_their_own_are_the_same() -> None:
    assert made_of(with_slope(1.0)) == made_of(with_slope(1.0))


class Stated(Component):
    """Notes when its equations are traced; its structure holds plain numbers."""

    x: Var[Scalar, ""] = 1.0
    power: float = 1.0
    n: int = 1
    flag: bool = True

    def equations(self, d: Self) -> Equations:
        traced.append(self.power)
        return dict(decay=eq(d.x, -(self.x**self.power) * self.n))


traced: list[float] = []


def test_equations_are_traced_once() -> None:
    assert system_of(Stated()) is system_of(Stated())
    assert traced == [1.0]


def test_plain_numbers_of_a_structure_are_of_the_kind_that_is_annotated() -> None:
    """Each of 1, 1.0 and True would be found for the others."""
    odd: Any = Stated(power=2, n=1.0, flag=1)  # pyright: ignore[reportArgumentType]
    assert [repr(value) for value in (odd.power, odd.n, odd.flag)] == ["2.0", "1", "True"]
    assert repr(Stated(power=-0.0).power) == "0.0"
    kept: Any = Stated(power=float("inf"), n=2.5, flag=3)  # pyright: ignore[reportArgumentType]
    assert (kept.power, kept.n, kept.flag) == (float("inf"), 2.5, 3)


@pytest.mark.thorough
def test_trajectories_of_another_length_are_read_without_compiling() -> None:
    """A program for each number of rows would take longer to compile than all else that a reading does."""
    compiled: list[str] = []

    def listen(event: str, duration_secs: float, **kwargs: str | int) -> None:
        if event.endswith("backend_compile_duration"):
            compiled.append(event)

    def length(sol: Any) -> int:
        assert len(sol.c.v) == len(sol.integrals) == len(sol.ys)
        return len(sol.ts)

    # Both have fewer than 64 rows, to which all are filled up, so that there is one program for them.
    short, long = (simulate(rc(), 1.0, rtol=rtol, integrals=lambda s: s.c.v) for rtol in (1e-6, 1e-7))
    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        rows, before = length(short), len(compiled)
        assert length(long) > rows
        assert len(compiled) == before
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)
