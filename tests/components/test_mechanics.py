"""Gears, friction, springs and masses against closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal import Component, Connections, connect, simulate
from components import rotational, translational
from components.blocks import Constant
from components.rotational import (
    ConstantTorque,
    Fixed,
    IdealGear,
    Inertia,
    MeshLoss,
    PlanetaryGear,
    PlanetaryGearbox,
    SignalSpeed,
    SmoothStribeckFriction,
    SpeedSensor,
    TorqueSensor,
    WormGear,
)


class DrivenPlanetary(Component):
    """Sun and ring driven at given speeds, the carrier loaded by a torque and read."""

    gear: PlanetaryGear
    sun_speed: Constant
    ring_speed: Constant
    load: ConstantTorque
    sun: SignalSpeed = SignalSpeed()
    ring: SignalSpeed = SignalSpeed()
    sensor: SpeedSensor = SpeedSensor()

    def connections(self) -> Connections:
        return (
            connect(self.sun_speed.y, self.sun.u),
            connect(self.ring_speed.y, self.ring.u),
            connect(self.sun.flange, self.gear.sun),
            connect(self.ring.flange, self.gear.ring),
            connect(self.gear.carrier, self.load.flange, self.sensor.flange),
        )


@pytest.mark.thorough
@settings(deadline=None, max_examples=20)
@given(st.floats(0.1, 10.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_willis(ratio: float, w_sun: float, w_ring: float) -> None:
    """w_sun + r w_ring = (1 + r) w_carrier, and the load is shared as 1 : r."""
    rig = DrivenPlanetary(
        gear=PlanetaryGear(ring_to_sun=ratio),
        sun_speed=Constant(k=w_sun),
        ring_speed=Constant(k=w_ring),
        load=ConstantTorque(torque=2.0),
    )
    end = simulate(rig, 0.1, save="end").final
    np.testing.assert_allclose(end.sensor.y.value * (1.0 + ratio), w_sun + ratio * w_ring, atol=1e-9)
    np.testing.assert_allclose(end.gear.sun.tau, -2.0 / (1.0 + ratio), rtol=1e-9)
    np.testing.assert_allclose(end.gear.ring.tau, -2.0 * ratio / (1.0 + ratio), rtol=1e-9)


class PlanetaryReducer(Component):
    """A planetary stage with its ring held, driven at the sun by a speed and loaded at the carrier by a torque."""

    gearbox: PlanetaryGearbox
    speed: Constant
    load: ConstantTorque
    drive: SignalSpeed = SignalSpeed()
    sensor: TorqueSensor = TorqueSensor()
    housing: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.speed.y, self.drive.u),
            connect(self.drive.flange, self.sensor.a),
            connect(self.sensor.b, self.gearbox.sun),
            connect(self.gearbox.ring, self.housing.flange),
            connect(self.gearbox.carrier, self.load.flange),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("torque", [-3.0, 3.0])
def test_efficiency_of_a_planetary_stage(torque: float) -> None:
    """Driving, (1 + (N - 1) eta)/N; driven back by the load, less by the same loss at the meshes."""
    N, eta = 4.3, 0.97
    rig = PlanetaryReducer(
        gearbox=PlanetaryGearbox(ratio=N, loss=MeshLoss(efficiency=eta, transition_power=1e-3)),
        speed=Constant(k=100.0),
        load=ConstantTorque(torque=torque),
    )
    end = simulate(rig, 0.1, save="end").final
    share = end.sensor.y.value * N / -torque
    tau_ring = end.gearbox.ring.tau
    assert tau_ring * torque < 0.0
    # Carrier-fixed: the sun passes its power to the ring at eta, or takes it from there at 2 - 1/eta.
    factor = 1.0 / eta if torque < 0.0 else 2.0 - 1.0 / eta
    np.testing.assert_allclose((N - 1.0) * end.gearbox.sun.tau, tau_ring * factor, rtol=1e-9)
    np.testing.assert_allclose(share, N * factor / (factor + N - 1.0), rtol=1e-9)
    if torque < 0.0:
        np.testing.assert_allclose(1.0 / share, (1.0 + (N - 1.0) * eta) / N, rtol=1e-9)


def test_planetary_stage_from_teeth() -> None:
    assert PlanetaryGearbox.from_teeth(sun=20, ring=66).ratio == pytest.approx(4.3)


class LoadedWorm(Component):
    """A worm driven at a speed, its wheel loaded by a torque."""

    gear: WormGear
    speed: Constant
    load: ConstantTorque
    drive: SignalSpeed = SignalSpeed()

    def connections(self) -> Connections:
        return (
            connect(self.speed.y, self.drive.u),
            connect(self.drive.flange, self.gear.worm),
            connect(self.gear.wheel, self.load.flange),
        )


@pytest.mark.parametrize("efficiency", [0.4, 0.7])
def test_worm_lifts_with_its_efficiency_and_lowers_with_the_same_friction(efficiency: float) -> None:
    gear = WormGear(ratio=38.0, loss=MeshLoss(efficiency=efficiency, transition_power=1e-3))
    torques = []
    for speed in (300.0, -300.0):
        rig = LoadedWorm(gear=gear, speed=Constant(k=speed), load=ConstantTorque(torque=-5.0))
        torques.append(float(simulate(rig, 0.1, save="end").final.gear.worm.tau) * 38.0 / 5.0)
    np.testing.assert_allclose(torques, [1.0 / efficiency, 2.0 - 1.0 / efficiency], rtol=1e-9)
    assert (torques[1] < 0.0) == (efficiency < 0.5)  # self-locking: it has to be driven down


class GearedInertias(Component):
    """A constant torque on two inertias behind one another through a gear and a planetary stage."""

    drive: ConstantTorque
    motor: Inertia
    gear: IdealGear
    gearbox: PlanetaryGearbox
    load: Inertia
    housing: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.motor.a),
            connect(self.motor.b, self.gear.a),
            connect(self.gear.b, self.gearbox.sun),
            connect(self.gearbox.ring, self.housing.flange),
            connect(self.gearbox.carrier, self.load.a),
        )


@pytest.mark.thorough
def test_inertias_are_referred_through_gears_by_the_square_of_the_ratio() -> None:
    rig = GearedInertias(
        drive=ConstantTorque(torque=0.7),
        motor=Inertia(J=0.1),
        gear=IdealGear(ratio=-2.0),
        gearbox=PlanetaryGearbox(ratio=5.0, J_sun=0.3, J_carrier=0.4),
        load=Inertia(J=0.6),
    )
    end = simulate(rig, 2.0, save="end").final
    J = 0.1 + (0.3 + (0.4 + 0.6) / 5.0**2) / 2.0**2
    np.testing.assert_allclose(end.motor.w, 0.7 / J * 2.0, rtol=1e-9)
    np.testing.assert_allclose(end.load.w, -0.7 / J * 2.0 / 10.0, rtol=1e-9)


class Oscillator(Component):
    """A mass on a spring and a damper to the wall."""

    mass: translational.Mass
    spring: translational.SpringDamper
    wall: translational.Fixed = translational.Fixed()

    def connections(self) -> Connections:
        return (connect(self.wall.flange, self.spring.a), connect(self.spring.b, self.mass.a))


@pytest.mark.thorough
def test_damped_oscillator() -> None:
    m, c, d, s0, v0 = 1.5, 40.0, 1.2, 0.3, 0.8
    rig = Oscillator(
        mass=translational.Mass(m=m, v=v0),
        spring=translational.SpringDamper(c=c, d=d, s_rel0=s0),
    )
    times = np.linspace(0.0, 3.0, 13)
    sol = simulate(rig, 3.0, save=jnp.asarray(times), rtol=1e-9)
    decay, omega = d / (2 * m), np.sqrt(c / m - (d / (2 * m)) ** 2)
    amplitude = (v0 - decay * s0) / omega
    swing = np.exp(-decay * times) * (-s0 * np.cos(omega * times) + amplitude * np.sin(omega * times))
    np.testing.assert_allclose(sol["mass.a.s"], s0 + swing, atol=1e-8)


class TorsionalOscillator(Component):
    """Two free inertias on a torsion spring."""

    left: Inertia
    spring: rotational.Spring
    right: Inertia

    def connections(self) -> Connections:
        return (connect(self.left.b, self.spring.a), connect(self.spring.b, self.right.a))


@pytest.mark.thorough
def test_torsional_frequency() -> None:
    """omega^2 = c (1/J1 + 1/J2); started with a relative speed, that speed vanishes after a quarter period."""
    rig = TorsionalOscillator(left=Inertia(J=0.2, w=1.0), spring=rotational.Spring(c=30.0), right=Inertia(J=0.5))
    sol = simulate(rig, 1.0, until=lambda s: s.left.w - s.right.w, rtol=1e-10, save="end")
    assert float(sol.t1) == pytest.approx(0.5 * np.pi / np.sqrt(30.0 * (1 / 0.2 + 1 / 0.5)), rel=1e-8)


@settings(deadline=None, max_examples=50)
@given(st.floats(-300.0, 300.0))
def test_stribeck_curve(w: float) -> None:
    friction = SmoothStribeckFriction(Tc=0.05, Ts=0.18, ws=30.0, w0=0.1, w=w)
    expected = (0.05 + 0.13 * np.exp(-((w / 30.0) ** 2))) * np.tanh(w / 0.1)
    np.testing.assert_allclose(friction.torque(), expected, rtol=1e-12, atol=1e-300)
    assert float(jnp.asarray(friction.torque())) * w >= 0.0


class Preloaded(Component):
    """A tabulated spring moved to a position by a force."""

    spring: translational.TabulatedSpring
    friction: translational.ViscousFriction
    drive: translational.ConstantForce

    def connections(self) -> Connections:
        return (connect(self.drive.flange, self.friction.flange, self.spring.flange),)


@pytest.mark.thorough
def test_tabulated_spring_balances_a_force_at_its_sample() -> None:
    rig = Preloaded(
        spring=translational.TabulatedSpring(
            positions=jnp.array([0.0, 2e-3, 6e-3, 12e-3]), forces=jnp.array([50.0, 300.0, 500.0, 520.0])
        ),
        friction=translational.ViscousFriction(C=100.0),
        drive=translational.ConstantForce(force=500.0),
    )
    end = simulate(rig, 1.0, save="end").final
    assert float(end.spring.flange.s) == pytest.approx(6e-3, rel=1e-6)
