"""Common parts of the architectures: clutch with slave cylinder, motors, pumps and valves, with their sizes.

Motors with their friction, displacement, bores, line and spring are those of the set of parameters that all studies
share, `studies.actuators.parameter_set`. `ASSUMED` lists the other values, each with its reason.
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

HIGHEST = 4.0e6  # Pa, setting of relief valves and pressure compensators

ASSUMED: Mapping[str, str] = MappingProxyType(
    {
        "supply pressure 40 bar": "33.4 bar for the 800 N of a worn clutch and 5 bar for the valve, rounded up",
        "slip coefficient 5e-9 of all pumps": "a typical value (Wilson); the thesis has none",
        "no friction of pumps in addition to that of the drive": "the friction of the set was fitted to openings and "
        "includes that of the pump; a free-running pump turns more easily, as the no-load set shows",
        "liquid of 1050 kg/m3, 1.5 GPa, 8 mm2/s": "DOT 4 at 40 C; the modulus agrees with the stiffness of the line",
        "valves of 4 l/min at 5 bar per edge, 50 Hz, damping 0.8": "twice the flow of the fastest opening; typical of "
        "a small proportional valve",
        "variable pumps swing back with 20 ms, relief valves 10 bar above them": "typical of small ones; without the "
        "valve, the pump would build up 200 bar against the closed spool, until its motor stalls",
        "servo pumps swing within 40 ms from zero to full displacement, 150 rad/s, damping 0.8": "assumed without a "
        "source, about as fast as the variable pumps above",
        "variable pump with purge valve": "the thesis states that the pump is variable and on demand, and where the "
        "valve is; assumed: a continuously turning motor, a servo pump, the drain as purge valve, and no check valve",
        "chamber of 5 cm3 between pump and valve": "drilled passages of a block",
        "drain of 4 mm": "the bore of the thesis' holding valve, as in the study of the hold",
        "ball screw of 20 mm with a lead of 20 mm, friction 0.01, 120 g.cm2": "a typical one, 100 mm of steel; with "
        "the clutch open, this lead needs about the same motor torque as the cam",
        "controllers": "PI, as fast as the slowest valve allows; all saturate during the opening",
    }
)


class Positioned(ClutchActuator, partial=True):
    """A clutch actuator with a position sensor at the slave and a demanded position."""

    demand: Demand
    gauge: PositionSensor

    def connections(self) -> Connections:
        return *super().connections(), connect(self.gauge.flange, self.slave.rod)


class Controlled(Positioned, partial=True):
    """A positioned actuator with one continuous controller."""

    controller: LimPI

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.demand.y, self.controller.u_s),
            connect(self.gauge.y, self.controller.u_m),
        )


def load() -> dict[str, Any]:
    """Line, slave cylinder, clutch, demand and position sensor."""
    base = ehs_maxon()
    return dict(
        line=base.line, slave=base.slave, piston=base.piston, seal=base.seal, clutch=base.clutch,
        demand=demand(), gauge=PositionSensor(),
    )  # fmt: skip


def motor_control() -> LimPI:
    """The controller of a motor voltage, through a lossless full bridge."""
    return LimPI(k=2e4, Ti=0.2, y_min=-SUPPLY, y_max=SUPPLY)


def valve_control() -> LimPI:
    """The controller of the signal of a valve or swash plate."""
    return LimPI(k=200.0, Ti=0.2, y_min=-1.0, y_max=1.0)


def drain_control() -> LimPI:
    """The controller that opens a valve to the tank if the clutch is too far open."""
    return LimPI(k=-60.0, Ti=0.05, y_min=0.0, y_max=1.0)


def spool() -> SecondOrder:
    """The spool of a small proportional valve."""
    return SecondOrder(w=314.0, D=0.8)


def drain() -> VariableOrifice:
    """A valve from the line to the tank; it passes the full pump flow at a few tenths of a bar."""
    return VariableOrifice(area=0.25 * math.pi * 4e-3**2, liquid=liquid())


def relief(pressure: float = HIGHEST) -> ReliefValve:
    """A relief valve that limits the pressure, in Pa."""
    return ReliefValve(conductance=2e-10, cracking_pressure=pressure)


def chamber() -> Volume:
    """The volume between a pump and a valve."""
    return Volume(volume=5e-6, bulk_modulus=1.5e9)


def three_way_valve() -> ThreeWayValve:
    """The metering edges of a small proportional valve."""
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
