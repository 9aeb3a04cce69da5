"""A valve that a coil holds shut, as a mechanism: coil, plunger with spring and stops, poppet."""

import jax.numpy as jnp

from acausal import Component, Connections, Param, Requirements, Scalar, connect, require

from .._checks import ends_at
from .._data_sheet import DataSheet
from ..electrical import Pin, Solenoid
from ..translational import Damper, Fixed, HardStop, Mass, Spring
from ._interfaces import FluidPort
from ._poppet import PoppetValve


class HoldingValve(Component):
    """A normally open valve: current pulls a plunger against spring and pressure at a, until the poppet seats.

    With the travel s of the plunger, open at 0, seated at `stroke`: m d2s/dt2 = F(i, s) - preload - spring s - damping
    ds/dt - seat dp + flow force, with the coil's F = i^2/2 L0/g0/(1 + g/g0)^2 at the gap g = residual_gap + stroke - s
    (`electrical.Solenoid`), and q = C_d width (stroke - s) sqrt(2 dp/rho) (`PoppetValve`). Without pressure it closes
    from i^2 = 2 g0/L0 (1 + (residual_gap + stroke)/g0)^2 preload on, and shut it holds down to
    i^2 = 2 g0/L0 (1 + residual_gap/g0)^2 (preload + spring stroke + seat dp). `HoldingValve.rated` makes one from
    ratings. Not modelled: saturation, eddy currents, leakage of the seat, warming of the coil.
    """

    coil: Solenoid
    plunger: Mass
    spring: Spring
    damper: Damper
    stop: HardStop
    poppet: PoppetValve
    wall: Fixed
    data_sheet: DataSheet | None = None  # that it was made from; see `catalogues`
    p: Pin = Pin()
    n: Pin = Pin()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        R: Param[Scalar, "ohm"],  # resistance of the coil
        L0: Param[Scalar, "H"],  # its inductance without a gap
        g0: Param[Scalar, "m"],  # gap at which the inductance has halved
        m: Param[Scalar, "kg"],  # mass of plunger and poppet
        spring: Param[Scalar, "N/m"],  # stiffness of the spring
        preload: Param[Scalar, "N"],  # its force on the open valve
        stroke: Param[Scalar, "m"],  # travel between the stops
        seat: Param[Scalar, "m2"],  # area on which the pressure acts, small where the poppet is balanced
        width: Param[Scalar, "m"],  # area of the opening per travel
        density: Param[Scalar, "kg/m3"],  # of the liquid
        damping: Param[Scalar, "N.s/m"] = 0.0,  # of the plunger
        residual_gap: Param[Scalar, "m"] = 0.0,  # gap of the coil with the valve shut
        restitution: Param[Scalar, "1"] = 0.0,  # speed after over speed before an impact, at most 1
        discharge_coefficient: Param[Scalar, "1"] = 0.65,  # of the opening
        data_sheet: DataSheet | None = None,
    ) -> None:
        self.coil = Solenoid(R=R, L0=L0, g0=g0, closed=stroke + residual_gap)
        self.plunger = Mass(m=m)
        self.spring = Spring(c=spring, s_rel0=-preload / spring)
        self.damper = Damper(d=damping)
        self.stop = HardStop(s_min=0.0, s_max=stroke, restitution=restitution)
        self.poppet = PoppetValve(
            seat=seat, width=width, stroke=stroke, seated=stroke, sense=-1.0, density=density,
            discharge_coefficient=discharge_coefficient,
        )  # fmt: skip
        self.wall, self.data_sheet = Fixed(), data_sheet
        self.p, self.n, self.a, self.b = Pin(), Pin(), FluidPort(), FluidPort()

    def requirements(self) -> Requirements:
        return (
            *ends_at(self.stop, self.poppet.stroke, "poppet.stroke"),
            require(self.poppet.seated == self.poppet.stroke, "poppet.seated must equal poppet.stroke"),
            require(self.poppet.sense == -1.0, "poppet.sense must be -1"),
            require(self.coil.closed >= self.poppet.stroke, "coil.closed must be at least poppet.stroke"),
        )

    @classmethod
    def rated(
        cls,
        *,
        voltage: Scalar,
        current: Scalar,
        pressure: Scalar,
        flow: Scalar,
        drop: Scalar,
        g0: Scalar,
        m: Scalar,
        spring: Scalar,
        preload: Scalar,
        stroke: Scalar,
        seat: Scalar,
        density: Scalar,
        reserve: Scalar = 1.2,
        residual_gap: Scalar = 0.0,
        discharge_coefficient: Scalar = 0.65,
        damping: Scalar = 0.0,
        restitution: Scalar = 0.0,
        data_sheet: DataSheet | None = None,
    ) -> "HoldingValve":
        """From what a data sheet states: voltage in V and current in A of the coil, pressure in Pa that it holds shut,

        flow in m3/s through the open valve at a drop in Pa. R = voltage/current; L0 is such that the coil pulls with
        `reserve` times what it has to at that pressure and current; width from flow and drop. The rest, in SI units,
        no sheet states: measure it, or take a guess and look what depends on it.
        """
        pull = reserve * (preload + spring * stroke + seat * pressure)
        root = discharge_coefficient * jnp.sqrt(2.0 * drop / density)
        return cls(
            R=voltage / current, L0=2.0 * pull * g0 * (1.0 + residual_gap / g0) ** 2 / current**2, g0=g0, m=m,
            spring=spring, preload=preload, stroke=stroke, seat=seat, width=flow / (stroke * root), density=density,
            damping=damping, residual_gap=residual_gap, restitution=restitution,
            discharge_coefficient=discharge_coefficient, data_sheet=data_sheet,
        )  # fmt: skip

    def connections(self) -> Connections:
        moved = (self.plunger.a, self.stop.flange, self.poppet.rod, self.spring.b, self.damper.b)
        return (
            connect(self.p, self.coil.p),
            connect(self.n, self.coil.n),
            connect(self.a, self.poppet.a),
            connect(self.b, self.poppet.b),
            connect(self.wall.flange, self.spring.a, self.damper.a),
            connect(self.coil.rod, *moved),
        )
