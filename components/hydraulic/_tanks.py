"""Tank with a liquid level, and pressurised tank."""

from typing import Self

from acausal import (
    Component,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    refuse,
    require,
)

from ._interfaces import FluidPort, MixedPart


class LevelTank(MixedPart):
    """A tank with a level h: area dh/dt = q, and p = pressure + density g h at the port in its bottom.

    Open to the atmosphere, or under a constant gas pressure. A run ends with an error if the tank runs dry,
    h < -height/1000, or overflows, h > height. `Tank` is the ideal counterpart. Not modelled: swirl, foam, the speed
    of the surface.
    """

    area: Param[Scalar, "m2", positive]  # area of the surface
    density: Param[Scalar, "kg/m3", positive]
    height: Param[Scalar, "m", positive]  # height of the walls
    pressure: Param[Scalar, "Pa", nonnegative] = 0.0  # gas pressure above the liquid, relative to the atmosphere
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity
    h: Var[Scalar, "m", prefer] = 0.0  # level above the port
    port: FluidPort = FluidPort()

    def start_requirements(self) -> Requirements:
        is_inside = (self.h >= -1e-3 * self.height) & (self.h <= self.height)
        return (*super().start_requirements(), require(is_inside, "h must start between 0 and height"))

    def equations(self, d: Self) -> Equations:
        return dict(
            level=eq(self.area * d.h, self.port.q),
            pressure=eq(self.port.p, self.pressure + self.density * self.g * self.h),
        )

    def events(self) -> Events:
        return dict(
            dry=refuse(self.h < -1e-3 * self.height, "the tank is empty: the pump draws air"),
            over=refuse(self.h > self.height, "the tank overflows"),
        )

    def held_liquid(self) -> Scalar:
        # The port is a thousandth of the height above the bottom, so that an empty tank has a temperature.
        return self.area * (self.h + 1e-3 * self.height)

    def energy(self) -> Energy:
        lifted = self.area * self.h * (self.pressure + 0.5 * self.density * self.g * self.h)
        return Energy(stored=lifted)


class BootstrapTank(Component):
    """A tank pressurised by the circuit: a small pilot piston and the large piston on the liquid share a rod.

    With the travel s: area ds/dt = q, pilot_area ds/dt = -q_pilot, and
    p area = p_pilot pilot_area + preload + rate s + damping ds/dt. A run ends with an error if the tank is empty,
    s < -stroke/1000, or full, s > stroke. Not modelled: the mass of the pistons, leakage.
    """

    area: Param[Scalar, "m2", positive]  # area of the large piston, on the stored liquid
    pilot_area: Param[Scalar, "m2", nonnegative]  # area of the pilot piston, under the circuit pressure
    stroke: Param[Scalar, "m", positive]  # travel from empty to full
    preload: Param[Scalar, "N", nonnegative] = 0.0  # spring force when empty
    rate: Param[Scalar, "N/m", nonnegative] = 0.0  # stiffness of the spring
    damping: Param[Scalar, "N.s/m", nonnegative] = 0.0  # damping of the piston seals
    s: Var[Scalar, "m", prefer] = 0.0  # travel of the pistons; area s is the stored volume
    v: Var[Scalar, "m/s"] = 0.0  # speed of the pistons
    port: FluidPort = FluidPort()
    pilot: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        push = self.pilot.p * self.pilot_area + self.preload + self.rate * self.s + self.damping * self.v
        return dict(
            speed=eq(self.v, d.s),
            content=eq(self.area * self.v, self.port.q),
            driven=eq(self.pilot.q, -self.pilot_area * self.v),
            balance=eq(self.area * self.port.p, push),
        )

    def events(self) -> Events:
        return dict(
            dry=refuse(self.s < -1e-3 * self.stroke, "the tank is empty: the pump draws air"),
            over=refuse(self.s > self.stroke, "the tank is full: add a relief valve, or increase the stroke"),
        )

    def energy(self) -> Energy:
        stored = self.s * (self.preload + 0.5 * self.rate * self.s)
        return Energy(stored=stored, dissipated=self.damping * self.v**2)
