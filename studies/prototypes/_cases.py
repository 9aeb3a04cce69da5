"""The fits: free parameters, measurements and priors."""

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import equinox as eqx

from acausal import Scalar
from acausal.design import Experiment, Fit, Normal, identify
from components.rotational import EqualMeshLoss, PlanetaryTrain, SmoothStribeckFriction

from .._measured import MEASURED, MULTIMETER, NO_LOAD_TEST, UNITS, Datum
from ..actuators import (
    ClutchActuator,
    ElectrohydraulicActuator,
    ElectromechanicalActuator,
    ehs_maxon,
    ema_fise,
    ema_maxon,
    hold,
    opening,
)

RESISTANCE, FRICTION = "motor.resistor.R", "motor.bearing.C"
HOLDING = "holding current"
LIQUID, SEAL = "line.damping", "seal.C"
CONSTANT, DRY, MESH = "motor.emf.k", "friction.Tc", "gearbox.loss.efficiency"
FREE: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        RESISTANCE: (0.03, 1.0), FRICTION: (1e-5, 0.1), LIQUID: (1e10, 1e14), SEAL: (1e-5, 10.0),
        CONSTANT: (0.005, 0.1), DRY: (1e-3, 1.0), MESH: (0.3, 1.0),
    }
)  # fmt: skip
# Priors of fluid damping and piston friction, known to a factor of about two.
VAGUE = {LIQUID: Normal(std="100 %"), SEAL: Normal(std="100 %")}
LONGEST = 0.6  # s
DESIGNS: Mapping[str, Callable[..., ClutchActuator]] = MappingProxyType(
    {"ema_fise": ema_fise, "ema_maxon": ema_maxon, "ehs_maxon": ehs_maxon}
)


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """A possible explanation of the measurements on a prototype."""

    name: str
    actuator: str
    free: tuple[str, ...]
    priors: Mapping[str, Normal] = dataclasses.field(default_factory=dict)
    without: tuple[str, ...] = ()  # omitted measurements


CASES = (
    Case("all data", "ema_fise", (RESISTANCE, FRICTION, LIQUID, SEAL), VAGUE),
    Case(
        "multimeter instead of peak current", "ema_fise", (RESISTANCE, FRICTION),
        {RESISTANCE: Normal(*MULTIMETER[:2])}, ("peak current",),
    ),
    Case("times and peaks", "ema_maxon", (RESISTANCE, FRICTION, LIQUID, SEAL), VAGUE, ("holding current",)),
    Case("all data, viscous friction only", "ema_maxon", (RESISTANCE, FRICTION)),
    Case("all data, different torque constant", "ema_maxon", (RESISTANCE, FRICTION, CONSTANT)),
    Case("all data, dry friction", "ema_maxon", (RESISTANCE, FRICTION, DRY)),
    Case("all data, gear losses", "ema_maxon", (RESISTANCE, FRICTION, MESH)),
    Case("all data", "ehs_maxon", (RESISTANCE, FRICTION, LIQUID, SEAL), VAGUE),
    Case("all data and the no-load test", "ehs_maxon", (RESISTANCE, FRICTION), {FRICTION: Normal(*NO_LOAD_TEST[:2])}),
)  # fmt: skip


def model_of(case: Case) -> ClutchActuator:
    """The start of a fit."""
    model = DESIGNS[case.actuator](**({"resistance": 0.15, "friction": 3e-3} if case.actuator == "ema_maxon" else {}))
    if DRY in case.free:
        # The smoothing is wide enough to be cheap, and far below the speeds of the motor.
        rubbing = SmoothStribeckFriction(Tc=0.1, Ts=0.1, ws=10.0, w0=1.0)
        return eqx.tree_at(lambda m: m.friction, model, rubbing, is_leaf=lambda x: x is None)
    if MESH in case.free:
        loss = EqualMeshLoss(efficiency=0.9)
        return eqx.tree_at(lambda m: m.gearbox.loss, model, loss, is_leaf=lambda x: x is None)
    return model


def predict(model: ElectromechanicalActuator | ElectrohydraulicActuator) -> dict[str, Scalar]:
    """The predicted measurements of an opening."""
    time = opening(model, t_max=LONGEST, save="end", rtol=1e-7).t1
    stall = model.supply.V / model.motor.resistor.R
    return {
        "opening time": time,
        "moving time": time,
        "peak current": stall,  # at rest, because the model has no inductance
    }


def predict_held(model: ClutchActuator) -> dict[str, Scalar]:
    """The predicted holding current, at any voltage."""
    return {HOLDING: held(model)}


def held(model: ClutchActuator, direction: float = 1.0) -> Scalar:
    """The current in A at the full stroke at which the motor is about to open further, or, with -1, to close."""
    current = hold(model).current
    if isinstance(model, ElectromechanicalActuator):
        if isinstance(model.gearbox, PlanetaryTrain):
            raise ValueError("gearbox is a train: the holding current is implemented for one stage, PlanetaryGearbox")
        loss, ratio = model.gearbox.loss, model.gearbox.ratio
        if loss is not None:
            # With a fixed ring, the share 1 / ratio of the torque does not pass through the meshes (Mueller).
            share = loss.efficiency ** (direction)
            current = current * ratio / (1.0 + (ratio - 1.0) * share)
        if model.friction is not None:
            current = current + direction * model.friction.Tc / model.motor.emf.k
    return current


def fit(case: Case) -> Fit[ClutchActuator]:
    """Fits the parameters of a case with their priors."""
    experiments = []
    for voltage, data in MEASURED[case.actuator].items():
        chosen = {name: datum for name, datum in data.items() if name not in case.without}
        # A separate experiment, so that runs at several voltages predict the same quantities and form one batch.
        statics = {name: chosen.pop(name) for name in (HOLDING,) if name in chosen}
        experiments.append(_experiment(predict, chosen, f"{voltage:g} V", {"supply.V": voltage}))
        if statics:
            experiments.append(_experiment(predict_held, statics, "at rest", {}))
    shared = {name: (DRY, "friction.Ts") if name == DRY else name for name in case.free}
    free = {shared[name]: FREE[name] for name in case.free}
    return identify(model_of(case), free, experiments, priors={shared[name]: case.priors[name] for name in case.priors})


def _experiment(
    function: Callable[[Any], dict[str, Scalar]], data: Mapping[str, Datum], name: str, changes: Mapping[str, float]
) -> Experiment:
    return Experiment(
        function,
        {key: datum.value for key, datum in data.items()},
        {key: datum.sigma for key, datum in data.items()},
        changes=changes,
        units={key: UNITS[key] for key in data},
        name=name,
    )
