"""Valves with the dynamics of their spools."""

from acausal import Component, Connections, connect

from ..blocks import Input, SecondOrder
from ._interfaces import FluidPort
from ._spool_valves import FourWayValve


class ProportionalValve(Component):
    """A `FourWayValve` whose spool follows its signal u as a second-order lag; servo valves alike.

    `ProportionalValve(spool=SecondOrder(w=2 pi 50, D=0.8), valve=FourWayValve(...))`, with the corner frequency of the
    data sheet for small signals. Not modelled: the limit of the spool's speed, hysteresis of the solenoid.
    """

    spool: SecondOrder
    valve: FourWayValve
    u: Input = Input()
    p: FluidPort = FluidPort()
    t: FluidPort = FluidPort()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.u, self.spool.u),
            connect(self.spool.y, self.valve.u),
            connect(self.p, self.valve.p),
            connect(self.t, self.valve.t),
            connect(self.a, self.valve.a),
            connect(self.b, self.valve.b),
        )
