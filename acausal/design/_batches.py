"""Results of many members of a model, from one compiled program, in batches on all cores."""

import collections
import concurrent.futures
import os
import uuid
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

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
from ._program import Program

LOCKSTEP = 32  # members that are stepped together: of more, most wait for the slowest, and they leave the cache
CHUNK = 256  # members of a task
COMPUTED, NOT_FINITE = 0, len(Result)  # codes; in between are those of failed runs, as `Result` counts them
_compiled: dict[str, Any] = {}  # programs of this process, by task


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
    """Rows of numbers to rows of results and codes: what a worker does. It can be sent to another process."""

    def __init__(self, model: Component, free: Free, program: Program) -> None:
        self.model, self.free, self.program = model, free, program
        self.key = uuid.uuid4().hex

    def __call__(self, x: Float[np.ndarray, "n k"]) -> tuple[np.ndarray, np.ndarray]:
        """Results and codes of at most `CHUNK` members, or as many as one piece of work is made of."""
        if self.key not in _compiled:
            _compiled[self.key] = jax.jit(self._all)
        n = len(x)
        # A piece that is not full is filled up, so that one program does for all.
        size = LOCKSTEP * -(-n // LOCKSTEP) if n > LOCKSTEP else n
        filled = np.concatenate([x, np.repeat(x[-1:], size - n, axis=0)])
        with trials(), compiling("a batch of runs", self.model, self._all):
            values, codes = _compiled[self.key](self.model, jnp.asarray(filled))
        return np.asarray(values)[:n], np.asarray(codes)[:n]

    def _all(self, model: Component, x: Any) -> tuple[Any, Any]:
        return jax.lax.map(lambda row: self._one(model, row), x, batch_size=min(LOCKSTEP, len(x)))

    def _one(self, model: Component, row: Any) -> tuple[Any, Any]:
        values, results = self.program.results(self.free.with_values(model, row))
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
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for done, (start, piece) in enumerate(
        pieces(task, {start: x[start : start + chunk] for start in starts}, executor)
    ):
        found[start] = piece
        if progress is not None:
            progress(done + 1, len(starts))
    values, codes = zip(*(found[start] for start in starts), strict=True)
    return Outcomes(np.concatenate(values), np.concatenate(codes))


def pieces(
    task: Task, work: dict[int, np.ndarray], executor: Any
) -> Iterator[tuple[int, tuple[np.ndarray, np.ndarray]]]:
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


def _done(
    executor: Any, task: Task, work: dict[int, np.ndarray]
) -> Iterator[tuple[int, tuple[np.ndarray, np.ndarray]]]:
    futures = {executor.submit(task, piece): number for number, piece in work.items()}
    try:
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()
