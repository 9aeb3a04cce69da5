"""Double-acting cylinders with compressible chambers, leakage, friction and end stops."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    positive,
    prefer,
    refuse,
    require,
)

from .._checks import ends_at
from ..translational import Flange, HardStop, Mass, StribeckFriction
from ._interfaces import FluidPort
from ._two_chambers import TwoChambers


class DoubleActingCylinder(TwoChambers):
    """Two liquid chambers separated by a piston: liquid into a pushes the rod out (s increases), into b pulls it in.

    With A_a = pi/4 (bore^2 - rod_a^2), A_b likewise, V_a = dead_a + A_a s and V_b = dead_b + A_b (stroke - s), and
    the leakage Q = leakage (p_a - p_b) past the piston (Merritt, `Hydraulic Control Systems`, ch. 6):

    - d(V_a r(p_a))/dt = q_a - Q and d(V_b r(p_b))/dt = q_b + Q, with r as in `Chamber`;
    - the rod pushes with p_a A_a - p_b A_b; the stiffness depends on the position.

    A differential cylinder with one rod, a synchronous cylinder with two. No mass, friction or stops: see
    `HydraulicCylinder`. A run ends with an error when half of the dead volume of a chamber is used up.
    """

    bore: Param[Scalar, "m", positive]  # diameter of the piston
    stroke: Param[Scalar, "m", positive]
    rod: Param[Scalar, "m", nonnegative] = 0.0  # diameter of the rod in chamber b
    rod_a: Param[Scalar, "m", nonnegative] = 0.0  # diameter of the rod in chamber a, if it passes through
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed of the rod
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.rod < self.bore, "rod must be thinner than bore"),
            require(self.rod_a < self.bore, "rod_a must be thinner than bore"),
        )

    @property
    def area_a(self) -> Scalar:
        """A_a in m2."""
        return 0.25 * jnp.pi * (self.bore**2 - self.rod_a**2)

    @property
    def area_b(self) -> Scalar:
        """A_b in m2."""
        return 0.25 * jnp.pi * (self.bore**2 - self.rod**2)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.v, d.flange.s),
            force=eq(self.flange.f, self.p_b * self.area_b - self.p_a * self.area_a),
        )

    def events(self) -> Events:
        remedy = "start with 0 <= s <= stroke, and add stops to the rod, as in HydraulicCylinder"
        return dict(lost=refuse(self._lost(), f"the piston is beyond its ends: {remedy}"))

    def _swept(self) -> tuple[Scalar, Scalar]:
        return self.area_a * self.flange.s, self.area_b * (self.stroke - self.flange.s)

    def _growth(self) -> tuple[Scalar, Scalar]:
        return self.area_a * self.v, -self.area_b * self.v


class HydraulicCylinder(Component):
    """A `DoubleActingCylinder` with piston mass, sticking seals and rigid stops, 0 <= s <= stroke.

    `HydraulicCylinder(chambers=DoubleActingCylinder(...), m=..., Fc=..., Fs=..., vs=...)`, with the friction of
    `translational.StribeckFriction` and the stops of `translational.HardStop`.
    """

    chambers: DoubleActingCylinder
    piston: Mass
    seal: StribeckFriction
    stop: HardStop
    flange: Flange = Flange()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        chambers: DoubleActingCylinder,
        m: Param[Scalar, "kg"],  # mass of piston and rod
        Fc: Param[Scalar, "N"],  # Coulomb (sliding) force of the seals
        Fs: Param[Scalar, "N"],  # break-away force, at least Fc
        vs: Param[Scalar, "m/s"],  # Stribeck speed, at which the excess over Fc has dropped to 1/e
        C: Param[Scalar, "N.s/m"] = 0.0,  # viscous friction coefficient
        restitution: Param[Scalar, "1"] = 0.0,  # ratio of the speeds after and before an impact, at most 1
    ) -> None:
        self.chambers = chambers
        self.piston = Mass(m=m)
        self.seal = StribeckFriction(Fc=Fc, Fs=Fs, vs=vs, C=C)
        self.stop = HardStop(s_min=0.0, s_max=chambers.stroke, restitution=restitution)
        self.flange, self.a, self.b = Flange(), FluidPort(), FluidPort()

    def requirements(self) -> Requirements:
        return ends_at(self.stop, self.chambers.stroke, "chambers.stroke")

    def connections(self) -> Connections:
        return (
            connect(self.a, self.chambers.a),
            connect(self.b, self.chambers.b),
            connect(self.flange, self.chambers.flange, self.piston.a, self.seal.flange, self.stop.flange),
        )


class TandemCylinder(Component):
    """Two `DoubleActingCylinder`s in line on one rod: forces add, p_a1 A_a1 - p_b1 A_b1 + p_a2 A_a2 - p_b2 A_b2.

    The rod of `rear` passes through chamber a of `front`, so `front.rod_a` equals `rear.rod`, and the strokes are
    equal. In parallel, a1 with a2 and b1 with b2, they form a stronger cylinder of the same diameter; in two separate
    circuits, one holds if the other fails. Add mass, friction and stops at the flange.
    """

    rear: DoubleActingCylinder
    front: DoubleActingCylinder
    flange: Flange = Flange()
    a1: FluidPort = FluidPort()  # rear cylinder
    b1: FluidPort = FluidPort()
    a2: FluidPort = FluidPort()  # front cylinder
    b2: FluidPort = FluidPort()

    def requirements(self) -> Requirements:
        rear, front = self.rear, self.front
        thickness = jnp.abs(rear.rod - front.rod_a) <= 1e-9 * rear.bore
        return (
            require(thickness, "front.rod_a must equal rear.rod, which passes through this chamber"),
            require(jnp.abs(rear.stroke - front.stroke) <= 1e-9 * rear.stroke, "front.stroke must equal rear.stroke"),
        )

    def connections(self) -> Connections:
        return (
            connect(self.flange, self.rear.flange, self.front.flange),
            connect(self.a1, self.rear.a),
            connect(self.b1, self.rear.b),
            connect(self.a2, self.front.a),
            connect(self.b2, self.front.b),
        )
