"""Many members computed piece by piece: on all cores or on an executor, kept in memory or in a store on disk."""

import concurrent.futures
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError, SimulationError
from ._batches import CHUNK, LOCKSTEP, Outcomes, Piece, Task
from ._store import Memory, Store
from ._types import Executor, Progress


def evaluated(
    task: Task,
    x: Float[np.ndarray, "n k"],
    *,
    executor: Executor | None = None,
    chunk: int = CHUNK,
    store: Store | None = None,
    progress: Progress | None = None,
) -> Outcomes:
    """The outcomes of all rows in pieces of `chunk` members; what a store has already is not computed again.

    Raises `SimulationError` where a worker dies and its executor does not replace it.
    """
    kept = Memory(len(x), chunk) if store is None else store
    tell = progress or (lambda done, total: None)
    starts, total = kept.starts(), -(-len(x) // kept.chunk)
    done = total - len(starts)
    tell(done, total)
    work = {start: x[start : start + kept.chunk] for start in starts}
    try:
        for start, piece in _done(executor, task, work, _side(kept.chunk, x)):
            kept.write(start, piece)
            done += 1
            tell(done, total)
    except Exception as error:
        if not _is_death(error):
            raise
        raise SimulationError(
            f"A worker died after {done} of {total} pieces of the work; what was finished is {kept.where}."
        ) from error
    return Outcomes(*kept.read())


def compile_together(tasks: Sequence[Task], x: Sequence[np.ndarray]) -> None:
    """Compile the programs of several tasks side by side, with the pieces that `x` is cut into by default."""
    if len(tasks) > 1:
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for _ in pool.map(lambda task, rows: task(rows[:1], _side(CHUNK, rows)), tasks, x):
                pass


def _side(chunk: int, x: np.ndarray) -> int:
    """How many members of a piece go side by side."""
    return min(LOCKSTEP, chunk, len(x))


def _done(
    executor: Executor | None, task: Task, work: Mapping[int, np.ndarray], side: int
) -> Iterator[tuple[int, Piece]]:
    """The outcomes of pieces of work, in the order in which they are done."""
    if executor is None:
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            yield from _done(pool, task, work, side)
        return
    submit = getattr(executor, "submit", lambda *work: None)
    futures: dict[Any, int] = {submit(task, piece, side): number for number, piece in work.items()}
    if not all(isinstance(future, concurrent.futures.Future) for future in futures):
        raise ArgumentError(
            "executor must be like those of concurrent.futures, whose submit returns a Future of theirs; "
            f"got {type(executor).__name__}. Of a client of Dask, give client.get_executor()."
        )
    try:
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()


def _is_death(error: Exception) -> bool:
    """Whether an error says that the worker has died, and not that the computation failed."""
    gone = concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError
    return isinstance(error, gone) or type(error).__name__ == "KilledWorker"  # of Dask
