"""Belt drives against closed forms."""

from typing import Any

import jax
import numpy as np
import pytest

from acausal import Component, Connections, Scalar, SimulationError, connect, linearise, replace, simulate
from acausal.testing import check_law
from components.blocks import Ramp
from components.rotational import FrictionBelt, Inertia, SignalTorque, SynchronousBelt

BELT: dict[str, Any] = dict(r_a=0.05, r_b=0.1, F_0=400.0, EA=150e3, length=0.5)
C = 150e3 / 0.5  # stiffness of a strand, N/m


def test_the_tensions_of_the_strands() -> None:
    belt = SynchronousBelt(**BELT, d=30.0)
    force = 2.0 * (C * (0.05 * 0.22 - 0.1 * 0.1) + 30.0 * (0.05 * 2.0 - 0.1 * 3.0))
    given = {"a.phi": 0.22, "b.phi": 0.1, "der(a.phi)": 2.0, "der(b.phi)": 3.0}
    check_law(belt, given=given, expected={"F": force, "a.tau": 0.05 * force, "b.tau": -0.1 * force})


class Drive(Component):
    """A torque on the small pulley, inertias on both."""

    torque: SignalTorque
    ramp: Ramp
    motor: Inertia
    belt: FrictionBelt | SynchronousBelt
    load: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.ramp.y, self.torque.u),
            connect(self.torque.flange, self.motor.a),
            connect(self.motor.b, self.belt.a),
            connect(self.belt.b, self.load.a),
        )


def drive(belt: FrictionBelt | SynchronousBelt, torque: float) -> Drive:
    ramp = Ramp(height=torque, duration=1.0)
    return Drive(torque=SignalTorque(), ramp=ramp, motor=Inertia(J=0.01), belt=belt, load=Inertia(J=0.2))


def test_the_natural_frequency_and_its_derivative() -> None:
    """Two inertias with the torsional stiffness 2 C r_a^2 at a: w^2 = 2 C (r_a^2/J_a + r_b^2/J_b)."""
    model = drive(SynchronousBelt(**BELT), 1.0)

    def frequency(EA: Scalar) -> Scalar:
        return jax.numpy.max(jax.numpy.abs(linearise(replace(model, {"belt.EA": EA})).poles))

    exact = np.sqrt(2.0 * C * (0.05**2 / 0.01 + 0.1**2 / 0.2))
    value, slope = jax.jit(jax.value_and_grad(frequency))(150e3)
    np.testing.assert_allclose([value, slope], [exact, 0.5 * exact / 150e3], rtol=1e-8)


def test_energy_and_ratio() -> None:
    """The load gains the speed r_a/r_b of the motor, and the account closes."""
    run = simulate(drive(SynchronousBelt(**BELT, d=50.0), 2.0), 1.5, save="end", rtol=1e-8, energy=True)
    np.testing.assert_allclose(run.final.load.w, 0.5 * run.final.motor.w, rtol=1e-4)
    # Momentum about the axes, in terms of the motor: (J_a + J_b (r_a/r_b)^2) dw/dt = torque.
    np.testing.assert_allclose(run.final.motor.w, 2.0 * 1.0 / (0.01 + 0.2 / 4.0), rtol=1e-4)
    assert abs(run.energy.imbalance) < 1e-6


def test_a_friction_belt_slips_where_euler_and_eytelwein_say() -> None:
    """The ratio of the tensions is exp(mu wrap) there; below, the run goes on."""
    belt = FrictionBelt(**BELT, d=50.0, mu=0.3, wrap=2.8)
    grip = float(belt.grip())
    np.testing.assert_allclose((400.0 + grip / 2.0) / (400.0 - grip / 2.0), np.exp(0.3 * 2.8), rtol=1e-12)
    share = (0.2 / 4.0) / (0.01 + 0.2 / 4.0)  # of the torque passes through the belt
    holds, slips = 0.97 * grip * 0.05 / share, 1.03 * grip * 0.05 / share
    run = simulate(drive(belt, holds), 1.5, save="end")
    np.testing.assert_allclose(run.final.belt.F, 0.97 * grip, rtol=1e-3)
    with pytest.raises(SimulationError, match=r"belt.*a belt slips\. Increase its pretension F_0"):
        simulate(drive(belt, slips), 1.5, save="end")


def test_a_synchronous_belt_refuses_a_slack_strand() -> None:
    share = (0.2 / 4.0) / (0.01 + 0.2 / 4.0)
    belt = SynchronousBelt(**BELT, d=50.0)
    run = simulate(drive(belt, 0.97 * 800.0 * 0.05 / share), 1.5, save="end")
    np.testing.assert_allclose(run.final.belt.F, 0.97 * 800.0, rtol=1e-3)
    with pytest.raises(SimulationError, match="a strand of a belt is slack"):
        simulate(drive(belt, -1.03 * 800.0 * 0.05 / share), 1.5, save="end")
