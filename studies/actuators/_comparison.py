"""Comparison of actuators: time, current, pressure, energy, mass and cost."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ._models import ClutchActuator
from ._opening import opening
from ._statics import hold
from ._use import Energies, energies_of, powers

HEADS = (
    "actuator", "opens in [ms]", "peak [A]", "line [bar]", "opening [J]", "efficiency [%]", "hold, motor [A]",
    "hold, battery [A]", "hold [W]", "mass [kg]", "cost",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Figures:
    """The figures of an actuator in SI units. Currents are motor currents, except `battery_current`.

    The mass is the sum of the masses in the data sheets and the mass `rest` of all other parts.
    """

    opening_time: float
    peak_current: float
    line_pressure: float  # peak value
    energies: Energies
    holding_current: float
    battery_current: float  # during the hold, with a lossless converter
    holding_power: float
    mass: float | None
    cost: float | None

    def cells(self) -> tuple[str, ...]:
        """The figures as strings, in the units of `HEADS`."""
        given = (
            1e3 * self.opening_time, self.peak_current, 1e-5 * self.line_pressure, self.energies.battery,
            100.0 * self.energies.efficiency, self.holding_current, self.battery_current, self.holding_power,
            self.mass, self.cost,
        )  # fmt: skip
        return tuple("-" if value is None else f"{float(value):.3g}" for value in given)


class Comparison(dict[str, Figures]):
    """The figures of actuators by name; prints as a table."""

    def __str__(self) -> str:
        return aligned([HEADS, *((name, *one.cells()) for name, one in self.items())])


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """A text table with the first column left-aligned and the others right-aligned."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            text.rjust(width) if i else text.ljust(width)
            for i, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )


def figures(
    model: ClutchActuator,
    *,
    hold_time: float = 10.0,
    rest: float = 0.0,
    cost: float | None = None,
    rtol: float = 1e-8,
) -> Figures:
    """The figures of an actuator, from one run of its opening at full voltage and from its hold by the motor.

    `rest` is the mass in kg of all parts without a data sheet. Raises `SimulationError` if the clutch does not open.
    """
    opened = opening(
        model, save="end", rtol=rtol, throw=True, integrals=powers,
        peaks=lambda s: {"current": s.motor.p.i, "pressure": s.line.p},
    )  # fmt: skip
    held = hold(model)
    return Figures(
        opening_time=float(opened.t1),
        peak_current=float(opened.peaks["current"].value),
        line_pressure=float(opened.peaks["pressure"].value),
        energies=energies_of(opened, hold_time),
        holding_current=float(held.current),
        battery_current=float(held.battery_current(opened.final.supply.V)),
        holding_power=float(held.power),
        mass=_mass(model, rest),
        cost=cost,
    )


def compare(
    actuators: Mapping[str, ClutchActuator],
    *,
    rest: Mapping[str, float] | None = None,
    costs: Mapping[str, float] | None = None,
    hold_time: float = 10.0,
    rtol: float = 1e-8,
) -> Comparison:
    """Compares actuators by name.

    `rest` is the mass in kg of all parts without a data sheet, by the name of the actuator. `costs` are the user's own
    figures, in any currency: the catalogues of the library have no prices.
    """
    return Comparison(
        (
            name,
            figures(
                model, hold_time=hold_time, rest=(rest or {}).get(name, 0.0), cost=(costs or {}).get(name), rtol=rtol
            ),
        )
        for name, model in actuators.items()
    )


def _mass(model: Any, rest: float) -> float | None:
    """The mass in kg, or None if a data sheet is missing or does not state it."""
    parts = [getattr(model, name) for name in ("motor", "gearbox", "pump") if hasattr(model, name)]
    sheets = [getattr(part, "data_sheet", None) for part in parts]
    masses = [None if sheet is None else sheet.get("mass") for sheet in sheets]
    known = [mass for mass in masses if mass is not None]
    return sum(known) + rest if len(known) == len(masses) else None
