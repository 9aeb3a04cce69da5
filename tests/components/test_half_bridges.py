"""A leg of a bridge: dead time, losses and averages, and the derivative of a current by the duty."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, Scalar, connect, simulate
from acausal.testing import check_law
from components import blocks, electrical, thermal
from components.electrical import AveragedHalfBridge, Ground, HalfBridge, Inductor, Resistor

V = 100.0


def two_legs(source: Any, ground: Any, duty: Any, room: Any, *legs: Any) -> Connections:
    """Each leg has a load of its own: a resistor and a coil in series, and a heat port."""
    wires = [connect(source.n, ground.p)]
    for leg, resistor, coil in (legs[:3], legs[3:]):
        wires += [
            connect(source.p, leg.p),
            connect(source.n, leg.n, coil.n),
            connect(leg.out, resistor.p),
            connect(resistor.n, coil.p),
            connect(duty.y, leg.duty),
            connect(leg.heat, room.port),
        ]
    return tuple(wires)


@pytest.mark.thorough
def test_a_switched_leg_has_the_mean_voltage_and_the_losses_of_its_average() -> None:
    """With i = 5 A: the mean voltage d V - dead_time f V - V_0 - R_on i drives the load, and the losses are heat."""
    f = 10e3
    data: dict[str, Any] = dict(frequency=f, dead_time=2e-6, V_0=1.0, R_on=0.1, t_switch=1e-6)
    loads = Resistor(R=9.4), Inductor(L=0.05, i=5.0)
    parts = (
        electrical.ConstantVoltage(V=V),
        Ground(),
        blocks.Constant(k=0.505),
        thermal.FixedTemperature(temperature=300.0),
        HalfBridge(heat=thermal.HeatPort(), **data),
        *loads,
        AveragedHalfBridge(heat=thermal.HeatPort(), **data),
        *loads,
    )
    mean = 50.5 - 2.0 - 1.0  # 5 A flow steadily at 47.5 V through 9.5 ohm
    assert mean == pytest.approx(9.5 * 5.0)
    solution = simulate(Rig(parts=parts, wiring=two_legs), 10.0 / f, save="steps", energy=True, rtol=1e-8)
    switched, averaged = solution.final.parts[6].i, solution.final.parts[9].i
    assert float(averaged) == pytest.approx(5.0, abs=1e-9)
    assert float(switched) == pytest.approx(5.0, abs=2e-3)
    loss = 5.0 * (1.0 + 0.5) + V * 5.0 * 1e-6 * f
    assert float(-solution.final.parts[7].heat.Q_flow) == pytest.approx(loss, rel=1e-9)
    assert float(-solution.final.parts[4].heat.Q_flow) == pytest.approx(loss, rel=3e-3)
    assert abs(float(solution.energy.imbalance)) < 1e-6


def test_short_pulses_and_currents_into_the_leg() -> None:
    """A current into the leg begins the pulse early; a pulse shorter than the dead time is left out."""
    averaged = AveragedHalfBridge(frequency=1e4, dead_time=5e-6, i_0=1e-3)
    given = {"p.v": V, "n.v": 0.0, "duty.value": [0.5, 0.5, 0.01, 0.99], "out.i": [-5.0, 5.0, -5.0, 5.0]}
    check_law(averaged, given=given, expected={"g": [0.45, 0.55, 0.0, 1.0]})


def driven_legs(source: Any, ground: Any, *parts: Any) -> Connections:
    """Pairs of a leg, the source of its load current and its duty."""
    wires = [connect(source.n, ground.p)]
    for leg, load, duty in (parts[:3], parts[3:6], parts[6:]):
        wires += [
            connect(source.p, leg.p),
            connect(source.n, leg.n, load.n),
            connect(leg.out, load.p),
            connect(duty.y, leg.duty),
        ]
    return tuple(wires)


@pytest.mark.thorough
def test_pulses_begin_or_end_late_and_short_ones_are_left_out() -> None:
    """Pulses of 40 us from 30 us to 70 us with a dead time of 4 us, and of 2 us with the same."""
    leg = HalfBridge(frequency=1e4, dead_time=4e-6)
    out, into = electrical.ConstantCurrent(I=5.0), electrical.ConstantCurrent(I=-5.0)
    wide, narrow = blocks.Constant(k=0.4), blocks.Constant(k=0.02)
    parts = (electrical.ConstantVoltage(V=V), Ground(), leg, out, wide, leg, into, wide, leg, out, narrow)
    t = 1e-6 * np.array([29.0, 32.0, 35.0, 50.0, 69.0, 72.0, 75.0, 132.0, 135.0])
    solution = simulate(Rig(parts=parts, wiring=driven_legs), 140e-6, save=jnp.asarray(t))
    found = np.array([solution.parts[i].out.v for i in (2, 5, 8)]) / V
    expected = [[0, 0, 1, 1, 1, 0, 0, 0, 1], [0, 1, 1, 1, 1, 1, 0, 1, 1], [0] * 9]
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.thorough
def test_a_gate_that_does_not_switch_has_no_switching_loss() -> None:
    """Duties of 1, 0 and 0.99; the last, with a dead time of 4 per cent and a current into the leg, keeps it on."""
    leg, into = HalfBridge(frequency=1e4, dead_time=4e-6, t_switch=1e-6), electrical.ConstantCurrent(I=-5.0)
    duties = [blocks.Constant(k=k) for k in (1.0, 0.0, 0.99)]
    parts = (electrical.ConstantVoltage(V=V), Ground(), *(part for duty in duties for part in (leg, into, duty)))
    t = 1e-6 * np.array([20.0, 180.0, 199.8, 200.2, 201.0, 320.0])
    solution = simulate(Rig(parts=parts, wiring=driven_legs), 340e-6, save=jnp.asarray(t))
    on, off, nearly_on = (solution.parts[i] for i in (2, 5, 8))
    np.testing.assert_allclose(np.array([leg.out.v for leg in (on, off, nearly_on)]) / V, [[1] * 6, [0] * 6, [1] * 6])
    np.testing.assert_allclose(np.array([leg.drawn for leg in (on, off)])[:, -1], 0.0, atol=1e-12)


def loaded(source: Any, leg: Any, duty: Any, resistor: Any, coil: Any, ground: Any) -> Connections:
    return (
        connect(source.p, leg.p),
        connect(source.n, leg.n, coil.n, ground.p),
        connect(duty.y, leg.duty),
        connect(leg.out, resistor.p),
        connect(resistor.n, coil.p),
    )


@pytest.mark.thorough
def test_the_derivative_of_the_current_by_the_duty() -> None:
    """The edges move with the duty: pulses of a time constant L/R, with a late begin, up to the middle of the fifth."""
    R, L, f, dead, t1 = 2.0, 1e-3, 1e4, 2e-6, 4.5e-4

    def end(duty: Scalar) -> Scalar:
        leg = HalfBridge(frequency=f, dead_time=dead)
        parts = (
            electrical.ConstantVoltage(V=V),
            leg,
            blocks.Constant(k=duty),
            Resistor(R=R),
            Inductor(L=L, i=5.0),
            Ground(),
        )
        return simulate(Rig(parts=parts, wiring=loaded), t1, rtol=1e-9, save="end").final.parts[4].i

    def exact(duty: float) -> float:
        start = (np.arange(5) + 0.5 - 0.5 * duty) / f + dead
        stop = np.minimum((np.arange(5) + 0.5 + 0.5 * duty) / f, t1)
        decay = np.exp(-R / L * (t1 - stop)) - np.exp(-R / L * (t1 - start))
        return 5.0 * np.exp(-R / L * t1) + V / R * float(np.sum(decay))

    value, slope = jax.value_and_grad(end)(0.4)
    assert value == pytest.approx(exact(0.4), rel=1e-8)
    assert slope == pytest.approx((exact(0.4 + 1e-5) - exact(0.4 - 1e-5)) / 2e-5, rel=1e-7)
