"""Values read from a run afterwards: between steps, integrals, peaks and energies, from its recorded steps."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import oscillator, rc
from test_events import Ball

from acausal import Component, Equations, ModelError, Param, Scalar, UnresolvedWarning, Var, eq, simulate
from acausal._integrate.setup import settings

E0 = 0.7
G = 9.81


def flight(e: float) -> Any:
    """A ball that is let go from 1 m and rebounds from the floor, up to its second impact and somewhat more."""
    return Ball(h=1.0, e=e)


def times_of_impact(e: float) -> np.ndarray:
    fall = np.sqrt(2.0 / G)
    return np.cumsum([fall, 2.0 * e * fall, 2.0 * e**2 * fall])


def area(e: float) -> float:
    """The integral of the height up to the second impact: a fall, and a rebound of speed e v."""
    v = np.sqrt(2.0 * G)
    return v**3 / (3.0 * G**2) + (e * v) ** 3 / (6.0 * G**2) * 4.0


@pytest.mark.thorough
def test_integral_through_events_is_exact() -> None:
    solution = simulate(flight(E0), times_of_impact(E0)[1], rtol=1e-9)
    np.testing.assert_allclose(solution.integral(lambda s: s.h), area(E0), rtol=1e-9)


def test_integral_of_a_run_backwards() -> None:
    """The integral of v = 5 (1 - exp(-10 t)), which was -5 (e - 1) at -0.1 s: -0.1 * 5 - 0.5 (1 - e)."""
    solution = simulate(rc(), -0.1, integrals=lambda s: s.c.v, rtol=1e-10)
    exact = -0.5 - 0.5 * (1.0 - np.e)
    np.testing.assert_allclose([solution.integral(lambda s: s.c.v), solution.integrals[-1]], exact, rtol=1e-8)


def test_peaks_are_those_of_closed_forms() -> None:
    solution = simulate(flight(E0), 1.2, rtol=1e-9)
    found = solution.peak(lambda s: dict(speed=s.v, rebound=jnp.where(s.v > -1.0, s.h, 0.0) * (s.h < 0.6), low=-s.v))
    fall = np.sqrt(2.0 / G)
    np.testing.assert_allclose(found["speed"], (E0 * np.sqrt(2.0 * G), fall), rtol=1e-7)
    np.testing.assert_allclose(found["rebound"], (E0**2, fall + E0 * fall), rtol=1e-7)
    np.testing.assert_allclose(found["low"], (np.sqrt(2.0 * G), fall), rtol=1e-7)


@pytest.mark.thorough
def test_highest_of_peaks_that_are_nearly_as_high() -> None:
    """v = exp(-d t / 2) sin(w t) / w: each peak is lower than the one before by less than it rises above samples."""
    d = 1e-5
    w = np.sqrt(1.0 - 0.25 * d**2)
    first = np.arctan2(2.0 * w, d) / w
    height = np.exp(-0.5 * d * first)

    def swing(d: Any) -> Any:
        return simulate(oscillator(d=d, v0=1.0), 60.0, save="dense", max_steps=256).peak(lambda s: s.link.s_rel)

    for found in (swing(d), jax.jit(swing)(d)):
        np.testing.assert_allclose(found, (height, first), rtol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_an_integral_and_a_peak(mode: Any) -> None:
    """By the height and the restitution, up to a fixed time; the height moves the impact. After it,
    h = e v t - g t^2 / 2; the height of the rebound is e^2 h, and its time that of the fall times 1 + e.
    """

    def read(h: Any, e: Any) -> Any:
        solution = simulate(Ball(h=h, e=e), 1.0, rtol=1e-9, save="dense")
        peak = solution.peak(lambda s: jnp.where(s.v > -1.0, s.h, 0.0) * (s.h < 0.6))
        return solution.integral(lambda s: s.h), *peak

    def exact(h: Any, e: Any) -> Any:
        fall, v = jnp.sqrt(2.0 * h / G), jnp.sqrt(2.0 * G * h)
        left = 1.0 - fall
        return 2.0 / 3.0 * h * fall + e * v * left**2 / 2.0 - G * left**3 / 6.0, e**2 * h, fall * (1.0 + e)

    found, wanted = (jax.jit(mode(function, argnums=(0, 1)))(1.0, E0) for function in (read, exact))
    np.testing.assert_allclose(found[:2], wanted[:2], rtol=1e-6)
    np.testing.assert_allclose(found[2], wanted[2], rtol=1e-5)


class Swing(Component):
    """x = sin(w t) / w."""

    w: Param[Scalar, "1/s"] = 1.0
    x: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1/s"] = 1.0

    def equations(self, d: Any) -> Equations:
        return dict(speed=eq(d.x, self.v, check_units=False), spring=eq(d.v, -(self.w**2) * self.x, check_units=False))


def hump(w: Any, level: float) -> Any:
    """The integral of max(x - level, 0) over one half-wave, and the time above the level."""
    a = jnp.arcsin(level * w)
    return 2.0 / w * (jnp.cos(a) / w - level * (0.5 * jnp.pi - a)), (jnp.pi - 2.0 * a) / w


@pytest.mark.parametrize("level", [0.9, pytest.param(0.3, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("rtol", [1e-8, pytest.param(1e-5, marks=pytest.mark.thorough)])
def test_integrals_through_kinks_jumps_and_spikes_within_steps(rtol: float, level: float) -> None:
    def functions(s: Swing) -> dict[str, Any]:
        return {
            "kink": jnp.maximum(s.x - level, 0.0),
            "jump": jnp.where(s.x > level, 1.0, 0.0),
            "spike": jnp.exp(-(((s.x - level) / 0.02) ** 2)),
            "zero": 0.0 * s.x,
        }

    found = simulate(Swing(), 4.0, rtol=rtol).integral(functions)
    kink, jump = hump(1.0, level)
    t = np.linspace(0.0, 4.0, 400001)
    spike = np.mean(np.exp(-(((np.sin(t[:-1]) - level) / 0.02) ** 2))) * 4.0
    exact = {"kink": kink, "jump": jump, "spike": spike, "zero": 0.0}
    for name, value in exact.items():
        np.testing.assert_allclose(found[name], value, rtol=30.0 * rtol, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("level", [0.171, 0.268, 0.755])
def test_integral_of_a_jump_alone(level: float) -> None:
    """The time above a level. Other functions would divide the pieces in whose middle the jump is."""
    found = simulate(Swing(), np.pi, rtol=1e-8).integral(lambda s: jnp.where(s.x > level, 1.0, 0.0))
    np.testing.assert_allclose(found, np.pi - 2.0 * np.arcsin(level), atol=3e-8)


@pytest.mark.thorough
def test_integrals_through_kinks_have_their_derivatives_in_both_modes() -> None:
    def integral(w: Any) -> Any:
        solution = simulate(Swing(w=w), 4.0, rtol=1e-10, save="dense", max_steps=512)
        return solution.integral(lambda s: jnp.maximum(s.x - 0.9, 0.0))

    exact = jax.grad(lambda w: hump(w, 0.9)[0])
    found = [jax.jit(jax.jacfwd(integral))(0.98), jax.grad(integral)(0.98)]
    np.testing.assert_allclose(found, exact(0.98), rtol=1e-7)


@pytest.mark.thorough
def test_an_integral_that_does_not_converge_is_reported() -> None:
    def noise(s: Swing) -> Any:
        return jnp.sin(1e14 * s.x)

    with pytest.warns(UnresolvedWarning, match=r"estimated error of sol\.integral"):
        simulate(Swing(), 1.0).integral(noise)


@pytest.mark.thorough
def test_an_integral_that_does_not_converge_is_an_error_within_transformations() -> None:
    def noise(w: Any) -> Any:
        return simulate(Swing(w=w), 1.0, save="dense", max_steps=64).integral(lambda s: jnp.sin(1e14 * s.x))

    with pytest.raises(RuntimeError, match="estimated error"):
        jax.jit(noise)(1.0)


@pytest.mark.parametrize("rtol", [1e-8, pytest.param(1e-4, marks=pytest.mark.thorough)])
def test_narrow_peaks_and_kinks_within_steps(rtol: float) -> None:
    def functions(s: Swing) -> dict[str, Any]:
        return {
            "narrow": jnp.exp(-(((s.x - 0.5) / 0.03) ** 2)) * (s.v > 0.0),
            "kink": jnp.minimum(s.v, s.x),
            "spike": -jnp.sqrt(jnp.abs(s.x - 0.7)) - (s.v < 0.0),
        }

    found = simulate(Swing(), 4.0, rtol=rtol).peak(functions)
    exact = {"narrow": (1.0, np.pi / 6.0), "kink": (np.sqrt(0.5), np.pi / 4.0), "spike": (0.0, np.arcsin(0.7))}
    for name, peak in exact.items():
        np.testing.assert_allclose(found[name], peak, rtol=30.0 * rtol, atol=1e-4 if name == "spike" else 0.0)


@pytest.mark.thorough
def test_what_is_read_after_a_run_is_what_the_run_itself_reads() -> None:
    before = simulate(flight(E0), 2.0, energy=True, integrals=lambda s: s.h, peaks=lambda s: s.v)
    after = simulate(flight(E0), 2.0)
    np.testing.assert_allclose(after.integral(lambda s: s.h), before.integrals[-1], rtol=1e-9)
    np.testing.assert_allclose(after.peak(lambda s: s.v), before.peaks, rtol=1e-9)
    np.testing.assert_allclose(after.energy.totals, before.energy.totals, atol=1e-9)
    assert after.energy.events.keys() == before.energy.events.keys()
    np.testing.assert_allclose(*(list(x.energy.events.values()) for x in (after, before)), rtol=1e-9)


@pytest.mark.thorough
def test_account_of_a_charge_closes_without_being_asked_for() -> None:
    account = simulate(rc(), 0.3, rtol=1e-9).energy
    np.testing.assert_allclose(account.stored["c"], 0.5 * 1e-3 * (5.0 * (1.0 - np.exp(-3.0))) ** 2, rtol=1e-7)
    assert abs(account.imbalance) < 1e-9


def test_account_closes_where_no_event_happens() -> None:
    account = simulate(flight(E0), 0.1).energy
    assert account.events == {"impact": 0.0}
    assert abs(account.imbalance) < 1e-9


@pytest.mark.thorough
def test_account_is_not_a_number_where_the_history_lacks_an_event() -> None:
    """Within `jit` there is room for so many moments; the loss of a later event has nobody to be told of."""

    def imbalance(e: Any) -> Any:
        return simulate(Ball(h=1.0, e=e), 2.555, max_events=1, save="dense").energy.imbalance

    assert np.isnan(jax.jit(imbalance)(E0))
    assert abs(imbalance(E0)) < 1e-6


@pytest.mark.thorough
def test_runs_in_a_batch_are_read_one_by_one() -> None:
    es = np.array([0.5, 0.7])
    batch = jax.vmap(lambda e: simulate(Ball(h=1.0, e=e), 1.0, save="dense"))(es)
    alone = [simulate(Ball(h=1.0, e=e), 1.0) for e in es]
    np.testing.assert_allclose(batch.integral(lambda s: s.h), [x.integral(lambda s: s.h) for x in alone], rtol=1e-7)
    np.testing.assert_allclose(batch.peak(lambda s: s.v).value, [x.peak(lambda s: s.v).value for x in alone], rtol=1e-7)
    for name in alone[0].energy.events:
        np.testing.assert_allclose(batch.energy.events[name], [x.energy.events[name] for x in alone], rtol=1e-6)


@pytest.mark.thorough
def test_a_run_in_many_pieces_is_that_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = simulate(flight(E0), 2.5)
    monkeypatch.setattr(settings, "STEPS", 3)
    monkeypatch.setattr(settings, "ROOM", 0)
    monkeypatch.setattr(settings, "MOMENTS", 1)
    pieces = simulate(flight(E0), 2.5)
    for read in (lambda s: s.ts, lambda s: s.h, lambda s: s.events.times, lambda s: s.at(np.linspace(0.0, 2.5, 50)).v):
        np.testing.assert_array_equal(read(pieces), read(whole))
    assert pieces.stats["num_steps"] == whole.stats["num_steps"] > 6


@pytest.mark.thorough
def test_known_and_traced_runs_show_the_same() -> None:
    times = np.linspace(0.0, 2.0, 30)

    def read(e: Any, save: Any) -> Any:
        solution = simulate(Ball(h=1.0, e=e), 2.0, save=save)
        return solution.ts, solution.h, solution.v

    for save in (times, "end"):
        traced = jax.jit(lambda e, save=save: read(e, save))(E0)
        np.testing.assert_allclose(np.stack(read(E0, save)), np.stack(traced), atol=1e-9)


@pytest.mark.thorough
@pytest.mark.filterwarnings("error")
def test_times_after_a_stop_are_left_out_without_a_warning() -> None:
    solution = simulate(flight(E0), 2.0, until=lambda s: s.h - 0.5, save=np.array([0.0, 0.1, 1.0, 2.0]))
    np.testing.assert_array_equal(solution.ts, [0.0, 0.1])


@pytest.mark.parametrize("t", [-1e-9, 0.2 + 1e-9, [0.1, 1.0], np.nan, np.inf])
def test_a_time_outside_the_run_is_refused(t: Any) -> None:
    run = simulate(flight(E0), 0.2)
    with pytest.raises(ModelError, match=r"takes times within the run.*The run covers 0 s to 0\.2 s"):
        run.at(t)
    np.testing.assert_array_equal(run.at(0.2 * (1.0 + 2e-16)).h, run.at(0.2).h)


@pytest.mark.thorough
def test_a_time_outside_a_run_of_a_batch_is_refused() -> None:
    """Outside of transformations and within them."""

    def ended(h: Any) -> Any:
        return simulate(Ball(h=h, e=E0), 2.0, until=lambda s: s.h - 0.5, save="dense")

    batch = jax.vmap(ended)(np.array([0.6, 1.0]))
    assert np.all(np.asarray(batch.at(0.1).h) > 0.5)
    with pytest.raises(ModelError, match="takes times within the run"):
        batch.at(0.2)
    read = eqx.filter_jit(jax.vmap(lambda h: ended(h).at(0.2).h))
    np.testing.assert_allclose(read(np.array([1.0, 1.1])), np.array([1.0, 1.1]) - 0.5 * G * 0.2**2, atol=1e-4)
    with pytest.raises(RuntimeError, match="takes times within the run"):
        read(np.array([0.6, 1.0]))


def test_the_slope_in_time_holds_up_to_both_ends() -> None:
    speed = jax.jacfwd(lambda t: simulate(flight(E0), 0.2, save="dense").at(t).h)
    assert float(speed(0.2)) == pytest.approx(-G * 0.2, rel=1e-4)


def test_limits_of_steps_and_events_hold_in_pieces() -> None:
    solution = simulate(flight(E0), 2.0, max_steps=5, throw=False)
    assert int(solution.stats["num_steps"]) == 5
    assert "maximum number of steps" in repr(solution)
    assert len(simulate(flight(E0), 2.0, max_events=2).events) == 4
    assert len(jax.jit(lambda e: simulate(flight(e), 2.0, max_events=2).events)(E0)) == 2


@pytest.mark.thorough
@pytest.mark.parametrize("wrong", [3.0, lambda s: s.h > 0.0, lambda s: jnp.ones(2) * s.h])
def test_what_is_no_function_of_the_variables_is_refused(wrong: Any) -> None:
    solution = simulate(flight(E0), 0.1)
    for read, name in ((solution.integral, "integral"), (solution.peak, "peak")):
        with pytest.raises(ModelError, match=name):
            read(wrong)


@pytest.mark.thorough
def test_a_known_run_is_read_at_once_also_while_jax_traces() -> None:
    """A run that a traced function reads, such as a course to follow. Functions of traced numbers are traced."""
    solution = simulate(rc(), 0.2)

    def readings(gain: Any) -> Any:
        at, peak = solution.at(0.1).c.v, solution.peak(lambda s: s.c.v).value
        known = at, peak, solution.integral(lambda s: s.c.v), solution.c.v, solution.final.c.v
        return [gain * value for value in known], solution.at(0.1 * gain).c.v, solution.integral(lambda s: gain * s.c.v)

    for found, value in zip(*map(jax.tree.leaves, (jax.jit(readings)(0.5), readings(0.5))), strict=True):
        np.testing.assert_allclose(found, value, rtol=1e-12)


def test_no_times_give_no_values() -> None:
    assert np.shape(simulate(rc(), 0.2).at(np.zeros((0, 3))).c.v) == (0, 3)


@pytest.mark.parametrize(
    ("read", "option"),
    [
        (lambda sol: sol.integral(lambda s: s.c.v), r"integrals=\.\.\."),
        (lambda sol: sol.peak(lambda s: s.c.v), r"peaks=\.\.\."),
        (lambda sol: sol.energy, "energy=True"),
    ],
)
def test_a_run_without_steps_names_the_option_that_needs_none(read: Callable[[Any], Any], option: str) -> None:
    end = simulate(rc(), 1.0, save="end")
    with pytest.raises(ModelError, match=rf'save="dense".* or simulate\(\.\.\., {option}\), which needs no steps'):
        read(end)
