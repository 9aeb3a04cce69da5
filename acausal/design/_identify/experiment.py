"""Experiments: measurements and their predictions by the model."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._errors import ArgumentError, ModelError, ParameterError, SimulationError
from ..._integrate.results.failure import diagnosis, trials
from ..._integrate.simulate import simulate
from ..._numbers import Numbers
from .._problem.free import Place, with_numbers
from .._problem.types import ByPath, Function

M = TypeVar("M", bound=Component)


@dataclasses.dataclass(frozen=True)
class Run:
    """A simulation that predicts variables by path, and `outputs` computed from them, at given times."""

    paths: tuple[str, ...]
    outputs: tuple[tuple[str, Function], ...]
    options: tuple[tuple[str, Any], ...]

    def __call__(self, model: Component, times: Array) -> dict[str, Numbers]:
        """The predictions by name at times in s, in the units of the model."""
        solution = simulate(model, times[-1], save=times, **dict(self.options))
        values: dict[str, Numbers] = {path: solution[path] for path in self.paths}
        if self.outputs:
            view = solution.values
            values |= {name: jnp.broadcast_to(function(view), times.shape) for name, function in self.outputs}
        return values


@dataclasses.dataclass(frozen=True)
class Results:
    """A user's function of the model that predicts numbers or arrays by name."""

    function: Callable[[Any], Mapping[str, Numbers]]

    def __call__(self, model: Component, times: Array) -> dict[str, Numbers]:
        """The predictions by name."""
        del times
        return dict(self.function(model))


@dataclasses.dataclass(frozen=True)
class Experiment:
    """Measured scalars or arrays with their prediction; for trajectories see `Experiment.of_run`.

    - `predict(model)`: a dictionary of predicted numbers or arrays, with the names of `measured`, from one or several
      runs. It must be traceable by jax. The search steps back from parameters with which a prediction is not finite.
      All numbers of a run that fails are NaN, whatever its `throw`.
    - `measured`: the measured values by name, as quantities or as numbers in the unit of `units`.
    - `sigma`: standard deviations of the noise by name, in the same units; a number, or one for each value. The noise
      of other names is estimated from the residuals, as one number for all values of a name.
    - `changes`: parameters and start values of the model in this experiment, by path.
    - `free`: parameters and start values that are free in this experiment alone, with bounds as in `identify`. They
      start from the values of the model with its `changes`.
    - `units`: units of plain measured values and of their `sigma`. Without it, a path of the model has its declared
      unit, and a name of `predict` or `outputs` that of the prediction. Plots are in the units of the data.
    - `name`: the name in tables and messages.
    - `missing`: whether measured values may be NaN, which are left out, as if a sensor dropped out at times.
    """

    predict: Callable[[Any], Mapping[str, Numbers]] | Run
    measured: Mapping[str, object]
    sigma: Mapping[str, object] = dataclasses.field(default_factory=dict)
    changes: Mapping[str, object] = dataclasses.field(default_factory=dict)
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    name: str = ""
    times: object = None
    free: ByPath[object] = dataclasses.field(default_factory=dict)
    missing: bool = False

    @classmethod
    def of_run(
        cls,
        times: object,
        measured: Mapping[str, object],
        *,
        sigma: Mapping[str, object] | None = None,
        outputs: Mapping[str, Function] | None = None,
        changes: Mapping[str, object] | None = None,
        free: ByPath[object] | None = None,
        units: Mapping[str, str] | None = None,
        name: str = "",
        missing: bool = False,
        **options: Any,
    ) -> "Experiment":
        """Trajectories measured in one run.

        - `times`: increasing times in s or as a quantity; the run ends with the last one.
        - `measured`: the values at these times, by the path of the variable or by a name in `outputs`.
        - `outputs`: measured functions of the variables, as in `{"power": lambda s: s.source.p.v * s.source.p.i}`.
        - `options`: of `simulate`, such as `t0` or `rtol`.

        The other arguments are those of `Experiment`.
        """
        outputs = outputs or {}
        unknown = [name for name in outputs if name not in measured]
        if unknown:
            raise ArgumentError(f"outputs names {', '.join(unknown)}, which is not measured.")
        refused = {"save", "throw", "until"} & options.keys()
        if refused:
            raise ArgumentError(f"{', '.join(sorted(refused))} cannot be chosen here: the run goes through all times.")
        paths = tuple(name for name in measured if name not in outputs)
        run = Run(paths, tuple(outputs.items()), tuple(options.items()))
        return cls(run, measured, sigma or {}, changes or {}, units or {}, name, times, free or {}, missing)


class Prepared(eqx.Module):
    """An experiment as arrays in SI units. A missing value is zero with infinite `sigma`, and so has no weight.

    The elements `indices` of the vector of all free parameters are free in this experiment alone, at the places `own`
    of the model.
    """

    predict: Run | Results = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    own: tuple[tuple[Place, ...], ...] = eqx.field(static=True)
    indices: Int[Array, " k"]
    measured: Mapping[str, Array | np.ndarray]
    sigma: Mapping[str, Array | np.ndarray]
    changes: Mapping[str, Array]
    times: Any

    def applied(self, model: M, x: Array | np.ndarray) -> M:
        """The model in this experiment, with the values `x` of all free parameters."""
        changed = replace(model, self.changes)
        return with_numbers(changed, self.own, x[self.indices]) if self.own else changed

    def predicted(self, model: Component) -> dict[str, Array]:
        """Predictions of the model in this experiment, by name; NaN if a run fails."""
        try:
            with trials():
                found = self.predict(model, self.times)
        except (jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
            raise ModelError(
                f"The prediction of {', '.join(self.names)} cannot be differentiated: it needs concrete values, as "
                "float(x), numpy or `if` do. Use jax.numpy, and jnp.where for a choice."
            ) from error
        missing = [name for name in self.names if name not in found]
        if missing:
            raise ModelError(f"predict does not return {', '.join(missing)}, but {', '.join(found) or 'nothing'}.")
        values = {name: jnp.asarray(found[name], float) for name in self.names}
        for name, value in values.items():
            if value.shape != jnp.shape(self.measured[name]):
                raise ModelError(
                    f"predict returns {name} with the shape {value.shape}, but the measured values have the shape "
                    f"{jnp.shape(self.measured[name])}."
                )
        return values

    def failure(self, model: Component) -> str:
        """The error of a failed run with its time, cause and remedy; empty if no run fails."""
        try:
            with diagnosis():
                self.predict(model, self.times)
        except (SimulationError, ParameterError) as error:
            return str(error)
        return ""
