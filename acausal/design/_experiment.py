"""Experiments: what was measured, and how the model predicts it."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from .._declare.by_name import replace
from .._declare.component import Component
from .._declare.node import leaves_of
from .._errors import ArgumentError, ModelError, ParameterError, UnknownNameError, suggestion
from .._evaluate.building import system_of
from .._integrate.result import is_success, sentence
from .._integrate.simulate import simulate
from .._units.quantity import has_unit, magnitude
from ._free import Free, Place, Variable, free_parameters, with_numbers

M = TypeVar("M", bound=Component)


@dataclasses.dataclass(frozen=True)
class Run:
    """A simulation that predicts variables by path, and `outputs` that are computed from them, at given times."""

    paths: tuple[str, ...]
    outputs: tuple[tuple[str, Callable[[Any], Any]], ...]
    options: tuple[tuple[str, Any], ...]

    def __call__(self, model: Component, times: Any) -> dict[str, Any]:
        solution = simulate(model, times[-1], save=times, throw=False, **dict(self.options))
        values = {path: solution[path] for path in self.paths}
        if self.outputs:
            view = solution.values
            values |= {name: jnp.broadcast_to(function(view), times.shape) for name, function in self.outputs}
        reached = is_success(solution.result)
        return {name: jnp.where(reached, value, jnp.inf) for name, value in values.items()}

    def failure(self, model: Component, times: Any) -> str:
        """What the run says that fails."""
        return sentence(simulate(model, times[-1], save=times, throw=False, **dict(self.options)).result)


@dataclasses.dataclass(frozen=True)
class Results:
    """A user's function of the model that predicts numbers or arrays by name."""

    function: Callable[[Any], Mapping[str, Any]]

    def __call__(self, model: Component, times: Any) -> dict[str, Any]:
        del times
        return dict(self.function(model))


@dataclasses.dataclass(frozen=True)
class Experiment(Generic[M]):
    """Scalar results that were measured, and how the model predicts them; for trajectories see `Experiment.of_run`.

    - `predict(model)`: a dictionary with what is measured, by the names of `measured`; numbers or arrays, computed with
      one or several runs. It must be traceable by jax; a run that fails should give a value that is not finite.
    - `measured`: the measured values by name, plain numbers in the unit of `units`, or quantities.
    - `sigma`: standard deviations of the noise by name, in the same units; a number, or one for each value. What is not
      named has a noise that is estimated from the residuals, one number for all values of that name.
    - `changes`: parameters and start values of the model in this experiment, by path.
    - `free`: parameters and start values that are free in this experiment alone, with bounds as in `identify`; each
      starts from what the model has with its `changes`.
    - `units`: units of what is measured; a path of the model has that of its declaration.
    - `name`: what tables and messages call it.
    """

    predict: Callable[[M], Mapping[str, Any]] | Run
    measured: Mapping[str, Any]
    sigma: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    changes: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    name: str = ""
    times: Any = None
    free: Mapping[Any, Any] = dataclasses.field(default_factory=dict)

    @classmethod
    def of_run(
        cls,
        times: Any,
        measured: Mapping[str, Any],
        *,
        sigma: Mapping[str, Any] | None = None,
        outputs: Mapping[str, Callable[[M], Any]] | None = None,
        changes: Mapping[str, Any] | None = None,
        free: Mapping[Any, Any] | None = None,
        units: Mapping[str, str] | None = None,
        name: str = "",
        **options: Any,
    ) -> "Experiment[M]":
        """Trajectories that were measured in one run.

        - `times`: when, in s or as a quantity, in rising order; the run ends with the last one.
        - `measured`: the values at these times, by the path of the variable or by a name among `outputs`.
        - `outputs`: functions of the variables, as in `{"power": lambda s: s.source.p.v * s.source.p.i}`, for what is
          no variable of the model.
        - `options`: of `simulate`, such as `t0` or `rtol`.

        The other arguments are those of `Experiment`.
        """
        outputs = outputs or {}
        unknown = [name for name in outputs if name not in measured]
        if unknown:
            raise ArgumentError(f"outputs states {', '.join(unknown)}, of which nothing is measured.")
        refused = {"save", "throw", "until"} & options.keys()
        if refused:
            raise ArgumentError(f"{', '.join(sorted(refused))} cannot be chosen here: the run goes through all times.")
        paths = tuple(name for name in measured if name not in outputs)
        run = Run(paths, tuple(outputs.items()), tuple(options.items()))
        return cls(run, measured, sigma or {}, changes or {}, units or {}, name, times, free or {})


