"""A whole simulation against CasADi with CVODES, as the time that an accuracy of the opening time costs."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from studies import opening, opening_time
from studies.actuators import ema_maxon

from . import _handwritten as handwritten
from ._cvodes import Run
from ._effort import Effort
from ._precision import Curve, best_time
from ._rows import Row, compared
from ._timing import fastest

ERRORS = (2e-6, 1e-8)  # of the opening time, relative
LIMIT = 0.5
ABSOLUTE = (1.0, 0.1, 0.01)  # absolute tolerances that CVODES tries, over the relative one


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """The library from the ratio or from the whole model to the opening event; CVODES to a time given beforehand."""
    first, last, number = effort.decades
    rtols = np.logspace(first, last, number)
    ours = _library(rtols, effort)
    theirs = [_cvodes(rtols, factor, effort) for factor in ABSOLUTE]
    if out is not None:
        from ._figures import work_precision

        work_precision([*ours, *theirs], out / "work_precision.png")
    return [
        compared(
            f"casadi: {curve.name}, error {error:g}", curve.time_at(error) * 1e3, "ms",
            best_time(theirs, error) * 1e3, "CVODES to a fixed time", LIMIT,
        )
        for curve in ours
        for error in ERRORS
    ]  # fmt: skip


def _library(rtols: np.ndarray, effort: Effort) -> list[Curve]:
    of_ratio = jax.jit(lambda ratio, rtol: opening_time(ema_maxon(ratio=ratio), rtol=rtol))
    # As under `eqx.filter_jit`: parameters are traced, start values are python floats and known.
    model, rest = eqx.partition(ema_maxon(), eqx.is_array)
    of_model = jax.jit(lambda model, rtol: opening_time(eqx.combine(model, rest), rtol=rtol))
    ratio = jnp.asarray(4.3)
    tolerances = [jnp.asarray(rtol) for rtol in rtols]
    curves = []
    for name, function, argument in (("of the ratio", of_ratio, ratio), ("of the model", of_model, model)):
        calls = {f"{i}": lambda f=function, a=argument, r=r: f(a, r) for i, r in enumerate(tolerances)}
        times = fastest(calls, effort.repeats)
        ends = np.array([float(call()) for call in calls.values()])
        errors = np.abs(ends / handwritten.OPENING_TIME - 1.0)
        curves.append(Curve(f"acausal, a function {name}", errors, np.array(list(times.values()))))
    return curves


def _cvodes(rtols: np.ndarray, factor: float, effort: Effort) -> Curve:
    """The error of travel at the fixed time, over the speed there, is the error of the time of an event."""
    model = ema_maxon()
    p = {name: float(value) for name, value in handwritten.parameters(model).items()}
    speed = float(opening(model, rtol=1e-9, save="end").final.piston.v)
    runs = {f"{i}": Run(p, rtol, factor * rtol) for i, rtol in enumerate(rtols)}
    times = fastest(runs, effort.repeats)
    travel = np.array([run.state[1] for run in runs.values()])
    errors = np.abs(travel - handwritten.STROKE) / speed / handwritten.OPENING_TIME
    return Curve(f"CVODES, abstol = {factor:g} reltol", errors, np.array(list(times.values())))
