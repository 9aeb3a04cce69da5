"""Impacts between two bodies against the laws of momentum and of restitution."""

import jax
import numpy as np
import pytest

from acausal import Component, Connections, ParameterError, Scalar, connect, simulate
from components.rotational import IdealGear, IdealGearR2T, Inertia
from components.translational import ConstantForce, Lever, Mass, RigidContact


class Balls(Component):
    """Two bodies on a line; b is in front of a."""

    a: Mass
    b: Mass
    contact: RigidContact

    def connections(self) -> Connections:
        return connect(self.a.b, self.contact.a), connect(self.contact.b, self.b.a)


class Rack(Component):
    """A mass strikes a rack that drives a gear pair: J_1 on the pinion, J_2 behind the gear."""

    striker: Mass
    contact: RigidContact
    rack: IdealGearR2T
    pinion: Inertia
    gear: IdealGear
    load: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.striker.b, self.contact.a),
            connect(self.contact.b, self.rack.rod),
            connect(self.rack.shaft, self.pinion.a),
            connect(self.pinion.b, self.gear.a),
            connect(self.gear.b, self.load.a),
        )


class Seesaw(Component):
    """A mass strikes a lever with a mass at its other end."""

    striker: Mass
    contact: RigidContact
    lever: Lever
    load: Mass

    def connections(self) -> Connections:
        return (
            connect(self.striker.b, self.contact.a),
            connect(self.contact.b, self.lever.a),
            connect(self.lever.b, self.load.a),
        )


def after(m_a: float, v_a: float, m_b: float, v_b: float, e: float) -> tuple[float, float]:
    """Speeds after a central impact."""
    impulse = (1.0 + e) * (v_a - v_b) / (1.0 / m_a + 1.0 / m_b)
    return v_a - impulse / m_a, v_b + impulse / m_b


@pytest.mark.parametrize("e", [0.0, 0.6, 1.0])
def test_two_bodies(e: float) -> None:
    """Momentum and restitution; the energy lost is half the reduced mass times (1 - e^2) v^2."""
    balls = Balls(a=Mass(m=2.0, s=0.0, v=3.0), b=Mass(m=5.0, s=1.0, v=1.0), contact=RigidContact(restitution=e))
    run = simulate(balls, 1.0, save="end", energy=True)
    np.testing.assert_allclose(
        np.asarray((float(run.final.a.v), float(run.final.b.v))), after(2.0, 3.0, 5.0, 1.0, e), rtol=1e-9
    )
    assert abs(run.energy.imbalance) < 1e-9
    np.testing.assert_allclose(run.events.times[0], 0.5, rtol=1e-9)


def test_an_impulse_through_a_gear_pair() -> None:
    """An impulse at the rack changes the pinion's speed by r P / (J_1 + J_2 / i^2), and the load's by 1/i of that."""
    m, r, i, J_1, J_2, e = 2.0, 0.05, -3.0, 0.01, 0.4, 0.7
    rack = Rack(
        striker=Mass(m=m, s=-0.1, v=2.0),
        contact=RigidContact(restitution=e),
        rack=IdealGearR2T(ratio=1.0 / r),
        pinion=Inertia(J=J_1, phi=0.0),
        gear=IdealGear(ratio=i),
        load=Inertia(J=J_2),
    )
    end = simulate(rack, 0.1, save="end").final
    striker, struck = after(m, 2.0, (J_1 + J_2 / i**2) / r**2, 0.0, e)
    impulse = m * (2.0 - striker)
    np.testing.assert_allclose(end.striker.v, striker, rtol=1e-9)
    np.testing.assert_allclose(end.pinion.w, r * impulse / (J_1 + J_2 / i**2), rtol=1e-9)
    np.testing.assert_allclose(end.pinion.w, struck / r, rtol=1e-9)
    np.testing.assert_allclose(end.load.w, end.pinion.w / i, rtol=1e-9)


def test_an_impulse_through_a_lever() -> None:
    lever = Lever(arm_a=0.2, arm_b=0.5)
    seesaw = Seesaw(
        striker=Mass(m=1.5, s=-0.1, v=2.0), contact=RigidContact(restitution=0.5), lever=lever, load=Mass(m=0.8, s=0.0)
    )
    end = simulate(seesaw, 0.1, save="end").final
    striker, struck = after(1.5, 2.0, 0.8 * (0.5 / 0.2) ** 2, 0.0, 0.5)
    np.testing.assert_allclose(
        np.asarray((float(end.striker.v), float(end.load.v))), [striker, -2.5 * struck], rtol=1e-9
    )


class Pushed(Component):
    """A force pushes one body against another, or pulls it away."""

    balls: Balls
    force: ConstantForce

    def connections(self) -> Connections:
        return (connect(self.force.flange, self.balls.a.a),)


def test_bodies_in_contact_move_together() -> None:
    """The force accelerates both, and the contact carries its share."""
    balls = Balls(a=Mass(m=2.0, s=0.0, v=1.0), b=Mass(m=5.0, s=0.5), contact=RigidContact(restitution=0.3))
    end = simulate(Pushed(balls=balls, force=ConstantForce(force=7.0)), 4.0, save="end").final
    assert end.balls.contact.mode == -1.0
    np.testing.assert_allclose(end.balls.contact.f, -5.0, rtol=1e-6)
    np.testing.assert_allclose(2.0 * end.balls.a.v + 5.0 * end.balls.b.v, 2.0 + 7.0 * 4.0, rtol=1e-6)
    np.testing.assert_allclose(end.balls.a.s, end.balls.b.s, atol=1e-6)


def test_bodies_in_contact_are_pulled_apart() -> None:
    """The body in front stays, and the other one follows the force alone."""
    balls = Balls(a=Mass(m=2.0, s=0.0, v=0.0), b=Mass(m=5.0, s=0.0, v=0.0), contact=RigidContact(mode=-1.0))
    end = simulate(Pushed(balls=balls, force=ConstantForce(force=-7.0)), 4.0, save="end").final
    assert end.balls.contact.mode == 0.0
    np.testing.assert_allclose(np.asarray((float(end.balls.a.v), float(end.balls.b.v))), [-14.0, 0.0], atol=1e-6)


def test_gradient_of_an_impact() -> None:
    """Of the struck body's speed with respect to its mass, from the closed form."""

    def struck(m: Scalar) -> Scalar:
        balls = Balls(a=Mass(m=2.0, s=0.0, v=3.0), b=Mass(m=m, s=1.0), contact=RigidContact(restitution=0.5))
        return simulate(balls, 1.0, save="end").final.b.v

    np.testing.assert_allclose(jax.grad(struck)(5.0), -1.5 * 3.0 * 2.0 / 7.0**2, rtol=1e-7)


def test_a_restitution_above_one_is_refused() -> None:
    with pytest.raises(ParameterError, match="restitution must be at most 1"):
        RigidContact(restitution=1.2)
