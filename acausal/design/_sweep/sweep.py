"""`sweep`: results of a model over a grid, a list or a sample of parameters."""

import dataclasses
import itertools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from ..._declare.component import Component
from ..._errors import ModelError, ParameterError
from ..._extras import Dataset, needed
from ..._integrate.setup.options import count
from ..._units.display import Scale
from ..._units.quantity import has_unit, magnitude
from .._compute.cores import CHUNK
from .._problem.distributions import Distribution, member_count, sobol_scores
from .._problem.free import Free
from .._problem.free_parameters import single_parameters
from .._problem.limits import objectives_of
from .._problem.types import ByPath, Executor, Function, number_in
from .batches import Batch, code_names
from .pieces import evaluated, store_of

M = TypeVar("M", bound=Component)
MOST = 50_000_000  # most members
LEAST = 32  # smallest default number of members of a piece
SWEPT = "Elements of arrays are swept"


@dataclasses.dataclass(frozen=True)
class Sample:
    """`n` members of a scrambled Sobol sequence, within bounds or from distributions by path."""

    of: ByPath[object]
    n: int
    seed: int = 0


@dataclasses.dataclass(frozen=True)
class SweepMembers:
    """The members of a sweep: rows of parameters, and the axes of a grid."""

    free: Free
    x: Float[np.ndarray, "n k"]
    axes: tuple[np.ndarray, ...] = ()


def sweep(
    model: Component,
    over: object,
    results: object,
    *,
    run: Function | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    chunk: int | None = None,
    progress: bool | None = None,
) -> Dataset:
    """Results of a model for many values of its parameters, as an `xarray.Dataset` with units.

        sweep(
            drive,
            {"gear.ratio": np.linspace(5.0, 20.0, 16), "motor.resistor.R": ["0.2 ohm", "0.4 ohm"]},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            store="ratios.zarr",
        )

    - `over`: values by path for a grid of all combinations; a list of dictionaries (or a `pandas.DataFrame`) with the
      values of each member; or a `Sample`. Values are in declared units, quantities, or texts with a unit.
    - `results`: a function of the run, with its display unit, or a dictionary of these by name. The dataset is in
      display units.
    - `run`: a function of the model that returns the argument of the other functions; by default the model.
    - `store`: a folder for the results (zarr). The same call resumes an interrupted sweep and reads a finished one. It
      raises an error if the parameters, the model, the run or the results have changed.
    - `executor`: an object with `submit`, such as those of `concurrent.futures` or `Client.get_executor()` of Dask; by
      default threads on all cores. An executor with processes needs functions that can be pickled.
    - `chunk`: members of a piece for the executor or the store, which is lost if the process is killed; by default 256,
      or fewer to keep all cores busy.
    - `progress`: whether to show a bar; by default on a terminal, and as a line every ten seconds in logs. The first
      failures are reported as they happen.

    The variable `code` is 0 for computed members and the reason of failure for others, named in its attributes; their
    results are nan. A keyboard interrupt ends the sweep with the finished members; the others have the code of
    "interrupted".

    Raises `ModelError` or `ParameterError` for invalid names, values and units, and for a store of another study;
    `SimulationError` if a worker dies.
    """
    objectives = objectives_of(results, "result")
    scales = {objective.name: objective.scale for objective in objectives}
    members = _members(model, over)
    batch = Batch(model, members.free, {objective.name: objective.function for objective in objectives}, run)
    names, owners = batch.columns
    _check_names(members, names)
    size = chunk_of(len(members.x)) if chunk is None else count(chunk, "chunk")
    kept = store_of(store, batch, names, members.x, size)
    outcomes = evaluated(batch, members.x, "sweep", executor=executor, chunk=size, store=kept, progress=progress)
    shown = [scales[owner] for owner in owners]
    return _dataset(members, names, shown, outcomes.values, outcomes.codes)


def _check_names(members: SweepMembers, results: Sequence[str]) -> None:
    """Raises `ModelError` for a result with the name of another column of the dataset."""
    taken = {"code": "the codes", **({} if members.axes else {"member": "the members"})}
    taken |= dict.fromkeys(members.free.names, "a parameter")
    for name in results:
        if name in taken:
            raise ModelError(f"{name!r} is the name of a result and of {taken[name]} of the sweep. Rename the result.")
    for name in members.free.names:
        if name in ("code", "member"):
            raise ModelError(
                f"The parameter {name!r} has the name of a column of the dataset. Rename it, or sweep a model that "
                "contains this one as a part."
            )


