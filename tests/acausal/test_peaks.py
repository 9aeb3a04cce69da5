"""The largest values over a run, and their times, against closed forms; derivatives against those of the forms."""

import math
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import Oscillator, oscillator, rc

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    Time,
    Var,
    at,
    eq,
    replace,
    simulate,
    when,
)

C, D, S0 = 4.0, 0.8, 1.0  # of the damped oscillator of unit mass


def speeds(s: Oscillator) -> dict[str, Any]:
    return {"forth": s.mass.v, "back": -s.mass.v, "place": -s.mass.a.s}


def turning(c: Any, d: Any) -> tuple[Any, Any]:
    """The largest speed back of s = exp(-d t / 2) (cos + d / (2 w) sin)(w t), and its time."""
    w = jnp.sqrt(c - d**2 / 4)
    time = jnp.arctan2(w, d / 2) / w
    return c / w * jnp.exp(-d / 2 * time) * jnp.sin(w * time), time


def peaks(c: Any, d: Any, save: Any = "end") -> Any:
    model = replace(oscillator(s0=S0), {"link.c": c, "link.d": d})
    return simulate(model, 3.0, peaks=speeds, rtol=1e-10, save=save).peaks


@pytest.mark.thorough
def test_extremum_within_a_step() -> None:
    found, (value, time) = peaks(C, D), turning(C, D)
    assert float(found["back"].value) == pytest.approx(float(value), rel=1e-8)
    assert float(found["back"].time) == pytest.approx(float(time), rel=1e-7)


@pytest.mark.thorough
@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_value_and_time(derivative: Any) -> None:
    def both(x: Any) -> Any:
        found = peaks(x[0], x[1])["back"]
        return jnp.stack([found.value, found.time])

    exact = jax.jacobian(lambda x: jnp.stack(turning(x[0], x[1])))(jnp.array([C, D]))
    np.testing.assert_allclose(derivative(both)(jnp.array([C, D])), exact, rtol=1e-6)


@pytest.mark.thorough
def test_peak_is_that_of_the_dense_solution() -> None:
    model = replace(oscillator(s0=S0), {"link.c": C, "link.d": D})
    solution = simulate(model, 3.0, peaks=speeds, rtol=1e-4, save="dense")
    for name, peak in solution.peaks.items():
        times = jnp.clip(peak.time + jnp.linspace(-1e-3, 1e-3, 201), 0.0, 3.0)
        values = speeds(solution.at(times))[name]
        assert float(jnp.max(values)) == pytest.approx(float(peak.value), rel=1e-9)
        assert float(peak.value) >= float(jnp.max(speeds(solution.at(jnp.linspace(0.0, 3.0, 2001)))[name])) - 1e-12


@pytest.mark.thorough
def test_peak_at_the_ends() -> None:
    # The charging current is largest at the start, the voltage at the end.
    solution = simulate(rc(), 0.2, peaks=lambda s: (s.r.i, s.c.v), rtol=1e-9)
    current, voltage = solution.peaks
    assert (float(current.time), float(voltage.time)) == (0.0, 0.2)
    assert float(current.value) == pytest.approx(0.05)
    assert float(voltage.value) == pytest.approx(5.0 * (1.0 - math.exp(-2.0)), rel=1e-8)


@pytest.mark.thorough
def test_peak_where_a_run_is_stopped() -> None:
    def peak(model: Any) -> Any:
        return simulate(model, 1.0, until=lambda s: s.c.v - 3.0, peaks=lambda s: {"v": s.c.v}, rtol=1e-9).peaks["v"]

    found = peak(rc())
    assert float(found.value) == pytest.approx(3.0, rel=1e-12)
    assert float(found.time) == pytest.approx(-0.1 * math.log(0.4), rel=1e-8)
    slopes = eqx.filter_grad(lambda model: peak(model).time)(rc())
    assert float(slopes.r.R) == pytest.approx(-1e-3 * math.log(0.4), rel=1e-7)
    assert float(eqx.filter_grad(lambda model: peak(model).value)(rc()).r.R) == pytest.approx(0.0, abs=1e-9)


class Sawtooth(Component):
    """x rises at a rate until it is set back: at a time, and where it reaches a level."""

    rate: Param[Scalar, "1/s"] = 2.0
    level: Param[Scalar, "1"] = 1.0
    reset: Param[Scalar, "s"] = 0.45
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0
    kick: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.rate + 0.0 * self.x))

    def events(self) -> Events:
        return dict(
            reach=when(self.x > self.level, x=0.0, kick=3.0), again=at(self.reset, x=-0.5, kick=-2.0),
        )  # fmt: skip


