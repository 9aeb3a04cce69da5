"""Errors of fits that cannot be computed at their start values."""

from collections.abc import Sequence
from typing import NoReturn

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.component import Component
from ..._errors import SimulationError
from .._problem.free import Free
from .entries import Channel
from .experiment import Prepared
from .fit_problem import FitProblem
from .prepare import Labels


def raise_start(
    problem: FitProblem,
    free: Free,
    ready: Sequence[Prepared],
    labels: Sequence[Labels],
    channels: Sequence[Channel],
    starts: int,
) -> NoReturn:
    """Raises `SimulationError` with the experiment that cannot be computed at the start, the cause and the remedy."""
    x = np.array([variable.start for variable in free.variables])
    others = f", nor from {starts - 1} other points" if starts > 1 else ""
    where = f"The fit cannot start with {free.text(x)}{others}"
    remedy = "Start from values with which all experiments can be computed, by replace(model, {...})" + (
        "." if starts > 1 else ", or pass starts=10 to try points between the bounds, too."
    )
    for experiment, label in zip(ready, labels, strict=True):
        model = experiment.applied(problem.shared_model(x), x)
        if cause := _cause(experiment, model):
            raise SimulationError(f"{label.name}: {cause} {where}. {remedy}")
    raise SimulationError(f"{_derivative(problem, free, channels, x)} {where}. {remedy}")


def _cause(experiment: Prepared, model: Component) -> str:
    """The error of a failed run, or else the first prediction that is not finite; empty if all are finite."""
    strange = _not_finite(experiment, model)
    return strange and (experiment.failure(model) or strange)


def _not_finite(experiment: Prepared, model: Component) -> str:
    """The first prediction that is not finite; empty if there is none."""
    # Compiled as in the fit: outside of `jit`, a failed run has fewer saved values.
    for name, found in eqx.filter_jit(experiment.predicted)(model).items():
        values = np.ravel(found)
        if not np.all(np.isfinite(values)):
            first = int(np.argmin(np.isfinite(values)))
            return f"{name} is {values[first]:g}{_when(experiment.times, first)}."
    return ""


def _derivative(problem: FitProblem, free: Free, channels: Sequence[Channel], x: np.ndarray) -> str:
    """The first derivative of a prediction that is not finite."""
    jacobian = np.asarray(jax.jit(jax.jacfwd(problem.residuals))(jnp.asarray(problem.free.scaled(x))))
    for channel in channels:
        rows, columns = np.nonzero(~np.isfinite(jacobian[channel.rows]))
        if len(rows):
            when = _when(channel.times, rows[0])
            return f"{channel.label}: the derivative with respect to {free.names[columns[0]]}{when} is not finite."
    return "The residuals are too large. Check the units of the data and sigma."


def _when(times: np.ndarray | None, i: int) -> str:
    return "" if times is None else f" at {times[i]:g} s"
