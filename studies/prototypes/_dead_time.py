"""Four explanations of the dead time of 30 ms of the electrohydraulic actuator, each fitted to its measurements.

The thesis measured the dead time and has no model for it. It mentions neither a ramp nor an empty volume.
"""

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from acausal import Scalar, Solution, replace, simulate
from acausal.design import Experiment, Fit, Normal, identify
from components.blocks import Constant, Ramp, Step
from components.electrical import SignalVoltage
from components.hydraulic import SpringAccumulator
from components.rotational import SmoothStribeckFriction

from .._measured import DEAD_TIME, FULL, NO_LOAD_TEST, UNITS
from ..actuators import STROKE, StickingActuator, ehs_maxon, opening, pump_parts

MOVED = 0.01  # of the stroke, threshold of motion
SHEET = Normal(0.317, "10 %")  # ohm, winding of the RE40 from its data sheet, and leads
LONGEST = 0.4  # s
GRID = np.linspace(0.0, 0.15, 301)  # s, grid to find the peak current
FRICTION, RESISTANCE = "motor.bearing.C", "motor.resistor.R"
POCKET = 1e-6  # m3, start of the fit
EMPTY = 5e3  # Pa, pressure of the full pocket, negligible compared with that of the spring


def late() -> StickingActuator:
    """The voltage is a late step."""
    return _actuator(Step(height=FULL, start_time=0.03))


def stuck() -> StickingActuator:
    """The shaft breaks away at almost the stall torque, and slowly passes the peak of its friction."""
    rubbing = SmoothStribeckFriction(Ts=1.2745, Tc=0.05, ws=30.0, w0=0.1)
    return _actuator(Constant(k=FULL), bearing=rubbing)


def rising() -> StickingActuator:
    """The voltage rises, for example through a limited duty cycle, until the shaft breaks away."""
    rubbing = SmoothStribeckFriction(Ts=1.1, Tc=0.05, ws=30.0, w0=0.1)
    return _actuator(Ramp(height=FULL, duration=0.03), bearing=rubbing)


def rising_slowly() -> StickingActuator:
    """The same with the friction of the no-load test, so that the ramp must also slow the opening."""
    rubbing = SmoothStribeckFriction(Ts=0.18342, Tc=0.05, ws=30.0, w0=0.1)
    return _actuator(Ramp(height=FULL, duration=0.09997), bearing=rubbing, resistance=0.4, friction=NO_LOAD_TEST.value)


def empty() -> StickingActuator:
    """The pump first fills a volume without pressure: air, or the travel of the seal of the slave."""
    pocket = SpringAccumulator(capacity=POCKET, preload=0.0, stiffness=EMPTY / POCKET, resistance=6e7)
    return _actuator(Constant(k=FULL), pocket=pocket, friction=2.6e-3)


def _actuator(
    command: Constant | Ramp | Step, resistance: float = 0.317, friction: float = 4e-3, **parts: Any
) -> StickingActuator:
    base = ehs_maxon(resistance=resistance, friction=friction)
    return StickingActuator(
        supply=SignalVoltage(),
        command=command,
        **pump_parts(base),
        **parts,
    )


@dataclasses.dataclass(frozen=True)
class Explanation:
    """A model of the dead time, its free parameters, and the parameter of the supply voltage."""

    model: Callable[[], StickingActuator]
    free: Mapping[str, tuple[float, float]]
    priors: Mapping[str, Normal] = dataclasses.field(default_factory=dict)
    voltage: str = "command.k"


EXPLANATIONS: Mapping[str, Explanation] = MappingProxyType(
    {
        "late voltage": Explanation(
            late, {"command.start_time": (0.0, 0.1), FRICTION: (1e-4, 2e-2), RESISTANCE: (0.2, 0.6)},
            {RESISTANCE: SHEET}, "command.height",
        ),
        "stuck near stall": Explanation(stuck, {"bearing.Ts": (1.2, 1.285), FRICTION: (1e-3, 1e-2)}),
        "rising voltage": Explanation(
            rising,
            {
                "command.duration": (5e-3, 0.3), "bearing.Ts": (0.02, 1.3), FRICTION: (1e-4, 2e-2),
                RESISTANCE: (0.2, 0.6),
            },
            {RESISTANCE: SHEET}, "command.height",
        ),
        "empty volume": Explanation(
            empty, {"pocket.capacity": (1e-7, 3e-6), FRICTION: (1e-4, 2e-2), RESISTANCE: (0.2, 0.6)},
            {RESISTANCE: SHEET},
        ),
    }
)  # fmt: skip

# An additional explanation, which fails.
REFUTED: Mapping[str, Explanation] = MappingProxyType(
    {
        "rising voltage, friction of the no-load test": Explanation(
            rising_slowly, EXPLANATIONS["rising voltage"].free,
            {RESISTANCE: SHEET, FRICTION: Normal(*NO_LOAD_TEST[:2])},
        ),
    }
)  # fmt: skip


def predict(model: StickingActuator) -> dict[str, Scalar]:
    """Opening time, dead time, and peak current."""
    strokes = STROKE * jnp.array([1.0, MOVED])

    def run(stroke: Scalar) -> tuple[Any, Any]:
        solution = opening(model, stroke=stroke, t_max=LONGEST, save=GRID, rtol=1e-7)
        return solution.t1, solution.motor.p.i

    times, currents = jax.vmap(run)(strokes)
    peak = _peak(model, times[0], currents[0])
    return {"opening time": times[0], "dead time": times[1], "peak current": peak}


def _peak(model: StickingActuator, opened: Scalar, current: Float[jax.Array, " t"]) -> Scalar:
    if isinstance(model.command, Ramp):
        return jnp.max(jnp.where(jax.lax.stop_gradient(opened) >= GRID, current, -jnp.inf))
    # The voltage steps while the shaft is at rest.
    voltage = model.command.height if isinstance(model.command, Step) else model.command.k
    return voltage / model.motor.resistor.R


def fit(name: str) -> Fit[StickingActuator]:
    """Fits the parameters of an explanation to opening time, dead time and peak current."""
    explanation = {**EXPLANATIONS, **REFUTED}[name]
    experiment = Experiment(
        predict,
        {key: datum.value for key, datum in DEAD_TIME.items()},
        {key: datum.sigma for key, datum in DEAD_TIME.items()},
        units={key: UNITS[key] for key in DEAD_TIME},
        name=name,
    )
    return identify(explanation.model(), explanation.free, experiment, priors=explanation.priors)


def at_voltage(name: str, model: StickingActuator, voltage: float) -> StickingActuator:
    """The fitted model with another supply voltage in V."""
    return replace(model, {EXPLANATIONS[name].voltage: voltage})


def record(model: StickingActuator, times: Float[np.ndarray, " t"]) -> Solution:
    """The run of an explanation, saved at the times in s."""
    return simulate(model, float(times[-1]), save=times, rtol=1e-7, throw=False)


@eqx.filter_jit
def times(model: StickingActuator) -> dict[str, Scalar]:
    """Compiled `predict`."""
    return predict(model)
