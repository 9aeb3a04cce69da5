"""Two cylinders on one rod."""

import jax.numpy as jnp

from acausal import Component, Connections, Requirements, connect, require

from ..translational import Flange
from ._interfaces import FluidPort
from ._working_cylinder import DoubleActingCylinder


class TandemCylinder(Component):
    """Two `DoubleActingCylinder`s in line on one rod: forces add, p_a1 A_a1 - p_b1 A_b1 + p_a2 A_a2 - p_b2 A_b2.

    The rod of `rear` passes through chamber a of `front`, so `front.rod_a` equals `rear.rod`, and the strokes are
    equal. In parallel, a1 with a2 and b1 with b2, they form a stronger cylinder of the same diameter; in two separate
    circuits, one holds if the other fails. Add mass, friction and stops at the flange.
    """

    rear: DoubleActingCylinder
    front: DoubleActingCylinder
    flange: Flange = Flange()
    a1: FluidPort = FluidPort()  # rear cylinder
    b1: FluidPort = FluidPort()
    a2: FluidPort = FluidPort()  # front cylinder
    b2: FluidPort = FluidPort()

    def requirements(self) -> Requirements:
        rear, front = self.rear, self.front
        thickness = jnp.abs(rear.rod - front.rod_a) <= 1e-9 * rear.bore
        return (
            require(thickness, "front.rod_a must equal rear.rod, which passes through this chamber"),
            require(jnp.abs(rear.stroke - front.stroke) <= 1e-9 * rear.stroke, "front.stroke must equal rear.stroke"),
        )

    def connections(self) -> Connections:
        return (
            connect(self.flange, self.rear.flange, self.front.flange),
            connect(self.a1, self.rear.a),
            connect(self.b1, self.rear.b),
            connect(self.a2, self.front.a),
            connect(self.b2, self.front.b),
        )
