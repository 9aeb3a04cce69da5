"""Metering edges moved by a rod, with the flow forces on it."""

import abc
from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    nonzero,
    positive,
    require,
)

from .._limit import limited, positive_part
from ..translational import Flange
from ._interfaces import FluidPort
from ._valves import Resistance, turbulent_flow


class RodValve(Resistance, partial=True):
    """A restriction that a rod opens or closes over a travel from 0 to 1."""

    sense: Param[Scalar, "1", nonzero] = 1.0  # 1 or -1, direction of the travel along s
    rod: Flange = Flange()

    def requirements(self) -> Requirements:
        return (require(jnp.abs(self.sense) == 1.0, "sense must be 1 or -1"),)

    @abc.abstractmethod
    def _travel(self) -> Scalar:
        """Position of the rod as a fraction of the travel."""


class MeteringEdge(RodValve):
    """A metering edge of a spool, with its flow force.

    With the opening y = sense s - lap, limited to 0 .. stroke: q = C_d (width y + leak) sqrt(2 dp/rho). In either
    direction of flow, the jet closes the spool with the force 2 C_d C_v cos(jet) width y |dp| (von Mises; Merritt,
    `Hydraulic Control Systems`, ch. 5). Both are smoothed at dp = 0 as in `Orifice`. The work of the flow force comes
    from the momentum of the liquid and counts as supplied. Not modelled: transient flow force.
    """

    width: Param[Scalar, "m", positive]  # opening area per travel, pi d for a full ring
    stroke: Param[Scalar, "m", positive]  # full opening
    density: Param[Scalar, "kg/m3", positive]  # rho
    lap: Param[Scalar, "m"] = 0.0  # travel before it opens; negative if it is open in the middle position
    leak: Param[Scalar, "m2", nonnegative] = 0.0  # area that stays open
    jet: Param[Scalar, "rad"] = 1.2043  # angle between jet and axis, 69 degrees
    discharge_coefficient: Param[Scalar, "1", positive] = 0.61  # C_d
    velocity_coefficient: Param[Scalar, "1", nonnegative] = 0.98  # C_v; 0 without flow force
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # p_t
    v: Var[Scalar, "m/s"] = 0.0  # speed of the rod

    def equations(self, d: Self) -> Equations:
        area = self.width * self._opening() + self.leak
        conductance = self.discharge_coefficient * area * jnp.sqrt(2.0 / self.density)
        return super().equations(d) | dict(
            speed=eq(self.v, d.rod.s),
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
            force=eq(self.rod.f, self.sense * self._flow_force()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss(), supplied=-self.sense * self._flow_force() * self.v)

    def _travel(self) -> Scalar:
        return (self.sense * self.rod.s - self.lap) / self.stroke

    def _opening(self) -> Scalar:
        return self.stroke * limited(self._travel(), 0.0, 1.0)

    def _flow_force(self) -> Scalar:
        coefficient = 2.0 * self.discharge_coefficient * self.velocity_coefficient * jnp.cos(self.jet)
        pressure = self.dp**2 / jnp.sqrt(self.dp**2 + self.transition_pressure**2)
        return coefficient * self.width * self._opening() * pressure


class FourWaySpool(Component):
    """The spool of a 4/3 valve, moved by its rod: s > 0 connects p to a and b to t, s < 0 p to b and a to t.

    `FourWaySpool.of(MeteringEdge(...))` has four identical edges. Add a `Mass`, centring springs and a `Solenoid` on
    the rod for a valve whose actuator works against the flow forces. `FourWayValve` is moved by a signal instead.
    """

    pa: MeteringEdge
    pb: MeteringEdge
    at: MeteringEdge
    bt: MeteringEdge
    rod: Flange = Flange()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    @classmethod
    def of(cls, edge: MeteringEdge) -> Self:
        """A spool with four edges equal to the given one, which opens p to a as s increases."""
        values: dict[str, Any] = {name: getattr(edge, name) for name in _ALIKE}
        opened, closed = MeteringEdge(**values, sense=edge.sense), MeteringEdge(**values, sense=-edge.sense)
        return cls(pa=opened, pb=closed, at=closed, bt=opened)

    def connections(self) -> Connections:
        edges = (self.pa, self.pb, self.at, self.bt)
        return (
            connect(self.rod, *(edge.rod for edge in edges)),
            connect(self.p, self.pa.a, self.pb.a),
            connect(self.t, self.at.b, self.bt.b),
            connect(self.a, self.pa.b, self.at.a),
            connect(self.b, self.pb.b, self.bt.a),
        )


_ALIKE = (
    "width", "stroke", "density", "lap", "leak", "jet", "discharge_coefficient", "velocity_coefficient",
    "transition_pressure",
)  # fmt: skip


class DecelerationValve(RodValve):
    """A cam-operated valve, whose roller is pressed in by the load, to decelerate a cylinder near its end.

    With the depth y = sense s - start, at least 0: q = K (1 - y/length + leakage) sqrt(dp), K = rated_flow/
    sqrt(rated_drop), closed from y = length; the roller pushes back with rate y. Square root as in `Orifice`.
    """

    rated_flow: Param[Scalar, "m3/s", positive]  # flow of the fully open valve
    rated_drop: Param[Scalar, "Pa", positive]  # pressure drop at rated_flow
    start: Param[Scalar, "m"]  # position, times sense, at which the cam meets the roller
    length: Param[Scalar, "m", positive]  # travel over which the valve closes
    rate: Param[Scalar, "N/m", nonnegative] = 0.0  # stiffness of the roller spring
    leakage: Param[Scalar, "1", nonnegative] = 0.0  # opening of the closed valve
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # width of the transition at zero pressure drop

    def equations(self, d: Self) -> Equations:
        share = 1.0 - limited(self._travel(), 0.0, 1.0) + self.leakage
        conductance = share * self.rated_flow / jnp.sqrt(self.rated_drop)
        return super().equations(d) | dict(
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure)),
            force=eq(self.rod.f, self.sense * self.rate * self._depth()),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.rate * self._depth() ** 2, dissipated=self._loss())

    def _travel(self) -> Scalar:
        return (self.sense * self.rod.s - self.start) / self.length

    def _depth(self) -> Scalar:
        return self.length * positive_part(self._travel())