class Prepared(eqx.Module):
    """An experiment as arrays in SI units.

    The numbers at the places `own` are those of all free parameters that have the numbers `indices`.
    """

    predict: Run | Results = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    own: tuple[tuple[Place, ...], ...] = eqx.field(static=True)
    indices: Int[Array, " k"]
    measured: dict[str, Any]
    sigma: dict[str, Any]
    changes: dict[str, Any]
    times: Any

    def applied(self, model: M, x: Any) -> M:
        """The model in this experiment, with the values `x` of all free parameters."""
        changed = replace(model, self.changes)
        return with_numbers(changed, self.own, x[self.indices]) if self.own else changed

    def predicted(self, model: Component) -> dict[str, Any]:
        """What the model predicts in this experiment, by name."""
        try:
            found = self.predict(model, self.times)
        except (jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
            raise ModelError(
                f"What predicts {', '.join(self.names)} cannot be differentiated: it uses the value of what it "
                "computes, as float(x), numpy or `if` do. Use jax.numpy, and jnp.where for a choice."
            ) from error
        missing = [name for name in self.names if name not in found]
        if missing:
            raise ModelError(f"predict gives no {', '.join(missing)}; it gives {', '.join(found) or 'nothing'}.")
        values = {name: jnp.asarray(found[name], float) for name in self.names}
        for name, value in values.items():
            if value.shape != jnp.shape(self.measured[name]):
                raise ModelError(
                    f"predict gives {name} with the shape {value.shape}, but what is measured has the shape "
                    f"{jnp.shape(self.measured[name])}."
                )
        return values

    def failure(self, model: Component) -> str:
        """What the run says that fails."""
        return self.predict.failure(model, self.times) if isinstance(self.predict, Run) else ""


@dataclasses.dataclass(frozen=True)
class Labels:
    """How an experiment is called, the unit of each channel, and which channels have a noise that is estimated."""

    name: str
    units: Mapping[str, str]
    estimated: tuple[str, ...]


def prepared(experiments: Sequence[Experiment[Any]], model: Component) -> tuple[list[Prepared], list[Labels]]:
    """The experiments with all that is wrong with them said."""
    if not experiments or not all(isinstance(experiment, Experiment) for experiment in experiments):
        raise ModelError("experiments is a sequence of at least one Experiment.")
    names = [experiment.name or f"experiment {i + 1}" for i, experiment in enumerate(experiments)]
    if len(set(names)) < len(names):
        raise ModelError(f"Each experiment needs a name of its own, got {', '.join(names)}.")
    pairs = [_prepared(experiment, model, name) for experiment, name in zip(experiments, names, strict=True)]
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def _prepared(experiment: Experiment[Any], model: Component, name: str) -> tuple[Prepared, Labels]:
    if not experiment.measured:
        raise ModelError(f"{name}: nothing is measured.")
    strange = [key for key in experiment.sigma if key not in experiment.measured]
    if strange:
        raise ModelError(
            f"{name}: sigma names {strange[0]!r}, which is not measured.{suggestion(strange[0], experiment.measured)}"
        )
    times = None if experiment.times is None else _times(experiment.times, name)
    units = {key: _unit(experiment, model, key, name) for key in experiment.measured}
    measured = {key: _values(value, units[key], key, name, times) for key, value in experiment.measured.items()}
    sigma = {
        key: _sigma(experiment.sigma[key], units[key], key, name, value.shape)
        if key in experiment.sigma
        else np.full(value.shape, np.nan)
        for key, value in measured.items()
    }
    changes = {key: jnp.asarray(value, float) for key, value in _changes(experiment.changes, model).items()}
    predict = experiment.predict if isinstance(experiment.predict, Run) else Results(experiment.predict)
    ready = Prepared(predict, tuple(measured), (), jnp.zeros(0, int), measured, sigma, changes, times)
    return ready, Labels(name, units, tuple(key for key in measured if key not in experiment.sigma))


def with_own(
    experiments: Sequence[Experiment[Any]],
    ready: Sequence[Prepared],
    labels: Sequence[Labels],
    model: Any,
    shared: Free,
) -> tuple[Free, list[Prepared]]:
    """All free parameters, the shared ones first, then those of each experiment; and the experiments that know theirs.

    Raises what `free_parameters` raises, and `ModelError` for what is shared and an experiment's own at once.
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


def _changes(changes: Mapping[str, Any], model: Component) -> dict[str, Any]:
    """Parameters and start values in their declared units."""
    changed = {leaf.path: leaf.value for leaf in leaves_of(replace(model, changes))}
    return {path: changed[path] for path in changes}


def _unit(experiment: Experiment[Any], model: Component, key: str, name: str) -> str:
    if key in experiment.units:
        return experiment.units[key]
    if not isinstance(experiment.predict, Run) or key not in experiment.predict.paths:
        return ""
    system = system_of(model)
    names = system.flat.leaf_names
    if key not in names:
        raise UnknownNameError(
            f"{name}: the model has no variable {key!r}.{suggestion(key, names)} What is no variable is stated by "
            "outputs={...}."
        )
    return system.flat.leaves[names[key][0]].declaration.unit


def _plain(value: Any, unit: str, where: str) -> np.ndarray:
    """An array of floats in a unit."""
    value = magnitude(value, unit, where) if has_unit(value) else value
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where} must hold real numbers, got {value!r}.") from error


def _times(given: Any, name: str) -> np.ndarray:
    times = _plain(given, "s", f"{name}: times")
    if times.ndim != 1 or not len(times):
        raise ParameterError(f"{name}: times must be a sequence of instants in s, got the shape {times.shape}.")
    if not np.all(np.isfinite(times)):
        first = int(np.argmin(np.isfinite(times)))
        raise ParameterError(f"{name}: times must be finite, but times[{first}] is {times[first]}.")
    if np.any(np.diff(times) <= 0.0):
        first = int(np.argmax(np.diff(times) <= 0.0))
        raise ParameterError(
            f"{name}: times must rise, but times[{first + 1}] = {times[first + 1]:g} s follows times[{first}] = "
            f"{times[first]:g} s. Remedy: sort the samples, and average those at one instant."
        )
    return times


def _values(given: Any, unit: str, key: str, name: str, times: np.ndarray | None) -> np.ndarray:
    values = _plain(given, unit, f"{name}: {key}")
    if times is not None and values.shape != times.shape:
        raise ParameterError(f"{name}: {key} has the shape {values.shape}, but there are {len(times)} times.")
    good = np.isfinite(values)
    if not np.all(good):
        first = int(np.argmin(good.ravel()))
        when = "" if times is None else f", at {times[first]:g} s"
        raise ParameterError(
            f"{name}: {key} holds {int(np.sum(~good))} values that are no finite numbers; the first is {key}[{first}]"
            f"{when}. Remedy: leave out these samples with their times."
        )
    return values


def _sigma(given: Any, unit: str, key: str, name: str, shape: tuple[int, ...]) -> np.ndarray:
    sigma = _plain(given, unit, f"{name}: sigma of {key}")
    if has_unit(given):
        # A difference: on a scale with another zero, such as degC, that zero is no part of it.
        sigma = sigma - _plain(type(given)(0.0, given.units), unit, key)
    if sigma.shape not in ((), shape):
        raise ParameterError(f"{name}: sigma of {key} has the shape {sigma.shape}, but {key} has the shape {shape}.")
    if not np.all(np.isfinite(sigma) & (sigma > 0.0)):
        raise ParameterError(f"{name}: sigma of {key} must be positive and finite, got {given}.")
    return np.broadcast_to(sigma, shape).copy()
