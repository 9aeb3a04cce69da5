"""Tanks with a level."""

from typing import Self

from acausal import Component, Energy, Equations, Events, Param, Scalar, Var, eq, nonnegative, positive, prefer, refuse

from ._interfaces import FluidPort


class LevelTank(Component):
    """A tank with a level h: area dh/dt = q, and p = pressure + density g h at its port in the bottom.

    Open to the atmosphere, or under a constant gas pressure on top. A run ends with an error when the tank is sucked
    dry, h < -height/1000, or runs over, h > height. `Tank` is the ideal one. Not modelled: swirl, foam, the speed of
    the surface.
    """

    area: Param[Scalar, "m2", positive]  # of the surface
    density: Param[Scalar, "kg/m3", positive]
    height: Param[Scalar, "m", positive]  # of the walls
    pressure: Param[Scalar, "Pa", nonnegative] = 0.0  # of the gas on top, above the atmosphere
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity
    h: Var[Scalar, "m", prefer] = 0.0  # level above the port
    port: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            level=eq(self.area * d.h, self.port.q),
            pressure=eq(self.port.p, self.pressure + self.density * self.g * self.h),
        )

    def events(self) -> Events:
        return dict(
            dry=refuse(self.h < -1e-3 * self.height, "the tank is empty: its pump sucks air"),
            over=refuse(self.h > self.height, "the tank runs over"),
        )

    def energy(self) -> Energy:
        lifted = self.area * self.h * (self.pressure + 0.5 * self.density * self.g * self.h)
        return Energy(stored=lifted)
