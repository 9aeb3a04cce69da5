"""Hydraulic port and the base class of elements with two ports."""

from typing import Any, ClassVar, Self

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq


class FluidPort(Port):
    """A connection for liquid; p q is the power into the component."""

    reference: ClassVar[str] = "a Tank"
    storage: ClassVar[str] = "a Chamber or a Volume"

    p: Var[Scalar, "Pa"] = 0.0  # pressure above the atmosphere
    q: Flow[Scalar, "m3/s"] = 0.0  # volume flow rate, positive into the component

    def power(self, d: Self) -> Scalar:
        del d
        return self.p * self.q


class TwoPort(Component, partial=True):
    """An element with one flow path, from a to b, without storage: dp = p_a - p_b, q = q_a = -q_b."""

    dp: Var[Scalar, "Pa"] = 0.0  # pressure drop from a to b
    q: Var[Scalar, "m3/s"] = 0.0  # flow from a to b
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def equations(self, d: Any) -> Equations:
        return dict(
            drop=eq(self.dp, self.a.p - self.b.p),
            flow=eq(self.q, self.a.q),
            continuity=eq(self.a.q + self.b.q),
        )
