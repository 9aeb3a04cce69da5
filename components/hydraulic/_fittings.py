"""Tee, filter and end cushion."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Requirements,
    Scalar,
    connect,
    eq,
    nonnegative,
    nonzero,
    positive,
    require,
)

from .._limit import limited
from ..translational import Flange
from ._interfaces import FluidPort
from ._liquids import AnyLiquid
from ._restrictions import Hole, LocalLoss
from ._valves import CheckValve, LaminarResistance


class TJunction(Component):
    """A junction of three pipes: a `LocalLoss` from each port to the middle, where the flows add up to zero.

    `TJunction.standard(diameter=..., liquid=...)` is a tee with through pipes at a and b and a branch at c.
    """

    loss_a: LocalLoss
    loss_b: LocalLoss
    loss_c: LocalLoss
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()
    c: FluidPort = FluidPort()

    @classmethod
    def standard(cls, *, diameter: Scalar, liquid: AnyLiquid, friction: Scalar = 0.02) -> "TJunction":
        """A tee: zeta is 20 f straight through, 60 f through the branch; f is the turbulent factor (Crane TP-410)."""
        area = 0.25 * jnp.pi * diameter**2
        straight, turned = (
            LocalLoss(area=area, liquid=liquid, zeta_ab=zeta, zeta_ba=zeta)
            for zeta in (10.0 * friction, 50.0 * friction)
        )
        return cls(loss_a=straight, loss_b=straight, loss_c=turned)

    def connections(self) -> Connections:
        return (
            connect(self.a, self.loss_a.a),
            connect(self.b, self.loss_b.a),
            connect(self.c, self.loss_c.a),
            connect(self.loss_a.b, self.loss_b.b, self.loss_c.b),
        )


class Filter(Component):
    """A laminar filter element from a to b with a bypass valve in parallel.

    As the element clogs, its resistance grows; the bypass opens at the cracking pressure of its check valve.
    """

    element: LaminarResistance
    bypass: CheckValve
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return (connect(self.a, self.element.a, self.bypass.a), connect(self.b, self.element.b, self.bypass.b))


class EndCushion(Hole):
    """An orifice from the chamber at a to the line at b that the piston closes as it approaches its end.

    A = gap + (area - gap) x, with x = sense (s - end)/length limited to 0 .. 1, and the flow of a `LiquidOrifice`. Put
    a `CheckValve` from b to a in parallel, so that the piston can start. The orifice exerts no force on the rod.
    """

    gap: Param[Scalar, "m2", nonnegative]  # residual area, at the end
    length: Param[Scalar, "m", positive]  # travel over which it closes
    end: Param[Scalar, "m"] = 0.0  # position of the end
    sense: Param[Scalar, "1", nonzero] = 1.0  # 1 if s increases away from the end, -1 if it decreases
    rod: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.gap <= self.area, "gap must be at most area"),
            require(jnp.abs(self.sense) == 1.0, "sense must be 1 or -1"),
        )

    def equations(self, d: Self) -> Equations:
        area = self.gap + (self.area - self.gap) * limited(self._way(), 0.0, 1.0)
        return super().equations(d) | dict(no_force=eq(self.rod.f), law=eq(self.q, self._flow(area)))

    def _way(self) -> Scalar:
        return self.sense * (self.rod.s - self.end) / self.length
