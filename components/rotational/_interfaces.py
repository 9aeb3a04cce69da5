"""Rotational port and base classes."""

from typing import Any, ClassVar, Self

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq


class Flange(Port):
    """The end of a shaft; tau dphi/dt is the power into the component."""

    reference: ClassVar[str] = "a Fixed"

    phi: Var[Scalar, "rad"] = 0.0  # angle
    tau: Flow[Scalar, "N.m"] = 0.0  # torque, positive into the component

    def power(self, d: Self) -> Scalar:
        return d.phi * self.tau


class Compliant(Component, partial=True):
    """A massless element between two flanges: phi_rel = phi_b - phi_a, tau = tau_b = -tau_a."""

    phi_rel: Var[Scalar, "rad"] = 0.0  # relative angle
    tau: Var[Scalar, "N.m"] = 0.0  # torque at b, positive if it turns b back towards a
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(
            relative_angle=eq(self.phi_rel, self.b.phi - self.a.phi),
            torque_a=eq(self.a.tau, -self.tau),
            torque_b=eq(self.b.tau, self.tau),
        )


class ToGround(Component, partial=True):
    """An element between one flange and the ground: w = dphi/dt."""

    w: Var[Scalar, "rad/s"] = 0.0  # speed
    flange: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(speed=eq(self.w, d.flange.phi))