def test_peaks_before_and_after_events() -> None:
    def found(x: Any) -> Any:
        model = replace(Sawtooth(), {"rate": x[0], "level": x[1], "reset": x[2]})
        wanted = lambda s: {"x": s.x, "jump": s.kick - s.x, "low": -s.x}  # noqa: E731
        return simulate(model, 0.8, peaks=wanted, rtol=1e-9, save="end").peaks

    # x is 0.9 as it is set to -0.5 at 0.45 s; it ends at 0.2.
    x = jnp.array([2.0, 1.0, 0.45])
    peaks = found(x)
    assert float(peaks["x"].value) == pytest.approx(0.9, rel=1e-9)
    assert float(peaks["low"].value) == pytest.approx(0.5, rel=1e-9)
    assert float(peaks["jump"].value) == pytest.approx(0.0, abs=1e-12)
    assert float(peaks["x"].time) == pytest.approx(0.45, rel=1e-9)
    slopes = jax.jacfwd(lambda x: found(x)["x"])(x)
    np.testing.assert_allclose(slopes.value, [0.45, 0.0, 2.0], atol=1e-7)
    np.testing.assert_allclose(slopes.time, [0.0, 0.0, 1.0], atol=1e-7)
    # With a later reset, x reaches the level at 0.5 s.
    later = jnp.array([2.0, 1.0, 0.7])
    peaks, slopes = found(later), jax.jacfwd(lambda x: found(x))(later)
    assert float(peaks["x"].value) == pytest.approx(1.0, rel=1e-9)
    assert float(peaks["jump"].value) == pytest.approx(3.0, rel=1e-9)
    np.testing.assert_allclose(slopes["x"].value, [0.0, 1.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(slopes["x"].time, [-0.25, 0.5, 0.0], atol=1e-7)
    np.testing.assert_allclose(slopes["jump"].value, [0.0, 0.0, 0.0], atol=1e-7)


@pytest.mark.thorough
def test_batches_and_compiled_runs() -> None:
    cs = jnp.array([2.0, 4.0, 8.0])
    found = jax.jit(jax.vmap(lambda c: peaks(c, D)["back"]))(cs)
    np.testing.assert_allclose(found.value, turning(cs, D)[0], rtol=1e-8)
    np.testing.assert_allclose(found.time, turning(cs, D)[1], rtol=1e-7)


def test_backwards_and_without_states() -> None:
    model = replace(oscillator(s0=S0), {"link.c": C, "link.d": 0.0})
    found = simulate(model, -3.0, peaks=speeds, rtol=1e-10).peaks["forth"]
    assert float(found.value) == pytest.approx(2.0, rel=1e-8)
    assert float(found.time) == pytest.approx(-math.pi / 4, rel=1e-7)


def test_peaks_have_to_be_asked_for() -> None:
    with pytest.raises(ModelError, match=r"pass peaks=\.\.\. to simulate"):
        _ = simulate(rc(), 0.1).peaks
    with pytest.raises(ModelError, match="peaks must be a function of the variables, got 3"):
        simulate(rc(), 0.1, peaks=3)  # pyright: ignore[reportArgumentType]


class Plateaus(Component):
    """Nothing happens but two events, between which functions of time are looked at."""

    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0
    kick: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 0.0 * self.x))

    def events(self) -> Events:
        return dict(first=at(0.25, kick=1.0), last=at(0.75, kick=2.0))


@pytest.mark.thorough
def test_peaks_at_kinks() -> None:
    def wanted(s: Plateaus) -> dict[str, Any]:
        return {
            "kink": -jnp.abs(s.t - 0.5),
            "uneven kink": jnp.minimum(3.0 * (s.t - 0.4), 0.4 - s.t),
            "middle of a step": -((s.t - 0.5) ** 2),
        }

    found = simulate(Plateaus(), 1.0, peaks=wanted, save="end").peaks
    for name, time in (("kink", 0.5), ("uneven kink", 0.4)):
        assert float(found[name].value) == pytest.approx(0.0, abs=1e-5)
        assert float(found[name].value) <= 1e-12
        assert float(found[name].time) == pytest.approx(time, abs=1e-5)
    assert float(found["middle of a step"].value) == pytest.approx(0.0, abs=1e-12)
