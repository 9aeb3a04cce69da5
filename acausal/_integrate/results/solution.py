"""The solution of a simulation, read by the names of the model."""

import functools as ft
import html
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import PyTreeDef
from jaxtyping import PyTree

from ..._declare.array import deepened
from ..._declare.by_name import parameters
from ..._declare.component import Component
from ..._declare.fields import as_parameter
from ..._declare.tree import as_html, as_text, branch
from ..._errors import ArgumentError, ModelError, UnknownNameError, listed, suggestion
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._extras import DataFrame, Dataset, Panels
from ..._jax_settings import check_precision
from ..._numbers import Numbers, Scalar
from ..._report import report
from ..._save_load import described
from ..._tracing import evaluated_now, is_traced, known
from ..._unit_check.signal_units import unit_of_leaf
from ..events.event_history import EventHistory
from ..events.extrema import Peak
from ..loop.carry import StepRecord
from ..programs.program_digest import equations_of
from ..setup.result import sentence
from ..setup.state_vector import StateVector
from ..setup.user_function import NOTHING, trace
from .checked import checked
from .columns import Item, columns, to_pandas, to_xarray
from .energy import EnergyAccount, energy_of
from .event_log import EventLog
from .over_run import OverRun
from .reading import Reading, within_run
from .trajectories import both_sides, chosen, over_batch, trajectories
from .unresolved import UnresolvedWarning, unresolved

M = TypeVar("M", bound=Component)
# Options of `simulate` with which a run computes a result itself
_WITHOUT_STEPS = {"integral": "integrals=...", "peak": "peaks=...", "energy account": "energy=True"}
_ROUGH = (
    "The estimated error of sol.integral(f) exceeds rtol: f varies too fast, or is as small as rounding errors. "
    "Remedy: integrate it with the states, simulate(..., integrals=f)."
)
_OUTSIDE = "sol.at(t) takes times within the run. Remedy: simulate longer, or limit t to the end of the run."


