"""The use of an actuator: to close the clutch, and what its energy goes into."""

import dataclasses
from typing import Any

from acausal import Scalar, Solution, replace, simulate

from ._models import ClutchActuator
from ._opening import LONGEST, STROKE, opening
from ._statics import at_rest, hold

CLOSED = 0.05 * STROKE  # m, below which the clutch counts as closed


def closing(
    model: ClutchActuator,
    *,
    voltage: Scalar = 0.0,
    stroke: Scalar = STROKE,
    closed: Scalar = CLOSED,
    rtol: Scalar = 1e-9,
    t_max: Scalar = LONGEST,
    save: object = "steps",
    throw: bool = False,
    **options: Any,
) -> Solution:
    """The run from the clutch held open at `stroke` in m until it has come back to `closed` in m.

    The supply has a `voltage` in V: 0 short-circuits the motor, which brakes; a negative one drives it back. An open
    circuit is that of a large resistance, `replace(model, {"motor.resistor.R": 1e6})`. Nothing is raised for an
    actuator that stays open, as for `opening`; other `options` are those of `simulate`.
    """
    start = replace(at_rest(model, hold(model, stroke)), {"supply.V": voltage})
    return simulate(
        start, t_max, until=lambda s: s.slave.rod.s - closed, direction="down", save=save, rtol=rtol, throw=throw,
        **options,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Energies:
    """The energies of an opening and of the hold after it, in J."""

    battery: Scalar  # given while it opens
    winding: Scalar  # of that, turned into heat by the winding and its leads
    clutch: Scalar  # and stored in the clutch spring
    holding: Scalar  # given during the hold, by the motor alone

    @property
    def efficiency(self) -> Scalar:
        """Work on the clutch over energy of the battery, of the opening."""
        return self.clutch / self.battery


def energy(model: ClutchActuator, *, hold_time: Scalar = 10.0, rtol: Scalar = 1e-9) -> Energies:
    """The energies of an opening at full voltage and of a hold of `hold_time` in s.

    The hold is that of the motor behind a lossless converter; friction and gear losses, which help it, are left out.
    """
    return energies_of(opening(model, save="end", rtol=rtol, throw=True, integrals=powers), hold_time)


def powers(s: Any) -> dict[str, Scalar]:
    """In W, of battery, winding and clutch."""
    return {
        "battery": -s.supply.v * s.supply.i, "winding": s.motor.resistor.v * s.motor.resistor.i,
        "clutch": s.clutch.flange.f * s.piston.v,
    }  # fmt: skip


def energies_of(opened: Solution, hold_time: Scalar) -> Energies:
    """The energies of a run of `opening` with the integrals of `powers`."""
    given = {name: values[-1] for name, values in opened.integrals.items()}
    return Energies(given["battery"], given["winding"], given["clutch"], hold_time * hold(opened.final).power)
