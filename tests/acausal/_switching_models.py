"""Models whose events cannot be carried out, or never end."""

from typing import Self

from acausal import Component, Connections, Discrete, Equations, Events, Param, Scalar, Var, connect, eq, when
from components.rotational import IdealGear, Inertia


class Relay(Component):
    """A switch without hysteresis, that holds x at zero by infinitely many events."""

    x: Var[Scalar, ""] = 1.0
    u: Discrete[Scalar, ""] = -1.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, self.u))

    def events(self) -> Events:
        return dict(up=when(self.x < 0.0, u=1.0), down=when(self.x > 0.0, u=-1.0))


class Rebound(Component):
    """A ball that rebounds from the floor with a share e of its speed."""

    e: Param[Scalar, "1"]
    floor: Param[Scalar, "m"] = 0.0
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -9.81, check_units=False))

    def events(self) -> Events:
        return dict(impact=when(self.h < self.floor, v=-self.e * self.v))


class Undoing(Component):
    """Two events that make each other's condition true, from the start on."""

    x: Var[Scalar, ""] = 0.2
    u: Discrete[Scalar, ""] = -1.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, self.u))

    def events(self) -> Events:
        low = self.x < 0.5
        return dict(up=when(low & (self.u < 0.0), u=1.0), down=when(low & (self.u > 0.0), u=-1.0))


class ForcedGear(Component):
    """A gear of ratio 2 whose sides are both given a speed of 1 rad/s, when the first has turned by 1 rad."""

    first: Inertia
    gear: IdealGear
    second: Inertia

    def connections(self) -> Connections:
        return connect(self.first.b, self.gear.a), connect(self.gear.b, self.second.a)

    def events(self) -> Events:
        return dict(force=when(self.first.a.phi > 1.0, **{"first.w": 1.0, "second.w": 1.0}))


def forced_gear() -> ForcedGear:
    return ForcedGear(first=Inertia(J=1.0, w=4.0), gear=IdealGear(ratio=2.0), second=Inertia(J=1.0))
