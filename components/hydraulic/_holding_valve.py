"""Valve held shut by a coil, modelled as a mechanism: coil, plunger with spring and stops, poppet."""

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

    With the plunger travel s, open at 0 and seated at `stroke`: m d2s/dt2 = F(i, s) - preload - spring s - damping
    ds/dt - seat dp + flow force, with the coil force F = i^2/2 L0/g0/(1 + g/g0)^2 at the gap g = residual_gap + stroke
    - s (`electrical.Solenoid`), and q = C_d width (stroke - s) sqrt(2 dp/rho) (`PoppetValve`). Without pressure the
    valve closes above i^2 = 2 g0/L0 (1 + (residual_gap + stroke)/g0)^2 preload. It holds shut down to
    i^2 = 2 g0/L0 (1 + residual_gap/g0)^2 (preload + spring stroke + seat dp). `HoldingValve.rated` builds one from
    ratings. Not modelled: saturation, eddy currents, leakage of the seat, heating of the coil.
    """

    coil: Solenoid
    plunger: Mass
    spring: Spring
    damper: Damper
    stop: HardStop
    poppet: PoppetValve
    wall: Fixed
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`
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
        m: Param[Scalar, "kg"],  # mass of plunger and poppet
        spring: Param[Scalar, "N/m"],  # stiffness of the spring
        preload: Param[Scalar, "N"],  # spring force with the valve open
        stroke: Param[Scalar, "m"],  # travel between the stops
        seat: Param[Scalar, "m2"],  # area on which the pressure acts, small for a balanced poppet
        width: Param[Scalar, "m"],  # opening area per travel
        density: Param[Scalar, "kg/m3"],  # density of the liquid
        damping: Param[Scalar, "N.s/m"] = 0.0,  # damping of the plunger
        residual_gap: Param[Scalar, "m"] = 0.0,  # gap of the coil with the valve shut
        restitution: Param[Scalar, "1"] = 0.0,  # ratio of the speeds after and before an impact, at most 1
        discharge_coefficient: Param[Scalar, "1"] = 0.65,  # discharge coefficient of the opening
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
        """A valve from data-sheet ratings, in SI units: `voltage` and `current` of the coil, the `pressure` that it
        holds shut, and the `flow` through the open valve at the pressure `drop`.

        R = voltage/current; L0 gives `reserve` times the required pull at this pressure and current; width follows from
        flow and drop. No data sheet states the other arguments: measure or estimate them, and check their influence.
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
