"""A component whose annotations are strings when its class is built."""

from __future__ import annotations

from typing import ClassVar, Self

from acausal import Component, Equations, Param, Scalar, Var, eq, positive


class Postponed(Component):
    label: ClassVar[str] = "shared by the class"

    k: Param[Scalar, "1/s", positive]
    n: int = 3
    x: Var[Scalar, "m"] = 1.0
    friend: Friend | None = None

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x))


class Friend(Component):
    """Not known yet where `Postponed` names it."""

    y: Var[Scalar, "m"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.y, -self.y))
