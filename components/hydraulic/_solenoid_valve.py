"""Valve opened by a coil, modelled as a mechanism: coil, armature with spring and stops, orifice."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Requirements,
    Scalar,
    connect,
    eq,
    nonnegative,
    positive,
    require,
)

from .._checks import ends_at
from .._limit import limited
from ..electrical import Pin, Solenoid
from ..translational import Damper, Fixed, Flange, HardStop, Mass, Spring
from ._interfaces import FluidPort
from ._valves import Resistance, turbulent_flow


class LiftValve(Resistance):
    """An orifice with an area proportional to the lift: q = C_d area s / stroke sqrt(2 dp / rho), 0 <= s <= stroke.

    Square root as in `Orifice`. Flow forces are not modelled: the orifice exerts no force on the rod.
    """

    area: Param[Scalar, "m2", nonnegative]  # area at full lift
    stroke: Param[Scalar, "m", positive]  # full lift
    density: Param[Scalar, "kg/m3", positive]  # rho
    discharge_coefficient: Param[Scalar, "1", positive] = 0.61  # C_d
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # p_t
    rod: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        share = limited(self.rod.s / self.stroke, 0.0, 1.0)
        conductance = self.discharge_coefficient * self.area * share * jnp.sqrt(2.0 / self.density)
        return super().equations(d) | dict(
            no_force=eq(self.rod.f),
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
        )


class SolenoidValve(Component):
    """A normally closed on/off valve: a coil lifts a spring-loaded armature from one rigid stop to the other.

    `SolenoidValve(R=..., L0=..., g0=..., m=..., spring=..., preload=..., stroke=..., area=..., density=...)`. The coil
    gap at full lift is `residual_gap`. It consists of `Solenoid`, `Mass`, `Spring`, `Damper`, `HardStop`, whose impacts
    are events, and `LiftValve`. Coil current and armature motion determine the delays of opening and closing. Not
    modelled: flow forces, pressure forces on the armature, saturation.
    """

    coil: Solenoid
    armature: Mass
    spring: Spring
    damper: Damper
    stop: HardStop
    valve: LiftValve
    wall: Fixed
    p: Pin = Pin()
    n: Pin = Pin()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        R: Param[Scalar, "ohm"],  # resistance of the coil
        L0: Param[Scalar, "H"],  # inductance of the coil at zero gap
        g0: Param[Scalar, "m"],  # gap at which the inductance is halved
        m: Param[Scalar, "kg"],  # mass of the armature
        spring: Param[Scalar, "N/m"],  # stiffness of the spring
        preload: Param[Scalar, "N"],  # spring force with the valve closed
        stroke: Param[Scalar, "m"],  # lift between the stops
        area: Param[Scalar, "m2"],  # area of the open valve
        density: Param[Scalar, "kg/m3"],  # density of the liquid
        damping: Param[Scalar, "N.s/m"] = 0.0,  # damping of the armature
        residual_gap: Param[Scalar, "m"] = 0.0,  # gap of the coil at full lift
        restitution: Param[Scalar, "1"] = 0.0,  # ratio of the speeds after and before an impact, at most 1
        discharge_coefficient: Param[Scalar, "1"] = 0.61,  # discharge coefficient of the valve
    ) -> None:
        self.coil = Solenoid(R=R, L0=L0, g0=g0, closed=stroke + residual_gap)
        self.armature = Mass(m=m)
        self.spring = Spring(c=spring, s_rel0=-preload / spring)
        self.damper = Damper(d=damping)
        self.stop = HardStop(s_min=0.0, s_max=stroke, restitution=restitution)
        self.valve = LiftValve(area=area, stroke=stroke, density=density, discharge_coefficient=discharge_coefficient)
        self.wall = Fixed()
        self.p, self.n, self.a, self.b = Pin(), Pin(), FluidPort(), FluidPort()

    def requirements(self) -> Requirements:
        return (
            *ends_at(self.stop, self.valve.stroke, "valve.stroke"),
            require(self.coil.closed >= self.valve.stroke, "coil.closed must be at least valve.stroke"),
        )

    def connections(self) -> Connections:
        return (
            connect(self.p, self.coil.p),
            connect(self.n, self.coil.n),
            connect(self.a, self.valve.a),
            connect(self.b, self.valve.b),
            connect(self.wall.flange, self.spring.a, self.damper.a),
            connect(self.coil.rod, self.armature.a, self.stop.flange, self.valve.rod, self.spring.b, self.damper.b),
        )