class Solution(eqx.Module, Generic[M]):
    """Trajectories of all variables of a model.

    `sol["motor.emf.w"]` and `sol.motor.emf.w` are the values at the saved times `sol.ts`. A parameter has its value.
    `sol.values`, `sol.final` and `sol.at(t)` are the model with the values at the saved times, at the end, and at any
    time. Editors and type checkers know their type, so they complete `sol.values.motor.emf.w` but not `sol.motor`.

    - `t1`: the time at which the run ended; infinite if the stop condition was never met.
    - `result`: a `Result`; `stats`: numbers of steps.
    """

    t1: Array
    result: Any
    stats: dict[str, Scalar]
    _start: tuple[Array, Array]  # time and state vector
    _end: tuple[Array, Array]
    _path: tuple[Array, Array] | None  # at the requested times, infinite after the end; None: at the steps
    _end_integrals: Array
    _culprit: Array  # index of the demand, parameter, start value or block that caused a failure
    _not_finite: tuple[Array, Array]  # first saved time and vector with a variable that is not finite, if any
    _params: dict[int, Array]  # parameters of the model, by leaf number
    _inputs: Inputs
    _record: StepRecord | None  # the recorded steps
    _losses: Array  # energy lost at each event
    _peaks: Array  # values, then times
    _errors: Array  # errors of the states in the last step, in tolerances
    _largest: Array  # largest absolute values of the states in the run
    _blurred: Array  # largest event indicators of relations within the tolerance, zero for all others
    _unresolved: Array  # mask of states that are too small for the tolerance
    _history: EventHistory | None  # the event history
    system: System = eqx.field(static=True)
    _solver: diffrax.AbstractSolver = eqx.field(static=True)
    _layout: StateVector = eqx.field(static=True)
    _numbers: dict[str, Array | None]  # numeric options of the run
    _choices: tuple[tuple[str, str | int | None], ...] = eqx.field(static=True)  # static options
    _demands: tuple[str, ...] = eqx.field(static=True)  # requirements on options
    _peaks_tree: PyTreeDef = eqx.field(static=True)  # NOTHING if none were requested
    _integrals_tree: PyTreeDef = eqx.field(static=True)
    _final: dict[int, Array] | None = None  # the values at the end, if they came with the run

    @property
    def is_batched(self) -> bool:
        """Whether the solution holds several runs."""
        return jnp.ndim(self.t1) > 0

    @property
    def ts(self) -> Array | np.ndarray:
        """The saved times. A single solution omits those that the run did not reach."""
        return self._saved(None)

    @property
    def ys(self) -> Array | np.ndarray:
        """The state vector at the saved times; see `sol.system.state_names`."""
        return self._saved(slice(len(self.system.nominals)))

    def _saved(self, columns: slice | None) -> Array | np.ndarray:
        """The saved times, or columns of the state vectors there. A single solution saved at its steps includes the
        rows before each event.
        """
        check_precision()
        record, forward = self._record, self._forward
        if self._path is not None:
            ts, ys = self._path
        else:
            assert record is not None
            ts, ys = forward[..., None] * record.ts, record.ys
        rows, times = ts if columns is None else ys[..., columns], known(ts)
        if self.is_batched or times is None:
            return rows
        if self._path is not None or record is None:
            return chosen(rows, np.isfinite(times))
        before = forward * record.moments if columns is None else record.befores[:, columns]
        return both_sides(rows, before, *map(np.asarray, (known(record.ts), known(record.moments))))

    @property
    def _forward(self) -> Any:
        """1, or -1 for a run backwards in time."""
        t0, t1 = self._numbers["t0"], self._numbers["t1"]
        assert t0 is not None
        assert t1 is not None
        xp = jnp if is_traced(t0) or is_traced(t1) else np
        return xp.broadcast_to(xp.where(xp.less(t1, t0), -1.0, 1.0), jnp.shape(self.t1))

    @property
    def _rtol(self) -> Any:
        rtol = self._numbers["rtol"]
        assert rtol is not None
        return (jnp if is_traced(rtol) else np).broadcast_to(rtol, jnp.shape(self.t1))

    @property
    def values(self) -> M:
        """The model with trajectories as the values of its variables."""
        with evaluated_now(self):
            return self._view(self._saved(None), self._saved(self._layout.point))

    @property
    def final(self) -> M:
        """The model with the values of its variables at the end of the run."""
        return self._view(*self._end) if self._final is None else self._model(self._end[0], self._final)

    def at(self, t: Numbers) -> M:
        """The model with the values of its variables at time(s) `t` in s, from the dense output of the steps.

        Raises `ModelError`, or `RuntimeError` under `jit`, for a time outside the run, or outside a run of a batch.
        """
        record = self._dense("value at a time")
        reading, batch = Reading(self.system, self._solver, self._layout), jnp.shape(self.t1)
        t = as_parameter(t, unit="s", where="t")

        def read(record: StepRecord, inputs: Inputs, forward: Numbers) -> Any:
            times, are_outside = within_run(forward * jnp.ravel(t), record)
            found = reading.at(times, record, inputs, forward)[:, self._layout.point]
            return found.reshape(*t.shape, found.shape[1]), are_outside

        with evaluated_now(self, t):
            points, are_outside = over_batch(read, len(batch))(record, self._inputs, self._forward)
        is_outside = known(jnp.any(are_outside))
        if is_outside is None:
            points = checked(points, jnp.any(are_outside), jnp.asarray(0), [_OUTSIDE])
        elif is_outside:
            raise ModelError(f"{_OUTSIDE} The run covers {self._span}." if not batch else _OUTSIDE)
        return self._view(jnp.broadcast_to(t, batch + t.shape), points)

    @property
    def _span(self) -> str:
        return f"{float(self._start[0]):.6g} s to {float(self._end[0]):.6g} s"

    def _view(self, ts: Numbers, ys: Numbers) -> M:
        check_precision()
        return self._model(ts, trajectories(self.system, jnp.ndim(self.t1), ts, ys, self._inputs))

    def _model(self, ts: Numbers, numbers: Mapping[int, Numbers]) -> M:
        """The model with values of its variables at times, by leaf number."""
        batch = jnp.ndim(self.t1)
        leaves = [numbers[i] if i in numbers else self._params[i] for i in range(len(self.system.flat.own_leaves))]
        # All leaves of an array of components need the time axis, so that it can be indexed.
        for i, flat_leaf in enumerate(self.system.flat.own_leaves):
            if i not in numbers and flat_leaf.stack:
                along = jnp.expand_dims(leaves[i], range(batch, jnp.ndim(ts)))
                leaves[i] = jnp.broadcast_to(along, jnp.shape(ts) + jnp.shape(leaves[i])[batch:])
        return deepened(self.system.flat.structure.unflatten(leaves), jnp.ndim(ts))

    @property
    def events(self) -> EventLog:
        """The event log of the run; `print` it for a table. Empty if no component states events."""
        events = self.system.events
        if self._history is None or events is None:
            return EventLog.empty(jnp.shape(self.t1))
        return EventLog.from_history(self._history, events, int(dict(self._choices)["max_events"] or 0))

    @property
    def unresolved(self) -> dict[str, float]:
        """Variables that are too small for the error tolerance, with their largest values.

        A variable is listed if it stays below a hundredth of its nominal size and the errors of all steps sum to more
        than a hundredth of its largest value. It is also listed if an `ifelse` compares it and the difference stays
        within `rtol` times its nominal size, so that the `ifelse` changes once and not back. Pass the values listed as
        `nominal` sizes to make these variables as accurate as the others.
        """
        return unresolved(self)

    @property
    def integrals(self) -> PyTree:
        """Trajectories of the `integrals` of `simulate`."""
        return self._integrals(self._saved(self._layout.integrals))["user"]

    def _integrals(self, columns: Array | np.ndarray) -> PyTree:
        if self._integrals_tree == NOTHING:
            raise ModelError("Only the states were integrated: pass integrals=... or energy=True to simulate.")
        return self._integrals_tree.unflatten([chosen(columns, (..., i)) for i in range(columns.shape[-1])])

    @property
    def peaks(self) -> PyTree:
        """Maxima over the run of the `peaks` of `simulate`, each a `Peak` with `value` and `time`."""
        if self._peaks_tree == NOTHING:
            raise ModelError("No peaks were requested: pass peaks=... to simulate.")
        n = self._peaks_tree.num_leaves
        values, times = self._peaks[..., :n], self._peaks[..., n:]
        return self._peaks_tree.unflatten([Peak(values[..., i], times[..., i]) for i in range(n)])

    def integral(self, function: Callable[[M], PyTree]) -> PyTree:
        """The integral over the run of a real function of the variables, or of several in a dictionary (any pytree).

        It is computed from the recorded steps. Steps are divided until the function is resolved to a hundredth of
        `rtol`, also at kinks, jumps and spikes within a step; spikes narrower than a twentieth of a step may be missed.
        First derivatives go through kinks. At a jump of the function, as in `jnp.where(s.x > 0.9, 1.0, 0.0)`, the time
        of the jump has no derivative, as with `integrals=` of `simulate`.

        If the estimated error exceeds `rtol`, it warns with `UnresolvedWarning`; within `jit`, `vmap` and `grad`, it
        raises `RuntimeError`.
        """
        return self._integrals_over_run(function, alike=False)

    def _integrals_over_run(self, function: Callable[[M], PyTree], *, alike: bool) -> PyTree:
        """See `integral`. The errors of `alike` functions are compared with the largest of their integrals."""
        found, tree = self._over_run(
            function, "energy account" if alike else "integral", ft.partial(OverRun.integral, alike=alike)
        )
        size = jnp.max(found.size, axis=-1, keepdims=True, initial=0.0) if alike else found.size
        is_bad = found.error > self._rtol[..., None] * size
        is_any, values = known(jnp.any(is_bad)), found.value
        if is_any is None:
            values = checked(values, jnp.any(is_bad), jnp.asarray(0), [_ROUGH])
        elif is_any:
            warnings.warn(_ROUGH, UnresolvedWarning, stacklevel=3)
        return tree.unflatten([values[..., i] for i in range(tree.num_leaves)])

    def peak(self, function: Callable[[M], PyTree]) -> PyTree:
        """The maximum over the run of a real function of the variables, or of several in a dictionary (any pytree):
        each a `Peak` with `value` and `time`. For the minimum, pass the negative function.
        """
        (values, times), tree = self._over_run(function, "peak", OverRun.peak)
        return tree.unflatten([Peak(values[..., i], times[..., i]) for i in range(tree.num_leaves)])

    def _over_run(
        self, function: Callable[[M], PyTree], what: str, compute: Callable[[OverRun], Any]
    ) -> tuple[Any, PyTreeDef]:
        """The result of `compute` for a function over the run, and the pytree structure of the function."""
        record, reading = self._dense(what), Reading(self.system, self._solver, self._layout)
        traced, constants = trace(function, self.system.flat, what)
        params: dict[int, Numbers] = {i: self._params[i] for i in traced.leaves if i in self._params}

        def of_run(
            params: dict[int, Numbers], record: StepRecord, inputs: Inputs, forward: Numbers, rtol: Numbers
        ) -> Any:
            return compute(OverRun(reading, traced, constants, params, record, inputs, forward, rtol))

        numbers = params, record, self._inputs, self._forward, self._rtol
        with evaluated_now(self, constants):
            return over_batch(of_run, jnp.ndim(self.t1))(*numbers), traced.tree

    def _dense(self, wanted: str) -> StepRecord:
        """The recorded steps with dense output. Raises `ModelError` if the run has none."""
        check_precision()
        if self._record is None or self._record.infos is None:
            also = (
                f", or simulate(..., {_WITHOUT_STEPS[wanted]}), which needs no steps"
                if wanted in _WITHOUT_STEPS
                else ""
            )
            raise ModelError(
                f"The {wanted} needs the dense output of the steps, which the run did not save. Remedy: "
                f'simulate(..., save="dense"), which also saves it within jit, vmap and grad{also}.'
            )
        return self._record

    @property
    def energy(self) -> EnergyAccount:
        """The energy account of the run, integrated with the states if `energy=True` was passed. Otherwise it is
        computed from the recorded steps, and all energy lost at one instant goes to the first listed event there.
        """
        return energy_of(self)

    def __getitem__(self, name: str) -> Array:
        """The trajectory of a variable or the value of a parameter by its path, such as `"stages[0].gear.ratio"`."""
        return self._pick(jax.tree_util.tree_leaves(self.values), name)

    def _pick(self, leaves: list[Array], name: str) -> Array:
        """The value of a name in the leaves of a view."""
        number, place = self._place(name)
        value, leaf = leaves[number], self.system.flat.leaves[number]
        lead = value.ndim - len(leaf.stack) - len(leaf.sizes)
        return value[(slice(None),) * lead + place] if place else value

    def _place(self, name: str) -> tuple[int, tuple[int, ...]]:
        """The leaf of a name, and the index of its stacked member or element."""
        names = self.system.flat.leaf_names
        if not isinstance(name, str):
            raise ArgumentError(f"A solution is read by path, as in sol[{next(iter(names))!r}], got sol[{name!r}].")
        where = self.system.flat.find(name)
        if where is None:
            hint = suggestion(name, names)
            raise UnknownNameError(f"The model has no variable or parameter {name!r}.{hint}")
        return where

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in type(self).__dataclass_fields__:
            raise AttributeError(name)
        if name in self.system.flat.root_fields:
            return getattr(self.values, name)
        hint = suggestion(name, self.system.flat.root_fields)
        raise UnknownNameError(f"Neither the solution nor the model has an attribute {name!r}.{hint}")

    def __repr__(self) -> str:
        if self._cannot_be_shown:
            return f"<Solution of {self.system.name}: t1 of shape {jnp.shape(self.t1)}>"
        ends = f"t1 = {float(self.t1):.6g} s. {sentence(self.result)}"
        small = {} if known(self._unresolved) is None else self.unresolved
        said = f" Not resolved: {listed(list(small))}." if small else ""
        return f"<Solution of {self.system.name}: {len(self.ts)} saved times, {ends}{said}>"

    def __str__(self) -> str:
        """The outcome of the run, and the values at its end as a tree, with units."""
        if self._cannot_be_shown:
            return repr(self)
        return f"{repr(self)[1:-1]}\nAt the end:\n{as_text(branch(self.final))}"

    def _repr_html_(self) -> str:
        """The same for a notebook, as a collapsible tree."""
        said = f"<div>{html.escape(repr(self)[1:-1])}</div>"
        return said if self._cannot_be_shown else f"{said}<div>At the end:</div>{as_html(branch(self.final))}"

    @property
    def _cannot_be_shown(self) -> bool:
        return self.is_batched or is_traced(self.t1)

    def keys(self) -> list[str]:
        """The paths of all variables and parameters, which `sol[path]` takes."""
        return list(self.system.flat.leaf_names)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.system.flat.find(name) is not None

    def _ipython_key_completions_(self) -> list[str]:
        return self.keys()

    def unit(self, name: str) -> str:
        """The unit of a variable or parameter. A signal has that of the sensor or the source to which it is connected,
        or "" if none has a unit.
        """
        return unit_of_leaf(self.system.flat, self._place(name)[0])

    @property
    def options(self) -> dict[str, object]:
        """The options of `simulate`: times, tolerances, limits, solver."""
        return {**self._numbers, **dict(self._choices)}

    def _described(self) -> dict[str, object]:
        """The description stored in a saved file."""
        return {
            "model": self.system.name,
            "equations": equations_of(self.system),
            "parameters": described(parameters(self.final)),
            "options": {name: value for name, value in self.options.items() if value is not None},
            "t1": self.t1,
            "result": None if self._cannot_be_shown else sentence(self.result),
        }

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.system.flat.root_fields]

    def to_numpy(self) -> dict[str, np.ndarray]:
        """Trajectories of all variables by name, and the time as "t"."""
        return {"t": np.asarray(self.ts)} | {column.label: column.values for column in columns(self, (), ())}

    def to_pandas(self, *items: Item, units: Sequence[str] = ()) -> DataFrame:
        """A `pandas.DataFrame` with a column for each element of each variable, indexed by time. `attrs["units"]` has
        the units.

        `items` and `units` are as in `plot`; without items, all variables.
        """
        return to_pandas(self, items, units)

    def to_xarray(self, *items: Item, units: Sequence[str] = ()) -> Dataset:
        """An `xarray.Dataset` over time, with units as attributes; `items` and `units` are as in `plot`."""
        return to_xarray(self, items, units)

    def plot(
        self,
        *items: Item | list[Item],
        units: Sequence[str] = (),
        events: bool | str | Sequence[str] = True,
        axes: Panels | None = None,
    ) -> np.ndarray:
        """Draw variables over time, one panel for each unit; returns the matplotlib axes.

        A list of items is a panel of its own, as in `plot(["target.y.value", "load.a.s"], "load.v")`. In it, signals
        without a known unit have that of the others.

        - `items`: paths, scalar functions of the variables, either with its unit, as in `("load.a.s", "mm")`, or a
          dictionary of these by label, such as `{"shaft power": lambda s: s.load.w * s.spring.tau}`. Discrete variables
          whose class names their values, such as those of friction and stops, are bands in a panel of their own.
          Without items: the states, and those of these variables that change.
        - `units`: units for the variables of their dimension, such as `["rpm", "bar"]`; the others are in SI.
        - `events`: whether dotted lines mark the times of events that are not periodic, or the names of the parts or
          the kinds of events to mark, such as "brake" or ["stick", "impact"].
        """
        from .solution_plot import plot_solution

        return plot_solution(self, items, units, events, axes)

    def html(self, path: str | os.PathLike[str] | None = None, *items: Item, units: Sequence[str] = ()) -> str:
        """A report as one HTML file that loads nothing from elsewhere; returns its text, and writes it to a path.

        It has the outcome of the run, the picture of `plot` with the same `items` and `units`, events, energy, values
        with units, and the versions and fingerprints that identify the model. `report` combines several results.
        """
        return report(f"Solution of {self.system.name}", self._report(items, units), path)

    def _report(self, items: Sequence[Item] = (), units: Sequence[str] = ()) -> dict[str, object]:
        from .solution_report import parts

        return parts(self, items, units)
