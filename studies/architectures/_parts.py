"""What the architectures share: the clutch with its slave cylinder, motors, pumps, valves, and their sizes.

Motors with their friction, displacement, bores, line and spring are those of the set of parameters that all studies
share, `studies.actuators.parameter_set`. `ASSUMED` lists the others, each with the reason for its value.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from acausal import Connections, connect
from components.blocks import LimPI, SecondOrder
from components.electrical import DCMotor
from components.hydraulic import LinearLiquid, ReliefValve, ThreeWayValve, VariableOrifice, Volume, WilsonLosses
from components.translational import PositionSensor

from ..actuators import DISPLACEMENT, SUPPLY, ClutchActuator, ehs_maxon, ema_maxon
from ._duty import Demand, demand

HIGHEST = 4.0e6  # Pa, to which relief valves and pressure compensators are set

ASSUMED: Mapping[str, str] = MappingProxyType(
    {
        "supply pressure 40 bar": "33.4 bar for the 800 N of a worn clutch and 5 bar for the valve, rounded up",
        "slip coefficient 5e-9 of all pumps": "a usual one (Wilson); the thesis has none",
        "no friction of pumps beside that of the drive": "the friction of the set was fitted to openings, so that the "
        "pump's is in it; a free-running pump turns more easily, as the no-load set shows",
        "liquid of 1050 kg/m3, 1.5 GPa, 8 mm2/s": "DOT 4 at 40 C; the modulus is that behind the line's stiffness",
        "valves of 4 l/min at 5 bar an edge, 50 Hz, damping 0.8": "twice the flow of the fastest opening; usual for a "
        "small proportional valve",
        "variable pumps swing back with 20 ms, relief valves 10 bar above them": "usual for small ones; without the "
        "valve the pump would press 200 bar against the shut spool, until its motor stalls",
        "servo pumps swing within 40 ms from no to full displacement, 150 rad/s, damping 0.8": "assumed without a "
        "source, about as fast as the variable pumps above",
        "variable pump with purge valve": "the thesis names the pump, variable and on demand, and where the valve is; "
        "assumed: a motor that turns all the time, a servo pump, the drain as purge valve, and no check valve",
        "chamber of 5 cm3 between pump and valve": "drilled passages of a block",
        "drain of 4 mm": "the bore of the thesis' holding valve, as in the study of the hold",
        "ball screw of 20 mm with a lead of 20 mm, friction 0.01, 120 g.cm2": "a usual one, 100 mm of steel; with the "
        "clutch open, this lead asks of the motor about what the cam does",
        "controllers": "PI, as fast as the slowest valve lets it; while it opens all are at their limits",
    }
)


class Positioned(ClutchActuator, partial=True):
    """A clutch actuator with a gauge of the slave's position and what is demanded of it."""

    demand: Demand
    gauge: PositionSensor

    def connections(self) -> Connections:
        return *super().connections(), connect(self.gauge.flange, self.slave.rod)


class Controlled(Positioned, partial=True):
    """One controller compares both all the time."""

    controller: LimPI

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.controller.u_s),
            connect(self.gauge.y, self.controller.u_m),
        )


def load() -> dict[str, Any]:
    """Line, slave cylinder, clutch and what is demanded of them."""
    base = ehs_maxon()
    return dict(
        line=base.line, slave=base.slave, piston=base.piston, seal=base.seal, clutch=base.clutch,
        demand=demand(), gauge=PositionSensor(),
    )  # fmt: skip


def motor_control() -> LimPI:
    """Sets the voltage of a motor, through a lossless full bridge."""
    return LimPI(k=2e4, Ti=0.2, y_min=-SUPPLY, y_max=SUPPLY)


def valve_control() -> LimPI:
    """Sets the signal of a valve or of a swash plate."""
    return LimPI(k=200.0, Ti=0.2, y_min=-1.0, y_max=1.0)


def drain_control() -> LimPI:
    """Opens a valve to the tank where the clutch is too far open."""
    return LimPI(k=-60.0, Ti=0.05, y_min=0.0, y_max=1.0)


def spool() -> SecondOrder:
    """The spool of a small proportional valve."""
    return SecondOrder(w=314.0, D=0.8)


def drain() -> VariableOrifice:
    """A valve from the line to the tank; it passes all that the pump gives at a few tenths of a bar."""
    return VariableOrifice(area=0.25 * math.pi * 4e-3**2, liquid=liquid())


def relief(pressure: float = HIGHEST) -> ReliefValve:
    """Bounds a pressure in Pa."""
    return ReliefValve(conductance=2e-10, cracking_pressure=pressure)


def chamber() -> Volume:
    """What lies between a pump and a valve."""
    return Volume(volume=5e-6, bulk_modulus=1.5e9)


def three_way_valve() -> ThreeWayValve:
    """The edges of a small proportional valve."""
    return ThreeWayValve(rated_flow=4e-3 / 60.0, rated_drop=5e5)


def re40() -> DCMotor:
    """The motor of all pumps."""
    return ehs_maxon().motor


def re50() -> DCMotor:
    """The motor of the electromechanical actuators."""
    return ema_maxon().motor


def liquid() -> LinearLiquid:
    """Brake fluid DOT 4 at 40 C, without air."""
    return LinearLiquid(density=1050.0, bulk_modulus=1.5e9, viscosity=8e-6)


def pump_data() -> dict[str, Any]:
    """Displacement, liquid, losses and inertia of all pumps."""
    return dict(displacement=DISPLACEMENT, liquid=liquid(), losses=WilsonLosses(C_s=5e-9), J=2e-6)
