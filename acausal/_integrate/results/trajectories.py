"""Trajectories of all variables, from the saved state vectors of a run."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._evaluate.observe import all_values_of
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._tracing import are_traced, evaluated_now, is_traced, within_transformation
from ..programs.program_digest import digest_of
from ..programs.stored_program import result_of

NUMBERS = (128, 1024)  # larger sizes, and those inside transformations, are powers of two
LEAST = 16


def shared(n: int) -> np.ndarray:
    """The indices of n rows, padded with the last index to the number of rows of a program."""
    rounded = max(LEAST, 1 << (n - 1).bit_length())
    if not within_transformation():
        rounded = next((number for number in NUMBERS if number >= n), rounded)
    return np.minimum(np.arange(rounded), n - 1)


def chosen(rows: Array | np.ndarray, which: Any) -> Array | np.ndarray:
    """The rows selected by an index. Known rows are selected with numpy, because jax compiles for each number of rows,
    even for `jnp.asarray` of them.
    """
    if is_traced(rows) or isinstance(rows, np.ndarray):
        return rows[which]
    return jax.device_put(np.asarray(rows)[which])


def both_sides(rows: Array | np.ndarray, before: Array | np.ndarray, times: np.ndarray, moments: np.ndarray) -> Any:
    """The rows at the times reached and those before the events at `moments`, in chronological order.

    `times` and `moments` count forwards. Rows before the start are omitted.
    """
    reached, shown = np.isfinite(times), np.isfinite(moments) & (moments > times[0])
    order = np.lexsort(
        (np.repeat([0, 1], [np.sum(shown), np.sum(reached)]), np.concatenate([moments[shown], times[reached]]))
    )
    rows, before = chosen(rows, reached), chosen(before, shown)
    xp = jnp if is_traced(before) or is_traced(rows) else np
    return xp.concatenate([before, rows])[order]


def over_batch(function: Callable[..., PyTree], dimensions: int) -> Callable[..., PyTree]:
    """The function mapped over the leading axes of all its arguments."""
    return function if dimensions == 0 else jax.vmap(over_batch(function, dimensions - 1))


def trajectories(system: System, batch: int, ts: Any, ys: Any, inputs: Inputs) -> dict[int, Array]:
    """The values of the variables of a model at times and state vectors, by leaf number.

    The first `batch` axes of all arrays are those of a batch of runs.
    """
    spread = _all_values(system).leaves
    if batch or np.ndim(ts) != 1 or not len(ts) or are_traced(ts, ys, inputs):
        found = result_of(_Trajectories(system, batch), (ts, ys, inputs))
        if not are_traced(found):
            return jax.device_put(spread(ts, np.asarray(found)))
        return jax.tree.map(jnp.asarray, spread(ts, found))
    vectors = [_block(system, np.asarray(t), np.asarray(y), inputs) for t, y in _blocks(ts, ys)]
    return jax.device_put(spread(ts, np.concatenate(vectors)))


def first_bad_row(system: System, ts: Any, ys: Any, inputs: Inputs) -> int | None:
    """The index of the first known point at which a variable is not finite; None if there is none.

    Parameters and discrete variables are not checked: an infinite time may mean "never".
    """
    first, count = 0, _all_values(system).count
    for t, y in _blocks(ts, ys):
        is_bad = ~np.all(np.isfinite(_block(system, np.asarray(t), np.asarray(y), inputs)[:, :count]), axis=1)
        if np.any(is_bad):
            return first + int(np.argmax(is_bad))
        first += len(t)
    return None


def _blocks(ts: Any, ys: Any) -> Iterator[tuple[Any, Any]]:
    """The rows in blocks of the size for which programs are compiled."""
    for i in range(0, len(ts), NUMBERS[-1]):
        yield ts[i : i + NUMBERS[-1]], ys[i : i + NUMBERS[-1]]


def _block(system: System, ts: np.ndarray, ys: np.ndarray, inputs: Inputs) -> np.ndarray:
    """The vectors of values at one block of known points."""
    rows = shared(len(ts))
    with evaluated_now():
        return np.asarray(result_of(_Trajectories(system, 0), (ts[rows], ys[rows], inputs)))[: len(ts)]


_all_values = ft.lru_cache(maxsize=64)(all_values_of)


@dataclasses.dataclass(frozen=True)
class _Trajectories:
    """The vectors of `trajectories` as a function of numbers only."""

    system: System
    batch: int

    @property
    def name(self) -> str:
        return "trajectories"

    @ft.partial(jax.jit, static_argnums=0)
    def __call__(self, arguments: tuple[Numbers, Numbers, Inputs]) -> Array:
        vector = _all_values(self.system).vector

        def at(t: Numbers, y: Array, inputs: Inputs) -> Array:
            return jax.vmap(at, in_axes=(0, 0, None))(t, y, inputs) if jnp.ndim(t) > 0 else vector(t, y, inputs)

        return over_batch(at, self.batch)(*arguments)

    def steps(self, arguments: tuple[Any, Any, Inputs]) -> int:
        return arguments[0].size

    def contents(self, arguments: tuple[Any, Any, Inputs]) -> list[object]:
        return [arguments[2].given, digest_of(self.system), self.batch]
