"""Electromechanical actuators: a motor moves the master cylinder through a transmission."""

import math
from typing import Any

from acausal import Connections, connect
from components.blocks import DeadZone, Gain, Limiter, Sum
from components.electrical import SignalVoltage
from components.hydraulic import MasterCylinder
from components.rotational import (
    Cam,
    CrankSlider,
    Disc,
    Fixed,
    Helix,
    Inertia,
    LossyGear,
    LossyGearR2T,
    PlanetaryGearbox,
)

from ..actuators import SUPPLY, ema_maxon, sila
from ._parts import Controlled, Positioned, load, motor_control, re50

TOLERANCE = 0.1e-3  # m, position error below which the motor of a self-locking drive is off


class MasterDriven(Controlled, partial=True):
    """The controller sets the voltage of a motor with a planetary gearbox."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    gearbox: PlanetaryGearbox
    master: MasterCylinder
    housing: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.controller.y, self.supply.u),
            connect(self.motor.shaft, self.gearbox.sun),
            connect(self.gearbox.ring, self.housing.flange),
            connect(self.master.port, self.line.a),
        )


class EccentricActuator(MasterDriven):
    """Motor, planetary gearbox, eccentric disc, master cylinder."""

    cam: Cam

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.gearbox.carrier, self.cam.shaft),
            connect(self.cam.follower, self.master.rod),
        )


class CrankActuator(MasterDriven):
    """Motor, planetary gearbox, crank that starts at its inner dead centre, master cylinder."""

    turned: Disc
    crank: CrankSlider

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.gearbox.carrier, self.turned.a),
            connect(self.turned.b, self.crank.shaft),
            connect(self.crank.slider, self.master.rod),
        )


class BallScrewActuator(MasterDriven):
    """Motor, planetary gearbox, ball screw, master cylinder."""

    spindle: Inertia
    screw: LossyGearR2T

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.gearbox.carrier, self.spindle.a),
            connect(self.spindle.b, self.screw.shaft),
            connect(self.screw.rod, self.master.rod),
        )


class SelfLocking(Positioned, partial=True):
    """A self-locking drive: its motor is off while the position error is within a tolerance.

    With integral action, it would break loose repeatedly.
    """

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    error: Sum
    near: DeadZone
    gain: Gain
    limiter: Limiter
    master: MasterCylinder

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.error.u1),
            connect(self.gauge.y, self.error.u2),
            connect(self.error.y, self.near.u),
            connect(self.near.y, self.gain.u),
            connect(self.gain.y, self.limiter.u),
            connect(self.limiter.y, self.supply.u),
            connect(self.master.port, self.line.a),
        )


class WormActuator(SelfLocking):
    """Motor, worm, linear cam, master cylinder: the present actuator."""

    worm: LossyGear
    cam: Cam

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.worm.a),
            connect(self.worm.b, self.cam.shaft),
            connect(self.cam.follower, self.master.rod),
        )


class ScrewActuator(SelfLocking):
    """Motor, screw, master cylinder."""

    screw: LossyGearR2T

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.screw.shaft),
            connect(self.screw.rod, self.master.rod),
        )


def eccentric() -> EccentricActuator:
    """The thesis' actuator with RE50 motor and 4.3:1 gearbox."""
    return EccentricActuator(cam=ema_maxon().cam, **_geared())


def crank() -> CrankActuator:
    """Like `eccentric`, with a crank of the same radius and a connecting rod of 40 mm."""
    slider = CrankSlider(crank=5.5e-3, rod_length=40e-3)
    return CrankActuator(turned=Disc(delta_phi=math.pi), crank=slider, **_geared())


def ball_screw() -> BallScrewActuator:
    """Like `eccentric`, with a ball screw whose lead gives about the same motor torque with the clutch open."""
    thread = LossyGearR2T.screw(diameter=20e-3, lead=20e-3, mu=0.01)
    return BallScrewActuator(spindle=Inertia(J=1.2e-5), screw=thread, **_geared())


def worm() -> WormActuator:
    """The present actuator with FISE motor; its worm has just enough friction to be self-locking: efficiency 49 %."""
    base = sila()
    helix = Helix.of_worm(starts=1.0, quotient=10.0, mu=0.095)
    return WormActuator(motor=base.motor, worm=helix.gear(38.0), cam=base.cam, master=base.master, **_locking())


def screw() -> ScrewActuator:
    """RE50 motor and a trapezoidal screw Tr 14x3, steel on bronze."""
    thread = LossyGearR2T.screw(diameter=12.5e-3, lead=3e-3, mu=0.1, flank=math.radians(15.0))
    return ScrewActuator(motor=re50(), screw=thread, master=ema_maxon().master, **_locking())


def _geared() -> dict[str, Any]:
    base = ema_maxon()
    return dict(
        supply=SignalVoltage(), motor=re50(), controller=motor_control(), gearbox=base.gearbox, master=base.master,
        **load(),
    )  # fmt: skip


def _locking() -> dict[str, Any]:
    return dict(
        supply=SignalVoltage(), error=Sum(k2=-1.0), near=DeadZone(u_min=-TOLERANCE, u_max=TOLERANCE), gain=Gain(k=2e4),
        limiter=Limiter(u_min=-SUPPLY, u_max=SUPPLY), **load(),
    )  # fmt: skip
