"""Operational amplifiers and comparators: closed loop, limits, multivibrators."""

from typing import Any

import jax
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, ParameterError, Scalar, connect, linearise, simulate
from acausal.testing import check_law
from components import blocks, electrical
from components.electrical import Capacitor, Ground, OpAmp, Resistor, VoltageComparator

LIMITS: dict[str, Any] = dict(v_max=12.0, v_min=-12.0)


def inverting(signal: Any, source: Any, amplifier: Any, r1: Any, r2: Any, ground: Any) -> Connections:
    return (
        connect(signal.y, source.u),
        connect(source.p, r1.p),
        connect(r1.n, r2.p, amplifier.n),
        connect(r2.n, amplifier.out),
        connect(source.n, amplifier.p, ground.p),
    )


def multivibrator(amplifier: Any, r: Any, c: Any, r1: Any, r2: Any, ground: Any) -> Connections:
    """The output charges c through r; r1 and r2 divide it for the other input."""
    return (
        connect(amplifier.out, r.p, r1.p),
        connect(r.n, c.p, amplifier.n),
        connect(r1.n, r2.p, amplifier.p),
        connect(c.n, r2.n, ground.p),
    )


def oscillator(amplifier: Any, R: Scalar = 1e4) -> Rig:
    parts = (amplifier, Resistor(R=R), Capacitor(C=1e-7), Resistor(R=2e4), Resistor(R=1e4), Ground())
    return Rig(parts=parts, wiring=multivibrator)


def test_an_inverting_amplifier_has_the_gain_and_the_bandwidth_of_its_feedback() -> None:
    parts = (
        blocks.Constant(k=0.0),
        electrical.SignalVoltage(),
        OpAmp(gain=2e4, f_t=1e6, **LIMITS),
        Resistor(R=1e3),
        Resistor(R=1e4),
        Ground(),
    )
    system = linearise(Rig(parts=parts, wiring=inverting), inputs=["parts[0].k"], outputs=["parts[2].out.v"])
    loop = 1.0 + 11.0 / 2e4  # 1 + 1/(gain feedback) with the feedback 1/11
    assert float(np.ravel(system.dc_gain)[0]) == pytest.approx(-10.0 / loop, rel=1e-9)
    assert float(np.real(system.poles)[0]) == pytest.approx(-2.0 * np.pi * 1e6 / 11.0 * loop, rel=1e-9)


def test_the_output_stays_within_its_limits() -> None:
    amplifier = OpAmp(gain=1e4, f_t=1e6, slew=1e5, R_out=50.0, **LIMITS)
    given = {"p.v": [0.1, 0.1, 0.1], "n.v": 0.0, "x": [2.0, 12.1, -13.0], "out.i": -1e-3}
    outputs, rates = [1.95, 11.95, -12.05], [1e5, 2e6 * np.pi * -1.21e-3, 1e5]
    check_law(amplifier, given=given, expected={"out.v": outputs, "der(x)": rates})


@pytest.mark.thorough
def test_a_comparator_oscillates_at_the_period_of_its_thresholds() -> None:
    """2 R C ln((1 + b)/(1 - b)) with the share b = 1/3 of the divider, and half the band on top."""
    band = 0.2

    def period(R: Scalar) -> Scalar:
        times = simulate(oscillator(VoltageComparator(band=band, **LIMITS), R), 6e-3, rtol=1e-9).events.times
        return times[4] - times[2]

    b = 1.0 / 3.0 + 0.5 * band / 12.0
    expected = 2.0 * 1e4 * 1e-7 * np.log((1.0 + b) / (1.0 - b))
    value, slope = jax.value_and_grad(period)(1e4)
    assert value == pytest.approx(expected, rel=1e-8)
    assert slope == pytest.approx(expected / 1e4, rel=1e-7)


@pytest.mark.thorough
def test_an_operational_amplifier_oscillates_and_its_delay_vanishes_with_its_pole() -> None:
    """Its output runs away as exp(w t/3), w = 2 pi f_t, from the difference that the capacitor makes at 8 V/ms."""
    expected = 2.0 * 1e4 * 1e-7 * np.log(2.0)

    def runaway(f_t: float) -> float:
        rate = 2.0 * np.pi * f_t / 3.0
        return 2.0 * np.log(12.0 * rate / 3.0 / 8e3) / rate / expected

    def excess(f_t: float) -> float:
        solution = simulate(oscillator(OpAmp(f_t=f_t, x=1.0, **LIMITS)), 6e-3, rtol=1e-7)
        v, t = solution["parts[0].out.v"], solution.ts
        rising = np.flatnonzero((v[:-1] < 0.0) & (v[1:] >= 0.0))
        times = t[rising] - v[rising] * (t[rising + 1] - t[rising]) / (v[rising + 1] - v[rising])
        return float(times[-1] - times[-2]) / expected - 1.0

    slow, fast = excess(1e5), excess(1e6)
    assert 1.0 < fast / runaway(1e6) < 1.6
    assert 1.0 < slow / runaway(1e5) < 1.6


def test_limits_are_in_order() -> None:
    with pytest.raises(ParameterError, match=r"OpAmp\.v_min must be smaller than v_max"):
        OpAmp(v_max=-1.0, v_min=1.0)
