"""Chambers with a moving wall: single-acting cylinder and rotary vane actuator."""

from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Events, Param, Scalar, Var, eq, positive, prefer, refuse

from ..rotational import Flange as ShaftFlange
from ..translational import Flange
from . import _content as content
from ._interfaces import FluidPort, MixedPart
from ._liquids import AnyLiquid
from ._two_chambers import TwoChambers


class SingleActingCylinder(MixedPart):
    """A liquid chamber behind a piston: liquid pressed in pushes the rod out, s increases.

    With A = pi/4 bore^2 and V = dead + A s: d(V r(p))/dt = q, with r as in `Chamber`, and the rod pushes with A p; the
    other side is open to the atmosphere. `SlaveCylinder` is the incompressible counterpart. Add return spring, mass,
    friction and stops at the flange. A run ends with an error when half of the dead volume is used up.
    """

    if_singular: ClassVar[str] = content.EMPTY

    bore: Param[Scalar, "m", positive]  # diameter of the piston
    liquid: AnyLiquid
    dead: Param[Scalar, "m3", positive]  # dead volume at s = 0, lines included
    p: Var[Scalar, "Pa", prefer] = 0.0  # pressure
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed of the rod
    flange: Flange = Flange()
    port: FluidPort = FluidPort()

    @property
    def area(self) -> Scalar:
        """A in m2."""
        return 0.25 * jnp.pi * self.bore**2

    def equations(self, d: Self) -> Equations:
        swept = self.area * self.liquid.relative_density(self.p) * self.v
        return dict(
            pressure=eq(self.p, self.port.p),
            speed=eq(self.v, d.flange.s),
            content=eq(content.capacity(self.liquid, self._volume(), self.p, 0.0) * d.p, self.port.q - swept),
            force=eq(self.flange.f, -self.p * self.area),
        )

    def events(self) -> Events:
        return dict(lost=refuse(self._volume() < 0.5 * self.dead, "the piston is beyond its end: add a stop"))

    def held_liquid(self) -> Scalar:
        return self._volume() * self.liquid.relative_density(self.p)

    def energy(self) -> Energy:
        return self.liquid.account(self.p, self._volume(), self.port.q, self.area * self.v)

    def _volume(self) -> Scalar:
        return self.dead + self.area * self.flange.s


class RotaryVaneActuator(TwoChambers):
    """A vane between two liquid chambers: liquid into a turns the shaft forward (phi increases), into b backward.

    With the displacement D per angle, V_a = dead_a + D phi and V_b = dead_b + D (angle - phi), chambers and leakage as
    in `DoubleActingCylinder`; the torque on the shaft is D (p_a - p_b). For one vane D = (R^2 - r^2) width/2, for two
    vanes twice that. Add inertia, friction and stops at the flange. A run ends with an error when half of the dead
    volume of a chamber is used up.
    """

    displacement: Param[Scalar, "m3/rad", positive]  # D
    angle: Param[Scalar, "rad", positive]  # angle from end to end
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    flange: ShaftFlange = ShaftFlange()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.w, d.flange.phi),
            torque=eq(self.flange.tau, self.displacement * (self.p_b - self.p_a)),
        )

    def events(self) -> Events:
        return dict(lost=refuse(self._lost(), "the vane is beyond its ends: add stops to the shaft"))

    def _swept(self) -> tuple[Scalar, Scalar]:
        return self.displacement * self.flange.phi, self.displacement * (self.angle - self.flange.phi)

    def _growth(self) -> tuple[Scalar, Scalar]:
        return self.displacement * self.w, -self.displacement * self.w
