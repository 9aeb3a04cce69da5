"""Translational port and base classes."""

from typing import Any, ClassVar, Self

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq


class Flange(Port):
    """The end of a rod; f ds/dt is the power into the component."""

    reference: ClassVar[str] = "a Fixed"

    s: Var[Scalar, "m"] = 0.0  # position
    f: Flow[Scalar, "N"] = 0.0  # force, positive into the component

    def power(self, d: Self) -> Scalar:
        return d.s * self.f


class Compliant(Component, partial=True):
    """A massless element between two flanges: s_rel = s_b - s_a, f = f_b = -f_a."""

    s_rel: Var[Scalar, "m"] = 0.0  # relative position
    f: Var[Scalar, "N"] = 0.0  # tension: positive when the element pulls its flanges together
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(
            relative_position=eq(self.s_rel, self.b.s - self.a.s),
            force_a=eq(self.a.f, -self.f),
            force_b=eq(self.b.f, self.f),
        )


class ToGround(Component, partial=True):
    """An element between one flange and the ground: v = ds/dt."""

    v: Var[Scalar, "m/s"] = 0.0  # speed
    flange: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(speed=eq(self.v, d.flange.s))
