"""Cylinder with rigid end stops, and pump with dry friction."""

from acausal import Component, Connections, Param, Requirements, Scalar, connect, require

from ..rotational import Flange, StribeckFriction
from ..translational import Flange as Rod
from ..translational import HardStop
from ._cylinders import SlaveCylinder
from ._interfaces import FluidPort
from ._pump import Pump


class StoppedCylinder(Component):
    """A `SlaveCylinder` whose piston moves between rigid ends, 0 <= s <= stroke: see `translational.HardStop`.

    `StoppedCylinder(bore=..., stroke=..., restitution=...)`. Connect a mass to the rod. The flow stops instantly at an
    end, so the line at its port must be compressible.
    """

    cylinder: SlaveCylinder
    stop: HardStop
    rod: Rod = Rod()
    port: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        bore: Param[Scalar, "m"],  # diameter of the piston
        stroke: Param[Scalar, "m"],  # travel between the ends
        restitution: Param[Scalar, "1"] = 0.0,  # ratio of the speeds after and before an impact, at most 1
        volume: Param[Scalar, "m3"] = 0.0,  # liquid at s = 0, for liquids that carry heat
    ) -> None:
        self.cylinder = SlaveCylinder(bore=bore, volume=volume)
        self.stop = HardStop(s_min=0.0, s_max=stroke, restitution=restitution)
        self.rod, self.port = Rod(), FluidPort()

    def requirements(self) -> Requirements:
        return (require(self.stop.s_min == 0.0, "stop.s_min must be 0"),)

    def connections(self) -> Connections:
        return (
            connect(self.port, self.cylinder.port),
            connect(self.rod, self.cylinder.rod, self.stop.flange),
        )


class StickingPump(Component):
    """A `Pump` with dry friction: it starts to turn above the torque Ts and slides at Tc (`StribeckFriction`).

    `StickingPump(displacement=..., J=..., Tc=..., Ts=..., ws=..., friction=..., leakage=...)`. With laminar leakage,
    the delivery falls to zero at the low speed leakage dp / displacement.
    """

    pump: Pump
    bearing: StribeckFriction
    shaft: Flange = Flange()
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def __init__(
        self,
        *,
        displacement: Param[Scalar, "m3/rad"],  # volume per angle
        J: Param[Scalar, "kg.m2"],  # moment of inertia
        Tc: Param[Scalar, "N.m"],  # Coulomb (sliding) torque
        Ts: Param[Scalar, "N.m"],  # break-away torque, at least Tc
        ws: Param[Scalar, "rad/s"],  # Stribeck speed, at which the excess over Tc has dropped to 1/e
        friction: Param[Scalar, "N.m.s/rad"] = 0.0,  # viscous friction coefficient
        leakage: Param[Scalar, "m3/(s.Pa)"] = 0.0,  # leakage flow per pressure difference
    ) -> None:
        self.pump = Pump(displacement=displacement, J=J, leakage=leakage)
        self.bearing = StribeckFriction(Tc=Tc, Ts=Ts, ws=ws, C=friction)
        self.shaft, self.a, self.b = Flange(), FluidPort(), FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.shaft, self.pump.shaft, self.bearing.flange),
            connect(self.a, self.pump.a),
            connect(self.b, self.pump.b),
        )
