"""Servo motors and inverters from order names."""

import math
from typing import Any

from .._data_sheet import DataSheet
from ..electrical import PMSM, DqMachine, Inverter, PMSMDrive
from ._parts import sheet_of


def servo_motor(order: str | DataSheet, **others: Any) -> PMSM:
    """A synchronous servo motor from its order name or data sheet; `others` replace arguments of `PMSM`.

    The sheet states torque per rms current, kt = 3/2 sqrt(2) p psi, and resistance and inductance between two
    terminals: Rs = R/2, Ld = Lq = L/2, for surface magnets, at the temperature of the sheet. The magnets do not
    saturate here: near the peak current the sheet's torque is smaller, by some 10 %.
    """
    sheet = sheet_of(order, "servo_motors")
    given: dict[str, Any] = dict(machine=_machine(sheet), J=sheet["inertia"])
    return PMSM(**(given | others), data_sheet=sheet)


def inverter(order: str | DataSheet, **others: Any) -> Inverter:
    """An inverter with the ratings of its data sheet; `others` are arguments of `Inverter`.

    `Inverter` itself limits the voltage, not the current: `limits` checks the ratings of the current after a run.
    """
    return Inverter(**others, data_sheet=sheet_of(order, "inverters"))


def servo_drive(motor: str | DataSheet, inverter: str | DataSheet, C: Any, **others: Any) -> PMSMDrive:
    """A servo motor with an inverter, by their order names or data sheets, and C in F of the direct-voltage link.

    The drive limits the current to the smaller of the two peak currents. `limits` checks this current, and the smaller
    of the two continuous currents. `others` replace arguments of `PMSMDrive`.
    """
    machine, bridge = sheet_of(motor, "servo_motors"), sheet_of(inverter, "inverters")
    sheet = _both(machine, bridge)
    given: dict[str, Any] = dict(
        machine=_machine(machine), J=machine["inertia"], C=C, i_max=math.sqrt(2.0) * sheet["peak_current"]
    )
    return PMSMDrive(**(given | others), data_sheet=sheet)


def _machine(sheet: DataSheet) -> DqMachine:
    p, L = sheet["pole_pairs"], 0.5 * sheet["inductance"]
    psi = sheet["torque_constant"] / (1.5 * math.sqrt(2.0) * p)
    return DqMachine(p=p, psi=psi, Ld=L, Lq=L, Rs=0.5 * sheet["resistance"])


def _both(motor: DataSheet, inverter: DataSheet) -> DataSheet:
    """The ratings of a motor and an inverter together: the smaller of their currents, and the others of the motor."""
    figures = dict(motor.figures)
    for name, same in (("continuous_current", "rated_current"), ("peak_current", "peak_current")):
        figures[name] = min(figures.get(name, math.inf), inverter[same])
    texts = {
        name: f"{getattr(motor, name)} with {getattr(inverter, name)}"
        for name in ("catalogue", "order", "family", "maker", "source", "date")
    }
    return DataSheet(figures=tuple(figures.items()), units=motor.units, **texts)
