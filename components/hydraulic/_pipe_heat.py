"""Heat in the liquid of a pipe: a temperature at each node."""

from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Equations, Flow, Param, Port, Scalar, Var, Vector, eq, nonnegative, positive, shape

from ..thermal import HeatPort


class WallPort(Port):
    """The surface inside a pipe, with a temperature at each node; connect it to a `PipeWall`."""

    reference: ClassVar[str] = "a PipeWall"

    nodes: int  # number of nodes
    T: Var[Vector, "K", positive, shape("nodes")] = 293.15  # temperatures of the liquid
    Q_flow: Flow[Vector, "W", shape("nodes")] = 0.0  # heat flow rates, positive into the liquid

    def power(self, d: Self) -> Scalar:
        del d
        return jnp.sum(self.Q_flow)


class PipeWall(Component):
    """Heat flow from the liquid in a pipe to its surroundings, Q_flow = G/(n + 1) (T_i - T) at each of n + 1 nodes.

    `PipeWall.around(pipe, U=10.0)` fits a pipe. The surroundings have one temperature. No energy is lost. Not modelled:
    storage of heat in the wall.
    """

    G: Param[Scalar, "W/K", nonnegative]  # thermal conductance of the whole pipe
    inside: WallPort
    outside: HeatPort = HeatPort()

    @classmethod
    def around(cls, pipe: Any, *, U: Scalar) -> "PipeWall":
        """The wall of a pipe with U in W/(m2.K), referred to its inner surface: about 10 in still air."""
        surface = jnp.pi * pipe.diameter * pipe.length
        return cls(G=U * surface, inside=WallPort(nodes=pipe.n + 1))

    def equations(self, d: Self) -> Equations:
        conductance = self.G / self.inside.nodes
        return dict(
            newton=eq(self.inside.Q_flow, conductance * (self.inside.T - self.outside.T)),
            balance=eq(self.outside.Q_flow + jnp.sum(self.inside.Q_flow)),
        )
