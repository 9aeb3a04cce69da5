"""The solution of a simulation, read by the names of the model."""

import difflib
import functools as ft
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._errors import ModelError, ParameterError, SimulationError
from .._evaluate.initial import constrained_names
from .._evaluate.observe import observe
from .._evaluate.system import Inputs, System
from .energy import EnergyAccount, stored
from .result import Result, sentence


class UnknownNameError(ModelError, KeyError, AttributeError):
    """A name that the model does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


class Solution(eqx.Module):
    """Trajectories of all variables of a model.

    `sol["motor.emf.w"]` and `sol.motor.emf.w` are the values at the saved times `sol.ts`; a parameter is itself.
    `sol.final` has the values at the end, `sol.at(t)` those at any time (with `save="dense"`).

    - `t1`: the time at which the run ended; infinite where a stop condition was never met.
    - `result`: a `Result`; `stats`: numbers of steps.
    """

    t1: Any
    t_start: Any
    y_start: Any
    t_end: Any
    y_end: Any
    saved_ts: Any
    saved_ys: Any
    end_integrals: Any
    saved_integrals: Any
    result: Any
    culprit: Any
    stats: dict[str, Any]
    leaves: list[Any]
    inputs: Inputs
    dense: diffrax.DenseInterpolation | None
    system: System = eqx.field(static=True)
    tree: Any = eqx.field(static=True)  # of the integrals

    @property
    def is_batched(self) -> bool:
        return jnp.ndim(self.t_end) > 0

    @property
    def ts(self) -> Any:
        """The saved times; those after the end, where a condition stopped the run, are left out of a single solution."""
        return self._trimmed(self.saved_ts)

    @property
    def ys(self) -> Any:
        """The state vector at the saved times; see `sol.system.state_names`."""
        return self._trimmed(self.saved_ys)

    def _trimmed(self, rows: Any) -> Any:
        if self.is_batched or isinstance(self.saved_ts, jax.core.Tracer):
            return rows
        return rows[np.isfinite(np.asarray(self.saved_ts))]

    @property
    def values(self) -> Any:
        """The model with trajectories in place of its variables."""
        return self._view(self.ts, self.ys)

    @property
    def final(self) -> Any:
        """The model with the values at the end of the run in place of its variables."""
        return self._view(self.t_end, self.y_end)

    def at(self, t: Any) -> Any:
        """The model with the values at time(s) `t`, for a solution with `save="dense"`."""
        if self.dense is None:
            raise ModelError('sol.at(t) needs a dense solution: simulate(..., save="dense").')
        evaluate = self.dense.evaluate
        return self._view(t, evaluate(t) if jnp.ndim(t) == 0 else jax.vmap(evaluate)(t))

    def _view(self, ts: Any, ys: Any) -> Any:
        variables = _trajectories(self.system, self.is_batched, ts, ys, self.inputs)
        numbers = dict(zip(self.system.flat.variable_leaves, variables, strict=True))
        leaves = [numbers.get(i, leaf) for i, leaf in enumerate(self.leaves)]
        return self.system.flat.structure.unflatten(leaves)

    @property
    def integrals(self) -> Any:
        """Trajectories of the `integrals` asked for."""
        return self._integrals(self._trimmed(self.saved_integrals))["user"]

    def _integrals(self, columns: Any) -> Any:
        if self.tree is None:
            raise ModelError("Nothing was integrated beside the states: pass integrals=... or energy=True to simulate.")
        return self.tree.unflatten([columns[..., i] for i in range(columns.shape[-1])])

    @property
    def energy(self) -> EnergyAccount:
        """The energy account of the run, for one made with `energy=True`."""
        integrals = self._integrals(self.end_integrals)["energy"]
        if not integrals:
            raise ModelError("The powers were not integrated: pass energy=True to simulate.")
        before, after = stored(self._view(self.t_start, self.y_start)), stored(self.final)
        return EnergyAccount(
            supplied={name: supplied for name, (_, supplied) in integrals.items()},
            stored={name: after[name] - before[name] for name in integrals},
            dissipated={name: dissipated for name, (dissipated, _) in integrals.items()},
        )

    def __getitem__(self, name: str) -> Any:
        """The trajectory of a variable or the value of a parameter by its path, as in `"stages[0].gear.ratio"`."""
        where = self._names.get(name)
        if where is None:
            close = difflib.get_close_matches(name, self._names, n=3, cutoff=0.4)
            hint = f" Did you mean {' or '.join(close)}?" if close else ""
            raise UnknownNameError(f"The model has no variable or parameter {name!r}.{hint}")
        leaf, index = where
        value = jax.tree_util.tree_leaves(self.values)[leaf]
        stack = self.system.flat.leaves[leaf].stack
        if not stack:
            return value
        lead = value.ndim - len(stack) - len(self.system.flat.leaves[leaf].sizes)
        return value[(slice(None),) * lead + tuple(np.unravel_index(index, stack))]

    @property
    def _names(self) -> dict[str, tuple[int, int]]:
        return _names(self.system)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in type(self).__dataclass_fields__:
            raise AttributeError(name)
        if name in self.system.root_fields:
            return getattr(self.values, name)
        close = difflib.get_close_matches(name, self.system.root_fields, n=3, cutoff=0.4)
        hint = f" Did you mean {' or '.join(close)}?" if close else ""
        raise UnknownNameError(f"Neither the solution nor the model has an attribute {name!r}.{hint}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.system.root_fields]

    def to_numpy(self) -> dict[str, np.ndarray]:
        """Trajectories of all variables by name, and the time as "t"."""
        names = [name for name, (leaf, _) in self._names.items() if leaf in self.system.variable_leaves]
        return {"t": np.asarray(self.ts)} | {name: np.asarray(self[name]) for name in names}

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` with a column for each scalar variable, indexed by time."""
        import pandas as pd

        columns = {name: value for name, value in self.to_numpy().items() if value.ndim == 1 and name != "t"}
        return pd.DataFrame(columns, index=pd.Index(np.asarray(self.ts), name="t"))

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over time, with units as attributes."""
        import xarray as xr

        variables = {}
        for name, value in self.to_numpy().items():
            if name != "t":
                unit = self.system.flat.leaves[self._names[name][0]].declaration.unit
                dims = ["t", *(f"{name}_{i}" for i in range(value.ndim - 1))]
                variables[name] = xr.Variable(dims, value, {"units": unit})
        return xr.Dataset(variables, coords={"t": np.asarray(self.ts)})

    def plot(self, *names: str, axes: Any = None) -> Any:
        """Plot variables over time, one panel for each unit; returns the matplotlib axes."""
        from .._show.plot import plot_solution

        return plot_solution(self, names, axes)


@ft.lru_cache(maxsize=64)
def _names(system: System) -> dict[str, tuple[int, int]]:
    return {leaf.name(i): (number, i) for number, leaf in enumerate(system.flat.leaves) for i in range(leaf.count)}


@ft.partial(jax.jit, static_argnums=(0, 1))
def _trajectories(system: System, is_batched: bool, ts: Any, ys: Any, inputs: Inputs) -> list[Any]:
    def at(t: Any, y: Any, inputs: Inputs) -> list[Any]:
        if jnp.ndim(t) > 0:
            return jax.vmap(at, in_axes=(0, 0, None))(t, y, inputs)
        return observe(system, t, y, inputs, system.flat.variable_leaves)

    return (jax.vmap(at) if is_batched else at)(ts, ys, inputs)


START_REMEDY = "leave out the start value (zero) of this variable or of those that it is connected to rigidly."


def report_failure(solution: Solution, numbers: list[Any]) -> Solution:
    """Raise for a run that failed; under `jit`, when it is executed."""
    result = solution.result
    fine = (result == Result.reached_end) | (result == Result.stopped)
    if isinstance(fine, jax.core.Tracer):
        return eqx.tree_at(lambda s: s.t1, solution, _error_under_jit(solution, ~fine))
    if not np.all(fine):
        raise _error(solution, numbers)
    return solution


def _error_under_jit(solution: Solution, failed: Any) -> Any:
    system = solution.system
    t1 = solution.t1
    bad = solution.result == Result.bad_parameter
    if system.signed_leaves:
        texts = [_parameter_text(system, leaf) for leaf in system.signed_leaves]
        t1 = eqx.branched_error_if(t1, bad, solution.culprit, texts)
    return solution.result.error_if(t1, failed & ~bad)


def _parameter_text(system: System, leaf: int) -> str:
    flat_leaf = system.flat.leaves[leaf]
    assert flat_leaf.declaration.sign is not None
    return f"{flat_leaf.path} must be {flat_leaf.declaration.sign.name} (unit {flat_leaf.declaration.unit})."


def _error(solution: Solution, leaves: list[Any]) -> Exception:
    """The exception for a failed run with concrete numbers, naming where and what."""
    system = solution.system
    if solution.is_batched:
        codes = np.asarray(solution.result._value)
        return SimulationError(f"Some runs of the batch failed; pass throw=False and look at sol.result: {codes}.")
    if solution.result == Result.bad_parameter:
        leaf = system.signed_leaves[int(solution.culprit)]
        return ParameterError(f"{_parameter_text(system, leaf)} It is {leaves[leaf]}.")
    message = sentence(solution.result)
    if solution.result == Result.bad_start:
        name = constrained_names(system)[int(solution.culprit)]
        return SimulationError(f"{message} {name} cannot have the value it is given; {START_REMEDY}")
    where = f"At t = {float(solution.t_end):.6g} s: "
    if solution.result == Result.never_stopped:
        return SimulationError(where + message)
    culprit = _first_not_finite(solution)
    if culprit is not None:
        return SimulationError(f"{where}{sentence(Result.not_finite)} The first one is {culprit}.")
    state = dict(zip(system.state_names, np.asarray(solution.y_end).tolist(), strict=False))
    return SimulationError(f"{where}{message} The state is {state}.")


def _first_not_finite(solution: Solution) -> str | None:
    """The first variable that is not finite, at the last good state or a little further on."""
    system, t, y = solution.system, solution.t_end, solution.y_end
    rates = system.vector_field(t, y, solution.inputs)
    for ahead in (0.0, 1e-12, 1e-9, 1e-6, 1e-4):
        point = y + ahead * jnp.where(jnp.isfinite(rates), rates, 0.0)
        name = system.first_not_finite(t + ahead, point, solution.inputs)
        if name is not None:
            return name
    return None
