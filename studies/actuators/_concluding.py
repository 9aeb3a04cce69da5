"""The concluding table of the thesis, compared with the models of its prototypes."""

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType

from ._comparison import Figures, aligned, figures
from ._designs import ehs_maxon, ema_fise, ema_maxon
from ._models import ClutchActuator

HEADS = (
    "prototype", "motor [W]", "efficiency [%]", "rotor [g.cm2]", "motor [kg]", "total [kg]", "volume [cm3]", "[W/kg]",
    "[W/cm3]", "opens, thesis [ms]", "model [ms]", "model, opening [J]", "model, hold [W]", "cost",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Stated:
    """A row of the thesis' concluding table, with the model of the prototype at 13.5 V."""

    build: Callable[[], ClutchActuator]
    power: float  # W, nominal, of the motor
    efficiency: float  # maximum efficiency of the motor; of the FISE including its worm
    rotor_inertia: float  # kg.m2
    motor_mass: float  # kg
    total_mass: float  # kg
    volume: float  # m3; the thesis prints mm3 for cm3
    opening_time: float  # s


# The RE 50 opened in 100 ms at 70 % of the voltage and in 70 ms at full voltage; the model has 13.5 V.
STATED: Mapping[str, Stated] = MappingProxyType(
    {
        "EMA, FISE": Stated(ema_fise, 400.0, 0.52, 60e-6, 1.2, 2.5, 580e-6, 0.140),
        "EMA, RE 50": Stated(ema_maxon, 200.0, 0.94, 54e-6, 1.1, 2.5, 620e-6, 0.070),
        "EHS, RE 40": Stated(ehs_maxon, 150.0, 0.91, 14e-6, 0.48, 1.8, 480e-6, 0.130),
    }
)


class Concluding(dict[str, tuple[Stated, Figures]]):
    """The thesis' row and the figures of the model for each prototype; prints as a table."""

    def __str__(self) -> str:
        return aligned([HEADS, *((name, *_cells(*one)) for name, one in self.items())])


def concluding_table(costs: Mapping[str, float] | None = None) -> Concluding:
    """The thesis' concluding table with power density, next to opening time, energy and holding power of the models.

    `costs` by the name of the prototype are the user's own figures: the thesis has none.
    """
    return Concluding(
        (name, (stated, figures(stated.build(), cost=(costs or {}).get(name)))) for name, stated in STATED.items()
    )


def _cells(stated: Stated, found: Figures) -> tuple[str, ...]:
    given = (
        stated.power, 100.0 * stated.efficiency, 1e7 * stated.rotor_inertia, stated.motor_mass, stated.total_mass,
        1e6 * stated.volume, stated.power / stated.total_mass, stated.power / (1e6 * stated.volume),
        1e3 * stated.opening_time, 1e3 * found.opening_time, found.energies.battery, found.holding_power, found.cost,
    )  # fmt: skip
    return tuple("-" if value is None else f"{float(value):.3g}" for value in given)
