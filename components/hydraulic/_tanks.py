"""Tank with a liquid level, pressurised tank, and vessel with ports at heights."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Events,
    Param,
    ParameterError,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    magnitude,
    nonnegative,
    positive,
    prefer,
    refuse,
    require,
    shape,
)

from .._checks import numbers
from .._limit import positive_part
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


class Vessel(MixedPart):
    """A tank with a level h and ports at heights z above its bottom: area dh/dt = sum of q.

    `Vessel(area=..., density=..., height=..., heights=[0.0, 0.8, 0.9])` has three ports, `ports[0]` and so on, for
    several sources, for drains, and for an overflow. The pressure at a port is pressure + density g (h - z) below the
    surface. Above it, the pressure is that of the gas: liquid falls in freely, and nothing flows out. A run ends with
    an error if the tank runs dry, h < -height/1000, if it overflows, h > height, or if a port above the surface draws
    gas. Liquid enters at its port with the potential energy of its height, which counts as supplied. `LevelTank` has
    one port in its bottom. Not modelled: swirl, foam, the speed of the surface, layers of different temperature.
    """

    n: int  # number of ports
    area: Param[Scalar, "m2", positive]  # area of the surface
    density: Param[Scalar, "kg/m3", positive]
    height: Param[Scalar, "m", positive]  # height of the walls
    heights: Param[Vector, "m", nonnegative, shape("n")]  # z, heights of the ports
    pressure: Param[Scalar, "Pa", nonnegative]  # gas pressure above the liquid, relative to the atmosphere
    g: Param[Scalar, "m/s2", nonnegative]  # acceleration of gravity
    h: Var[Scalar, "m", prefer]  # level above the bottom
    ports: tuple[FluidPort, ...]

    def __init__(
        self,
        *,
        area: Scalar,
        density: Scalar,
        height: Scalar,
        heights: Param[Any, "m"],  # of the ports
        pressure: Scalar = 0.0,
        g: Scalar = 9.80665,
        h: Any = None,
        heat: Any = None,
    ) -> None:
        self.area, self.density, self.height, self.pressure, self.g = area, density, height, pressure, g
        self.heights = numbers(self, "heights", magnitude(heights, "m", "Vessel.heights"))
        if self.heights.ndim != 1 or not self.heights.size:
            raise ParameterError("Vessel.heights must be a list of one height for each port.")
        self.n = len(self.heights)
        self.h, self.heat, self.carrier = h, heat, None
        self.ports = tuple(FluidPort() for _ in range(self.n))

    def requirements(self) -> Requirements:
        return (require(jnp.max(self.heights) <= self.height, "heights must be at most height"),)

    def start_requirements(self) -> Requirements:
        is_inside = (self.h >= -1e-3 * self.height) & (self.h <= self.height)
        return (*super().start_requirements(), require(is_inside, "h must start between 0 and height"))

    def equations(self, d: Self) -> Equations:
        below = [positive_part(self.h - z) for z in self.heights]
        at_ports = {
            f"pressure_{i}": eq(port.p, self.pressure + self.density * self.g * depth)
            for i, (port, depth) in enumerate(zip(self.ports, below, strict=True))
        }
        return at_ports | dict(level=eq(self.area * d.h, sum(port.q for port in self.ports)))

    def events(self) -> Events:
        slack = 1e-3 * self.height
        gas: Events = {
            f"gas_{i}": refuse(
                (self.h < z - slack) & (port.q < -1e-6 * self.area),  # 1e-6 m/s
                f"ports[{i}] is above the surface and draws gas: lower it, or let a check valve close its line",
                check_units=False,
            )
            for i, (port, z) in enumerate(zip(self.ports, self.heights, strict=True))
        }
        return gas | dict(
            dry=refuse(self.h < -slack, "the tank is empty"),
            over=refuse(self.h > self.height, "the tank overflows: add a port for the overflow"),
        )

    def held_liquid(self) -> Scalar:
        # As in `LevelTank`, so that an empty tank has a temperature.
        return self.area * (self.h + 1e-3 * self.height)

    def energy(self) -> Energy:
        weight = self.density * self.g
        pairs = list(zip(self.ports, self.heights, strict=True))
        lifted = self.area * self.h * (self.pressure + 0.5 * weight * self.h)
        falling = sum(positive_part(z - self.h) * port.q for port, z in pairs)
        return Energy(
            stored=lifted, dissipated=weight * falling, supplied=weight * sum(z * port.q for port, z in pairs)
        )
