"""Cylinder and pump with what limits and holds them: rigid end stops, dry friction."""

from acausal import Component, Connections, Scalar, connect

from ..rotational import Flange, StribeckBearing
from ..translational import Flange as Rod
from ..translational import HardStop
from ._cylinders import SlaveCylinder
from ._interfaces import FluidPort
from ._pump import Pump


class StoppedCylinder(Component):
    """A `SlaveCylinder` whose piston moves between rigid ends, 0 <= s <= stroke: see `translational.HardStop`.

    `StoppedCylinder(bore=..., stroke=..., restitution=...)`. A mass has to be connected to the rod. At an end the flow
    stops at once, so that the line on its port has to be compressible.
    """

    cylinder: SlaveCylinder
    stop: HardStop
    rod: Rod = Rod()
    port: FluidPort = FluidPort()

    def __init__(self, *, bore: Scalar, stroke: Scalar, restitution: Scalar = 0.0) -> None:
        self.cylinder = SlaveCylinder(bore=bore)
        self.stop = HardStop(s_min=0.0, s_max=stroke, restitution=restitution)
        self.rod, self.port = Rod(), FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.port, self.cylinder.port),
            connect(self.rod, self.cylinder.rod, self.stop.flange),
        )


class StickingPump(Component):
    """A `Pump` with dry friction: it turns only where the torque exceeds Ts, and slides with Tc (`StribeckBearing`).

    `StickingPump(displacement=..., J=..., Tc=..., Ts=..., ws=..., friction=..., leakage=...)`. With laminar leakage the
    delivery falls to zero at a low speed, leakage dp / displacement.
    """

    pump: Pump
    bearing: StribeckBearing
    shaft: Flange = Flange()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        displacement: Scalar,
        J: Scalar,
        Tc: Scalar,
        Ts: Scalar,
        ws: Scalar,
        friction: Scalar = 0.0,
        leakage: Scalar = 0.0,
    ) -> None:
        self.pump = Pump(displacement=displacement, J=J, leakage=leakage)
        self.bearing = StribeckBearing(Tc=Tc, Ts=Ts, ws=ws, C=friction)
        self.shaft, self.a, self.b = Flange(), FluidPort(), FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.shaft, self.pump.shaft, self.bearing.flange),
            connect(self.a, self.pump.a),
            connect(self.b, self.pump.b),
        )
