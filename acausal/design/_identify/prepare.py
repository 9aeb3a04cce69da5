"""Checked experiments as arrays in SI units, and errors of fits that cannot be computed at their start values."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, ParameterError, SimulationError, UnknownNameError, suggestion
from ..._evaluate.building import system_of
from ..._numbers import Numbers
from ..._unit_check.signal_units import unit_of_leaf
from ..._units.display import Scale, scale_of
from ..._units.quantity import has_unit, magnitude, quantity
from .._problem.free import Free, Variable
from .._problem.free_parameters import free_parameters
from .._problem.types import number_in
from .entries import Channel
from .experiment import Experiment, Prepared, Results, Run
from .fit_problem import FitProblem


@dataclasses.dataclass(frozen=True)
class Labels:
    """Name of an experiment, units of its channels and of their data, and the channels with estimated noise."""

    name: str
    units: Mapping[str, str]
    scales: Mapping[str, Scale]  # units of the data
    estimated: tuple[str, ...]


def prepared(experiments: Sequence[Experiment], model: Component) -> tuple[list[Prepared], list[Labels]]:
    """Validates the experiments and returns them as arrays."""
    if not experiments or not all(isinstance(experiment, Experiment) for experiment in experiments):
        raise ModelError("experiments must be a sequence of at least one Experiment.")
    names = [experiment.name or f"experiment {i + 1}" for i, experiment in enumerate(experiments)]
    if len(set(names)) < len(names):
        raise ModelError(f"The names of experiments must be unique, got {', '.join(names)}.")
    pairs = [_prepared(experiment, model, name) for experiment, name in zip(experiments, names, strict=True)]
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def _prepared(experiment: Experiment, model: Component, name: str) -> tuple[Prepared, Labels]:
    if not experiment.measured:
        raise ModelError(f"{name}: nothing is measured.")
    strange = [key for key in experiment.sigma if key not in experiment.measured]
    if strange:
        raise ModelError(
            f"{name}: sigma names {strange[0]!r}, which is not measured.{suggestion(strange[0], experiment.measured)}"
        )
    times = None if experiment.times is None else _times(experiment.times, name)
    units = {key: _unit(experiment, model, key, name) for key in experiment.measured}
    given = {key: _given(experiment, value, units[key], key) for key, value in experiment.measured.items()}
    scales = {key: _scale(value, units[key], f"{name}: {key}") for key, value in given.items()}
    measured = {
        key: _values(value, units[key], key, name, times, missing=experiment.missing) for key, value in given.items()
    }
    sigma = {
        key: _sigma(_given(experiment, experiment.sigma[key], units[key], key), units[key], key, name, value.shape)
        if key in experiment.sigma
        else np.full(value.shape, np.nan)
        for key, value in measured.items()
    }
    sigma = {key: np.where(np.isnan(measured[key]), np.inf, value) for key, value in sigma.items()}
    measured = {key: np.nan_to_num(value) for key, value in measured.items()}
    changes = {key: jnp.asarray(value, float) for key, value in _changes(experiment.changes, model).items()}
    predict = experiment.predict if isinstance(experiment.predict, Run) else Results(experiment.predict)
    ready = Prepared(predict, tuple(measured), (), jnp.zeros(0, int), measured, sigma, changes, times)
    return ready, Labels(name, units, scales, tuple(key for key in measured if key not in experiment.sigma))


def with_own(
    experiments: Sequence[Experiment],
    ready: Sequence[Prepared],
    labels: Sequence[Labels],
    model: Component,
    shared: Free,
) -> tuple[Free, list[Prepared]]:
    """All free parameters, shared ones first, and the experiments with the places of their own ones.

    Raises the errors of `free_parameters`, and `ModelError` for a parameter that is free twice.
    """
    variables, known = list(shared.variables), []
    taken = {place for variable in shared.variables for place in variable.places}
    for experiment, one, label in zip(experiments, ready, labels, strict=True):
        own: tuple[Variable, ...] = ()
        if experiment.free:
            own = free_parameters(replace(model, experiment.changes), experiment.free).variables
        for place in (place for variable in own for place in variable.places):
            if place in taken:
                raise ModelError(f"{label.name}: {place.name} is free in all experiments already. Name it once.")
        indices = jnp.arange(len(variables), len(variables) + len(own))
        known.append(dataclasses.replace(one, own=tuple(variable.places for variable in own), indices=indices))
        variables += [variable._replace(name=f"{label.name}: {variable.name}") for variable in own]
    return Free(tuple(variables)), known


def _changes(changes: Mapping[str, object], model: Component) -> dict[str, Numbers]:
    """Parameters and start values in their declared units."""
    changed = {leaf.path: leaf.value for leaf in leaves_of(replace(model, changes))}
    return {path: changed[path] for path in changes}


def _unit(experiment: Experiment, model: Component, key: str, name: str) -> str:
    """The unit of a prediction: for a path of the model, its own, otherwise that of the measured values."""
    if not isinstance(experiment.predict, Run) or key not in experiment.predict.paths:
        return experiment.units.get(key, "")
    flat = system_of(model).flat
    names = flat.leaf_names
    if key not in names:
        raise UnknownNameError(
            f"{name}: the model has no variable {key!r}.{suggestion(key, names)} Use outputs={{...}} for a function of "
            "variables."
        )
    return unit_of_leaf(flat, names[key][0]) or experiment.units.get(key, "")


def _given(experiment: Experiment, value: object, unit: str, key: str) -> object:
    """Measured values or their noise: plain numbers as quantities, if the data have another unit than the model."""
    of_data = experiment.units.get(key, unit)
    return value if has_unit(value) or of_data == unit else quantity(np.asarray(value, float), of_data)


def _scale(value: Any, unit: str, where: str) -> Scale:
    """The unit of the data."""
    if not has_unit(value):
        return Scale(unit)
    return scale_of(number_in(type(value)(1.0, value.units), unit, where)[1], unit, where)


def _plain(value: object, unit: str, where: str) -> np.ndarray:
    """An array of floats in a unit."""
    value = magnitude(value, unit, where) if has_unit(value) else value
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where} must hold real numbers, got {value!r}.") from error


def _times(given: object, name: str) -> np.ndarray:
    times = _plain(given, "s", f"{name}: times")
    if times.ndim != 1 or not len(times):
        raise ParameterError(f"{name}: times must be a sequence of times in s, got the shape {times.shape}.")
    if not np.all(np.isfinite(times)):
        first = int(np.argmin(np.isfinite(times)))
        raise ParameterError(f"{name}: times must be finite, but times[{first}] is {times[first]}.")
    if np.any(np.diff(times) <= 0.0):
        first = int(np.argmax(np.diff(times) <= 0.0))
        raise ParameterError(
            f"{name}: times must increase, but times[{first + 1}] = {times[first + 1]:g} s follows times[{first}] = "
            f"{times[first]:g} s. Sort the samples, and average those at the same time."
        )
    return times


def _values(given: object, unit: str, key: str, name: str, times: np.ndarray | None, *, missing: bool) -> np.ndarray:
    values = _plain(given, unit, f"{name}: {key}")
    if times is not None and values.shape != times.shape:
        raise ParameterError(f"{name}: {key} has the shape {values.shape}, but there are {len(times)} times.")
    may_miss = missing and not np.all(np.isnan(values))
    good = np.isfinite(values) | (np.isnan(values) & may_miss)
    if not np.all(good):
        first = int(np.argmin(good.ravel()))
        when = "" if times is None else f", at {times[first]:g} s"
        raise ParameterError(
            f"{name}: {int(np.sum(~good))} of {good.size} values of {key} are not finite; the first is "
            f"{key}[{first}]{when}. Leave out these samples and their times, or pass missing=True for values that were "
            "not measured, as NaN."
        )
    return values


def _sigma(given: Any, unit: str, key: str, name: str, shape: tuple[int, ...]) -> np.ndarray:
    sigma = _plain(given, unit, f"{name}: sigma of {key}")
    if has_unit(given):
        # A difference excludes the zero of the scale, such as that of degC.
        sigma = sigma - _plain(type(given)(0.0, given.units), unit, key)
    if sigma.shape not in ((), shape):
        raise ParameterError(f"{name}: sigma of {key} has the shape {sigma.shape}, but {key} has the shape {shape}.")
    if not np.all(np.isfinite(sigma) & (sigma > 0.0)):
        raise ParameterError(f"{name}: sigma of {key} must be positive and finite, got {given}.")
    return np.broadcast_to(sigma, shape).copy()


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
