"""Trajectories of all variables from the vectors that a run has saved."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._evaluate.observe import observe
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._numbers import Numbers
from .._tracing import is_traced, known
from .event_history import EventHistory
from .made_from import digest_of
from .stored_program import result_of


def both_sides(
    rows: Array | np.ndarray, times: np.ndarray, start: Array, history: EventHistory | None, columns: slice | None
) -> Array | np.ndarray:
    """The rows saved at times that were reached, and where steps are saved, those before each event.

    `columns` are theirs in the vector that is stepped; None where the rows are the times themselves.
    """
    reached = np.isfinite(times)
    times, rows = times[reached], chosen(rows, reached)
    if history is None or not history.before.shape[-1]:
        return rows
    moments, numbers, first = known(history.times), known(history.numbers), known(start)
    assert moments is not None
    assert numbers is not None
    assert first is not None
    # Of events at one instant, only the first one shows what was before; what was before the start is not shown.
    shown = (numbers >= 0) & np.concatenate([[True], moments[1:] > moments[:-1]]) & (moments > first)
    before = chosen(history.times if columns is None else history.before[:, columns], shown)
    order = np.lexsort((np.repeat([0, 1], [len(before), len(times)]), np.concatenate([moments[shown], times])))
    xp = jnp if is_traced(before) or is_traced(rows) else np
    return xp.concatenate([before, rows])[order]


def chosen(rows: Array | np.ndarray, which: Any) -> Array | np.ndarray:
    """What an index chooses. Outside of transformations numpy does: jax compiles anew for each number of rows, also for
    `jnp.asarray` of them.
    """
    if is_traced(rows) or isinstance(rows, np.ndarray):
        return rows[which]
    return jax.device_put(np.asarray(rows)[which])


def over_batch(function: Callable[..., PyTree], dimensions: int) -> Callable[..., PyTree]:
    """The function mapped over leading axes of all its arguments."""
    return function if dimensions == 0 else jax.vmap(over_batch(function, dimensions - 1))


def trajectories(system: System, batch: int, ts: Numbers, ys: Numbers, inputs: Inputs) -> dict[int, Array]:
    """The values of the variables of a model, by the numbers of their leaves, at times and state vectors.

    `batch` leading axes of all of them are those of a batch of runs.
    """
    return result_of(_Trajectories(system, batch), (ts, ys, inputs))


@dataclasses.dataclass(frozen=True)
class _Trajectories:
    """`trajectories` as a function of numbers alone."""

    system: System
    batch: int

    @property
    def name(self) -> str:
        return "trajectories"

    def __call__(self, given: tuple[Numbers, Numbers, Inputs]) -> dict[int, Array]:
        return _traced(self.system, self.batch, *given)

    def contents(self, given: tuple[Any, Any, Inputs]) -> list[object]:
        return [given[2].given, digest_of(self.system), self.batch]

    def held(self) -> dict[str, Any]:
        return {}


@ft.partial(jax.jit, static_argnums=(0, 1))
def _traced(system: System, batch: int, ts: Array, ys: Array, inputs: Inputs) -> dict[int, Array]:
    def at(t: Numbers, y: Array, inputs: Inputs) -> dict[int, Numbers]:
        if jnp.ndim(t) > 0:
            return jax.vmap(at, in_axes=(0, 0, None))(t, y, inputs)
        leaves = system.flat.variable_leaves
        values = dict(zip(leaves, observe(system, t, y, inputs, leaves), strict=True))
        return values | system.carried.discrete_values(y, inputs)

    return over_batch(at, batch)(ts, ys, inputs)
