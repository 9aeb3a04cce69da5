"""Results of many members of a model in batches, from one compiled program."""

import collections
import functools as ft
import threading
import uuid
from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int, PyTree

from .._declare.component import Component
from .._equinox_private import members_of
from .._integrate.failure import trials
from .._integrate.result import Result, is_success, sentence
from .._progress import compiling
from .._reduce.jaxpr import arrays_in
from ._free import Free
from ._program import Function, Program

LOCKSTEP = 32  # members that are stepped together; more of them wait for the slowest one, and no longer fit the cache
CHUNK = 256  # members of a task
COMPUTED, NOT_FINITE = 0, len(Result)  # codes; in between are those of failed runs, as `Result` counts them
PROGRAMS = 16  # that a process keeps
_making = threading.Lock()

Piece = tuple[np.ndarray, np.ndarray]  # results and codes


class Outcomes(NamedTuple):
    """Results of members, row by row, and a code for each member that says whether they were computed."""

    values: Float[np.ndarray, "n m"]
    codes: Int[np.ndarray, " n"]

    @property
    def are_good(self) -> Bool[np.ndarray, " n"]:
        return self.codes == COMPUTED

    @property
    def failed(self) -> dict[str, int]:
        """How many members failed, by reason."""
        counts = collections.Counter(self.codes[~self.are_good].tolist())
        return {code_names()[code]: number for code, number in sorted(counts.items())}


def code_names() -> tuple[str, ...]:
    """What the codes are called, in their order."""
    return ("computed", *list(members_of(Result))[1:], "no_finite_result")


def said(code: int) -> str:
    """A sentence on a code."""
    if code == COMPUTED:
        return "The results were computed."
    return (
        "A result is not a finite number." if code == NOT_FINITE else sentence(list(members_of(Result).values())[code])
    )


class Task:
    """Rows of numbers to rows of results and codes: what a worker does. It can be sent to another process.

    A copy that was sent is the same task, and finds the program that the process has compiled for it.
    """

    def __init__(
        self, model: Component, free: Free, functions: Mapping[str, Function], run: Function | None = None
    ) -> None:
        self.model, self.free, self.functions, self.run = model, free, dict(functions), run
        self._key = uuid.uuid4().hex

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Task) and other._key == self._key

    def __hash__(self) -> int:
        return hash(self._key)

    def __call__(self, x: Float[np.ndarray, "n k"], side: int = LOCKSTEP) -> Piece:
        """Results and codes of some members, of which `side` at most go side by side."""
        found = [self._piece(x[start : start + CHUNK], side) for start in range(0, len(x), CHUNK)]
        values, codes = (np.concatenate([pair[i] for pair in found]) for i in range(2))
        return values, codes

    def columns(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of the results, and which function each of them is from."""
        program, row = Program(self.model, self.free, self.functions, self.run), self.free.values(self.model)
        with trials():
            jax.eval_shape(lambda x: program.results(self.free.with_values(self.model, x)), row)
        return program.names, program.owners

    def lowered(self) -> tuple[str, list[np.ndarray]]:
        """The program for a batch of one member, as XLA is given it (StableHLO), and the arrays that it holds.

        The numbers of the model are arguments of it.
        """
        program, row = Program(self.model, self.free, self.functions, self.run), self.free.values(self.model)
        arrays, rest = eqx.partition(self.model, eqx.is_array)

        @jax.jit
        def batch(arrays: PyTree, rows: Array) -> tuple[Array, Array]:
            return jax.vmap(lambda row: _one(program, eqx.combine(arrays, rest), row))(rows)

        with trials():
            traced = batch.trace(arrays, row[None])
            return traced.lower().as_text(), [np.asarray(array) for array in arrays_in(traced.jaxpr)]

    def _piece(self, x: np.ndarray, size: int) -> Piece:
        """At most `CHUNK` members; those that fill the last batch up are copies."""
        batches = -(-len(x) // size)
        room = size * (CHUNK // size)
        filled = np.concatenate([x, np.repeat(x[-1:], room - len(x), axis=0)])
        with _making:
            function = _compiled(self)
        with trials(), compiling("a batch of runs", self.model, function):
            values, codes = function(filled.reshape(room // size, size, -1), batches)
        return np.asarray(values).reshape(room, -1)[: len(x)], np.asarray(codes).ravel()[: len(x)]


class _Program:
    """The compiled program of a task, for at most `CHUNK` members in batches."""

    def __init__(self, task: Task) -> None:
        program = Program(task.model, task.free, task.functions, task.run)
        arrays, rest = eqx.partition(task.model, eqx.is_array)
        width = len(task.columns()[0])

        @jax.jit
        def all_batches(arrays: PyTree, x: Array, batches: Array) -> PyTree:
            model = eqx.combine(arrays, rest)

            def step(i: Array, found: PyTree) -> PyTree:
                batch = jax.vmap(lambda row: _one(program, model, row))(x[i])
                return tuple(whole.at[i].set(part) for whole, part in zip(found, batch, strict=True))

            empty = jnp.zeros((*x.shape[:2], width)), jnp.zeros(x.shape[:2], "int32")
            # The number of batches is an argument, so that one program serves pieces of any length.
            return jax.lax.fori_loop(0, batches, step, empty)

        self._function = ft.partial(all_batches, arrays)
        self._first, self._is_compiled = threading.Lock(), False

    def __call__(self, x: np.ndarray, batches: int) -> PyTree:
        # The first piece compiles the program; pieces begun with it would do so again, each in its thread.
        with self._first:
            if not self._is_compiled:
                found = jax.block_until_ready(self._function(x, batches))
                self._is_compiled = True
                return found
        return self._function(x, batches)


_compiled = ft.lru_cache(maxsize=PROGRAMS)(_Program)


def _one(program: Program, model: Component, row: Array) -> tuple[Array, Array]:
    values, results = program.results(program.free.with_values(model, row))
    code = jnp.where(jnp.all(jnp.isfinite(values)), COMPUTED, NOT_FINITE)
    for result in results:
        number = jax.tree_util.tree_leaves(result)[0]
        code = jnp.where(is_success(result), code, number)
    return values, code.astype("int32")
