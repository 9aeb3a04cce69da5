"""Electromechanical conversion and the direct-current motor."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Connections, Equations, Param, Scalar, Var, connect, eq

from .._data_sheet import DataSheet
from ..rotational import Flange, Inertia, ViscousFriction
from ..translational import Flange as Rod
from ._interfaces import Pin
from ._passive import Inductor, Resistor


class EMF(Component):
    """Ideal electromechanical conversion, v = k w and tau = -k i; lossless (MSL `RotationalEMF`).

    The stator is the ground. With `support=Flange()` it is a flange: w is then relative to it, and it takes the
    reaction torque.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"flange": "shaft"}

    k: Param[Scalar, "N.m/A"]  # torque constant, equal to the back-emf constant in V.s/rad
    w: Var[Scalar, "rad/s"] = 0.0  # speed of the shaft
    p: Pin = Pin()
    n: Pin = Pin()
    shaft: Flange = Flange()
    support: Flange | None = None

    def equations(self, d: Self) -> Equations:
        speed, reaction = d.shaft.phi, {}
        if self.support is not None and d.support is not None:
            speed = d.shaft.phi - d.support.phi
            reaction = dict(reaction=eq(self.support.tau, -self.shaft.tau))
        return reaction | dict(
            kirchhoff=eq(self.p.i + self.n.i),
            speed=eq(self.w, speed),
            back_emf=eq(self.p.v - self.n.v, self.k * self.w),
            torque=eq(self.shaft.tau, -self.k * self.p.i),
        )


class TranslationalEMF(Component):
    """Ideal lossless electromechanical conversion, v_p - v_n = k v and f = -k i: a voice coil or linear motor.

    As MSL `TranslationalEMF`. The stator is the ground: its reaction force is not modelled.
    """

    k: Param[Scalar, "N/A"]  # force constant, equal to the back-emf constant in V.s/m
    v: Var[Scalar, "m/s"] = 0.0  # speed of the rod
    p: Pin = Pin()
    n: Pin = Pin()
    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            kirchhoff=eq(self.p.i + self.n.i),
            speed=eq(self.v, d.rod.s),
            back_emf=eq(self.p.v - self.n.v, self.k * self.v),
            force=eq(self.rod.f, -self.k * self.p.i),
        )


class DCMotor(Component):
    """Permanent-magnet direct-current motor: v = R i + L di/dt + k w and J dw/dt = k i - C w + tau.

    `DCMotor(R=..., k=..., J=..., L=..., friction=...)`, where C is the friction. Not modelled: iron losses, brush
    voltage drop, commutation, saturation, heating of the winding.
    """

    resistor: Resistor
    inductor: Inductor | None
    emf: EMF
    rotor: Inertia
    bearing: ViscousFriction | None
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`
    p: Pin = Pin()
    n: Pin = Pin()
    shaft: Flange = Flange()

    def __init__(
        self,
        *,
        R: Param[Scalar, "ohm"],  # winding resistance
        k: Param[Scalar, "N.m/A"],  # torque constant
        J: Param[Scalar, "kg.m2"],  # moment of inertia of the rotor
        L: Param[Scalar, "H"] | None = None,  # inductance; none by default
        friction: Param[Scalar, "N.m.s/rad"] | None = None,  # viscous friction coefficient C
        data_sheet: DataSheet | None = None,
    ) -> None:
        self.resistor = Resistor(R=R)
        self.inductor = None if L is None else Inductor(L=L)
        self.emf, self.data_sheet = EMF(k=k), data_sheet
        self.rotor = Inertia(J=J)
        self.bearing = None if friction is None else ViscousFriction(C=friction)
        self.p, self.n, self.shaft = Pin(), Pin(), Flange()

    def connections(self) -> Connections:
        shaft = (self.rotor.a,) if self.bearing is None else (self.rotor.a, self.bearing.flange)
        if self.inductor is None:
            winding = (connect(self.resistor.n, self.emf.p),)
        else:
            winding = (connect(self.resistor.n, self.inductor.p), connect(self.inductor.n, self.emf.p))
        return (
            connect(self.p, self.resistor.p),
            *winding,
            connect(self.emf.n, self.n),
            connect(self.emf.shaft, *shaft),
            connect(self.rotor.b, self.shaft),
        )
