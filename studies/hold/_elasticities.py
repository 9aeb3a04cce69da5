"""Elasticities of the energy of a hold, and a sweep over the leakage."""

import dataclasses
import inspect
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from ..actuators import CLOSING_TIME, COIL, LEAKAGE, ehs_maxon
from ._runs import Outcome, outcomes

_OF_THE_DESIGN = ("displacement", "resistance", "torque_constant", "spring_rate")
COMMON: Mapping[str, float] = MappingProxyType(
    {
        **{name: inspect.signature(ehs_maxon).parameters[name].default for name in _OF_THE_DESIGN},
        "leakage_resistance": LEAKAGE,
    }
)
OF_THE_VALVE: Mapping[str, float] = MappingProxyType(
    {"coil_resistance": COIL, "closing_time": CLOSING_TIME, "band": 0.5e-3}
)
KEYWORDS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"motor_held": COMMON, "valve_held": MappingProxyType({**COMMON, **OF_THE_VALVE})}
)
SWEEP_RTOL = 1e-7  # at least: sufficient for energies accurate to 1e-8, and strong leakage takes many steps
LEAKAGES = tuple(np.geomspace(3e13, 3e15, 7).tolist())  # Pa.s/m3


@dataclasses.dataclass(frozen=True)
class Elasticities:
    """Elasticities d ln(y) / d ln(parameter).

    The number of top-ups is piecewise constant, so the derivative of the energy does not include its changes. The
    derivative of the time between two top-ups shows them.
    """

    actuator: str
    parameter: str
    energy: float
    period: float | None  # of the time between two top-ups


@dataclasses.dataclass(frozen=True)
class Leaking:
    """Results of a hold with a leakage resistance in Pa.s/m3; energy in J."""

    actuator: str
    leakage_resistance: float
    energy: float
    top_ups: int


def elasticities(actuator: str, rtol: float = 1e-9) -> list[Elasticities]:
    """Elasticities of the base case with respect to each keyword, in forward mode."""
    base = KEYWORDS[actuator]
    found, slopes = evaluate(actuator, [{}] * len(base), list(base), rtol)
    return [
        Elasticities(
            actuator,
            name,
            float(slopes.energy[i] / found.energy[i]),
            float(slopes.period[i] / found.period[i]) if found.top_ups[i] > 1 else None,
        )
        for i, name in enumerate(base)
    ]


def sweep(actuator: str, rtol: float = 1e-9) -> list[Leaking]:
    """Holds over a range of leakage resistances."""
    changes = [{"leakage_resistance": value} for value in LEAKAGES]
    found, _ = evaluate(actuator, changes, ["leakage_resistance"] * len(changes), max(rtol, SWEEP_RTOL))
    return [Leaking(actuator, value, float(found.energy[i]), int(found.top_ups[i])) for i, value in enumerate(LEAKAGES)]


def evaluate(
    actuator: str, changes: Sequence[Mapping[str, float]], names: Sequence[str], rtol: float
) -> tuple[Outcome, Outcome]:
    """The outcomes with changed keywords, and their derivatives y' = dy / d ln(name)."""
    members = [{**KEYWORDS[actuator], **change} for change in changes]
    keywords = {key: jnp.asarray([member[key] for member in members]) for key in KEYWORDS[actuator]}
    directions = {
        key: jnp.asarray([member[key] * (key == name) for member, name in zip(members, names, strict=True)])
        for key in keywords
    }
    return outcomes(actuator, keywords, directions, jnp.asarray(rtol))
