"""The generated vector field against a hand-written one: alone, and in a whole simulation."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from acausal import Scalar, choose_states
from studies import opening_time
from studies.actuators import ElectromechanicalActuator, ema_maxon

from . import _handwritten as handwritten
from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest

LIMIT = 1.1


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """Both fields with the numbers of the model as traced inputs."""
    return [*_alone(effort), *_simulated(effort)]


def _alone(effort: Effort) -> list[Row]:
    model = ema_maxon()
    system = choose_states(model)
    inputs = jax.tree_util.tree_map(jnp.asarray, system.pack(model))
    p = handwritten.device_parameters(model)
    fields = {"generated": (system.vector_field, inputs), "hand-written": (handwritten.vector_field, p)}
    singles = {name: jax.jit(field) for name, (field, _) in fields.items()}
    y = jnp.asarray(handwritten.NOMINALS)
    factors = _factors(system.state_names, model)
    places = np.array([handwritten.STATES.index(_ON_CAM.get(name, name)) for name in system.state_names])
    start = {"generated": factors * y[places], "hand-written": y}
    rates = {name: singles[name](0.0, start[name], given) for name, (_, given) in fields.items()}
    np.testing.assert_allclose(rates["generated"], factors * rates["hand-written"][places], rtol=1e-11)

    loops = {name: _looped(field, effort.evaluations) for name, (field, _) in fields.items()}
    in_loop = fastest({n: lambda n=n: loops[n](start[n], fields[n][1]) for n in fields}, effort.repeats)
    t = jnp.asarray(0.0)
    called = fastest({n: lambda n=n: singles[n](t, start[n], fields[n][1]) for n in fields}, 10 * effort.repeats)
    return [
        _row("in a loop", {n: seconds / effort.evaluations * 1e9 for n, seconds in in_loop.items()}, "ns", LIMIT),
        # The time of a call is that of passing the arguments, of which the generated field has those that it looks up.
        _row("called", {n: seconds * 1e6 for n, seconds in called.items()}, "us", None),
    ]


# States of the motor's shaft, by the library's choice, and those of the cam's which they are a multiple of.
_ON_CAM = {"motor.shaft.phi": "gearbox.carrier.phi", "motor.rotor.w": "cam.w"}


def _factors(names: list[str], model: ElectromechanicalActuator) -> Any:
    """The states of the library as multiples of the hand-written ones."""
    return jnp.stack([model.gearbox.ratio if name in _ON_CAM else jnp.ones(()) for name in names])


def _looped(field: Callable[[Any, Any, Any], Any], n: int) -> Callable[[Any, Any], Any]:
    """`n` evaluations one after the other; each depends on the one before so that none can be left out."""

    @jax.jit
    def loop(y: Scalar, inputs: Any) -> Any:
        return jax.lax.fori_loop(0, n, lambda i, y: y + 1e-9 * field(i * 1e-9, y, inputs), y)

    return loop


def _simulated(effort: Effort) -> list[Row]:
    # As under `eqx.filter_jit`: parameters are traced, start values are python floats and known.
    model, rest = eqx.partition(ema_maxon(), eqx.is_array)
    generated = jax.jit(lambda m, rtol: opening_time(eqx.combine(m, rest), rtol=rtol))
    by_hand = jax.jit(lambda m, rtol: handwritten.opening_time(handwritten.parameters(eqx.combine(m, rest)), rtol))
    rows = []
    for rtol in (1e-5, 1e-7):
        np.testing.assert_allclose(generated(model, rtol), by_hand(model, rtol), rtol=20 * rtol)
        times = fastest(
            {
                "generated": lambda rtol=rtol: generated(model, rtol),
                "hand-written": lambda rtol=rtol: by_hand(model, rtol),
            },
            effort.repeats,
        )
        rows.append(_row(f"simulation, rtol {rtol:g}", {n: s * 1e3 for n, s in times.items()}, "ms", LIMIT))
    return rows


def _row(name: str, times: dict[str, float], unit: str, limit: float | None) -> Row:
    return compared(
        f"vector_field: {name}", times["generated"], unit, times["hand-written"], "the same by hand in JAX", limit
    )