def chunk_of(n: int) -> int:
    """Members of a piece: four pieces for each core, within limits."""
    fair = -(-n // (4 * (os.cpu_count() or 1)))
    return int(np.clip(fair, LEAST, CHUNK))


def _members(model: Component, over: Any) -> SweepMembers:
    if isinstance(over, Sample):
        return _sampled(model, over)
    if hasattr(over, "to_dict") and not isinstance(over, Mapping):  # a table of pandas
        over = over.to_dict("records")
    if isinstance(over, Mapping):
        return _grid(model, over)
    if not isinstance(over, Sequence) or not over or not all(isinstance(row, Mapping) for row in over):
        raise ModelError(f"over must be a dictionary of values, a list of dictionaries or a Sample, got {over!r}.")
    return listed(model, over)


def _grid(model: Component, over: ByPath[object]) -> SweepMembers:
    free = single_parameters(model, over, SWEPT)
    axes = tuple(_axis(v.name, v.unit, values) for v, values in zip(free.variables, over.values(), strict=True))
    n = int(np.prod([float(len(axis)) for axis in axes]))
    if n > MOST:
        raise ModelError(f"A grid of {n} members is too large. Use a Sample.")
    return SweepMembers(free, np.array(list(itertools.product(*axes)), float).reshape(n, len(axes)), axes)


def _axis(name: str, unit: str, values: object) -> np.ndarray:
    given: Any = magnitude(values, unit, name) if has_unit(values) else values
    is_row = isinstance(given, list | tuple | range) or (hasattr(given, "shape") and np.ndim(given) == 1)
    if not is_row or not len(given):
        raise ParameterError(f"{name}: give a sequence of values, got {values!r}.")
    axis = np.array([number_in(value, unit, name)[0] for value in given])
    if not np.all(np.isfinite(axis)):
        raise ParameterError(f"{name}: values must be finite, got {values!r}.")
    return axis


def listed(model: Component, rows: Sequence[Mapping[Any, Any]]) -> SweepMembers:
    """Members given one by one, with the same names."""
    free = single_parameters(model, rows[0], SWEPT)
    for number, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            own, first = (", ".join(map(str, names)) for names in (row, rows[0]))
            raise ModelError(f"Member {number} names {own}, but the first member names {first}.")
    pairs = zip(free.variables, rows[0], strict=True)
    columns = [_axis(variable.name, variable.unit, [row[key] for row in rows]) for variable, key in pairs]
    return SweepMembers(free, np.stack(columns, axis=1))


def _sampled(model: Component, sample: Sample) -> SweepMembers:
    free = single_parameters(model, sample.of, SWEPT)
    scores = sobol_scores(len(free.variables), member_count(sample.n), sample.seed)
    columns = []
    given_values = zip(free.variables, sample.of.values(), free.values(model).tolist(), scores.T, strict=True)
    for variable, given, nominal, column in given_values:
        if isinstance(given, Distribution):
            columns.append(given.resolved(variable.unit, variable.name, nominal).of_score(column))
        else:
            low, high = _bounds(variable.name, variable.unit, given)
            columns.append(low + (high - low) * ndtr(column))
    return SweepMembers(free, np.stack(columns, axis=1))


def _bounds(name: str, unit: str, given: Any) -> tuple[float, float]:
    finite = isinstance(given, tuple) and len(given) == 2 and None not in given
    low, high = (number_in(bound, unit, name)[0] for bound in given) if finite else (np.nan, np.nan)
    if not (np.isfinite(high - low) and low < high):
        raise ParameterError(f"{name}: a sample needs two finite bounds, the lower one first, got {given!r}.")
    return low, high


def _dataset(
    members: SweepMembers, names: Sequence[str], scales: Sequence[Scale], values: np.ndarray, codes: np.ndarray
) -> Dataset:
    xr = needed("xarray", "tables", "A dataset")
    units = dict(zip(members.free.names, members.free.units, strict=True))
    shape = tuple(len(axis) for axis in members.axes) or (len(members.x),)
    dims = list(units) if members.axes else ["member"]
    good = codes == 0
    variables = {}
    for name, scale, column in zip(names, scales, values.T, strict=True):
        shown = np.where(good, scale.value(column), np.nan).reshape(shape)
        variables[name] = xr.Variable(dims, shown, {"units": scale.shown})
    meanings = " ".join(code_names())
    about = {"flag_values": list(range(len(code_names()))), "flag_meanings": meanings, "long_name": "why not computed"}
    variables["code"] = xr.Variable(dims, codes.reshape(shape), about)
    columns = members.axes or tuple(members.x.T)
    coords = {
        name: xr.Variable([name] if members.axes else ["member"], column, {"units": units[name]})
        for name, column in zip(units, columns, strict=True)
    }
    return xr.Dataset(variables, coords=coords)
