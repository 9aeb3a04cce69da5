"""Results of many members of a model, from one compiled program, in batches on all cores."""

import collections
import concurrent.futures
import functools as ft
import os
import uuid
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._declare.component import Component
from .._equinox_private import members_of
from .._integrate.failure import trials
from .._integrate.result import Result, is_success, sentence
from .._progress import compiling
from ._free import Free
from ._program import Function, Program

LOCKSTEP = 32  # members that are stepped together: of more, most wait for the slowest, and they leave the cache
CHUNK = 256  # members of a task
COMPUTED, NOT_FINITE = 0, len(Result)  # codes; in between are those of failed runs, as `Result` counts them
PROGRAMS = 16  # that a process keeps

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

    def __call__(self, x: Float[np.ndarray, "n k"]) -> Piece:
        """Results and codes of some members."""
        size = min(LOCKSTEP, len(x)) if len(x) < CHUNK else LOCKSTEP
        found = [self._piece(x[start : start + CHUNK], size) for start in range(0, len(x), CHUNK)]
        values, codes = (np.concatenate([pair[i] for pair in found]) for i in range(2))
        return values, codes

    def columns(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of the results, and which function each of them is from."""
        program, row = Program(self.model, self.free, self.functions, self.run), self.free.values(self.model)
        with trials():
            jax.eval_shape(lambda x: program.results(self.free.with_values(self.model, x)), row)
        return program.names, program.owners

    def _piece(self, x: np.ndarray, size: int) -> Piece:
        """At most `CHUNK` members; those that fill the last batch up are copies."""
        batches = -(-len(x) // size)
        room = CHUNK if size == LOCKSTEP else size
        filled = np.concatenate([x, np.repeat(x[-1:], room - len(x), axis=0)])
        function = _compiled(self)
        with trials(), compiling("a batch of runs", self.model, function):
            values, codes = function(filled.reshape(room // size, size, -1), batches)
        return np.asarray(values).reshape(room, -1)[: len(x)], np.asarray(codes).ravel()[: len(x)]


@ft.lru_cache(maxsize=PROGRAMS)
def _compiled(task: Task) -> Callable[[Any, int], Any]:
    """The program of a task, for at most `CHUNK` members in batches."""
    program = Program(task.model, task.free, task.functions, task.run)
    arrays, rest = eqx.partition(task.model, eqx.is_array)

    @jax.jit
    def all_batches(arrays: Any, x: Any, batches: Any) -> Any:
        model = eqx.combine(arrays, rest)

        def batch(rows: Any) -> Any:
            return jax.vmap(lambda row: _one(program, model, row))(rows)

        empty = jax.tree_util.tree_map(lambda s: jnp.zeros(s.shape, s.dtype), jax.eval_shape(jax.vmap(batch), x))

        def step(i: Any, found: Any) -> Any:
            return jax.tree_util.tree_map(lambda whole, part: whole.at[i].set(part), found, batch(x[i]))

        # As many batches as there are, so that one program does for pieces of any length.
        return jax.lax.fori_loop(0, batches, step, empty)

    return lambda x, batches: all_batches(arrays, x, batches)


def _one(program: Program, model: Component, row: Any) -> tuple[Any, Any]:
    values, results = program.results(program.free.with_values(model, row))
    code = jnp.where(jnp.all(jnp.isfinite(values)), COMPUTED, NOT_FINITE)
    for result in results:
        number = jax.tree_util.tree_leaves(result)[0]
        code = jnp.where(is_success(result), code, number)
    return values, code


def evaluated(
    task: Task,
    x: Float[np.ndarray, "n k"],
    *,
    executor: Any = None,
    chunk: int = CHUNK,
    progress: Callable[[int, int], None] | None = None,
) -> Outcomes:
    """The outcomes of all rows, on the cores of this machine or on an executor."""
    starts = range(0, len(x), chunk)
    found: dict[int, Piece] = {}
    for done, (start, piece) in enumerate(
        pieces(task, {start: x[start : start + chunk] for start in starts}, executor)
    ):
        found[start] = piece
        if progress is not None:
            progress(done + 1, len(starts))
    values, codes = zip(*(found[start] for start in starts), strict=True)
    return Outcomes(np.concatenate(values), np.concatenate(codes))


def pieces(task: Task, work: dict[int, np.ndarray], executor: Any) -> Iterator[tuple[int, Piece]]:
    """The outcomes of pieces of work, in the order in which they are done."""
    if executor is not None:
        yield from _done(executor, task, work)
        return
    # The first piece compiles; were all begun at once, each thread would.
    numbers = sorted(work)
    for number in numbers[:1]:
        yield number, task(work[number])
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from _done(pool, task, {number: work[number] for number in numbers[1:]})


def _done(executor: Any, task: Task, work: dict[int, np.ndarray]) -> Iterator[tuple[int, Piece]]:
    futures = {executor.submit(task, piece): number for number, piece in work.items()}
    try:
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()
