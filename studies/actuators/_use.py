"""Closing of the clutch, and the energies of opening and holding."""

import dataclasses
from typing import Any

from acausal import Scalar, Solution, replace, simulate

from ._models import ClutchActuator
from ._opening import LONGEST, STROKE, opening
from ._statics import at_rest, hold

CLOSED = 0.05 * STROKE  # m, stroke below which the clutch is considered closed


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
    """Simulates the closing from the clutch held open at `stroke` in m until it has returned to `closed` in m.

    A supply `voltage` of 0 V short-circuits the motor, which brakes it; a negative voltage drives it back. A large
    resistance models an open circuit: `replace(model, {"motor.resistor.R": 1e6})`. If the clutch stays open, `t1` is
    infinite, as for `opening`. Other `options` are those of `simulate`.
    """
    start = replace(at_rest(model, hold(model, stroke)), {"supply.V": voltage})
    return simulate(
        start, t_max, until=lambda s: s.slave.rod.s - closed, direction="down", save=save, rtol=rtol, throw=throw,
        **options,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Energies:
    """The energies of an opening and of the hold after it, in J."""

    battery: Scalar  # supplied by the battery during the opening
    winding: Scalar  # dissipated in the winding and its leads during the opening
    clutch: Scalar  # stored in the clutch spring
    holding: Scalar  # supplied by the battery during the hold by the motor alone

    @property
    def efficiency(self) -> Scalar:
        """Energy stored in the clutch over energy of the battery, for the opening."""
        return self.clutch / self.battery


def energy(model: ClutchActuator, *, hold_time: Scalar = 10.0, rtol: Scalar = 1e-9) -> Energies:
    """The energies of an opening at full voltage and of a hold of `hold_time` in s.

    The motor holds through a lossless converter. Friction and gear losses, which would help it, are neglected.
    """
    return energies_of(opening(model, save="end", rtol=rtol, throw=True, integrals=powers), hold_time)


def powers(s: Any) -> dict[str, Scalar]:
    """Powers in W of battery, winding and clutch."""
    return {
        "battery": -s.supply.v * s.supply.i, "winding": s.motor.resistor.v * s.motor.resistor.i,
        "clutch": s.clutch.flange.f * s.piston.v,
    }  # fmt: skip


def energies_of(opened: Solution, hold_time: Scalar) -> Energies:
    """The energies of a run of `opening` with the integrals of `powers`."""
    given = {name: values[-1] for name, values in opened.integrals.items()}
    return Energies(given["battery"], given["winding"], given["clutch"], hold_time * hold(opened.final).power)
