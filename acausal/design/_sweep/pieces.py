"""Batches computed piece by piece: on all cores or an executor, in memory or a store on disk."""

import concurrent.futures
import contextlib
import os
import warnings
from collections.abc import Generator, Sequence
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float, Int

from ..._errors import ArgumentError, DesignWarning, SimulationError, reason_of
from .._compute.bar import Bar
from .._compute.cores import CHUNK, on_all_cores, threads
from .._problem.types import Executor, Progress
from .batches import COMPUTED, Batch, Outcomes, Piece, code_names
from .store import Memory, Store

MemberNumbers: TypeAlias = Int[np.ndarray, " m"]  # numbers of members
Pieces: TypeAlias = Generator[tuple[MemberNumbers, Piece | Exception]]  # members and their outcomes, or an error


def evaluated(
    batch: Batch,
    x: Float[np.ndarray, "n k"],
    what: str,
    *,
    executor: Executor | None = None,
    chunk: int = CHUNK,
    store: Store | None = None,
    progress: Progress | bool | None = None,
) -> Outcomes:
    """Outcomes of all rows, excluding those already in a store.

    The bar is labelled `what`, and reports the first failures. After a keyboard interrupt or the error of a piece,
    unfinished members have the code `INTERRUPTED`. An executor receives pieces of `chunk` members.

    The error of a piece does not end the others. It is a `DesignWarning`, or is raised if a store keeps the finished
    members or there are none. It is a `SimulationError` if a worker died and its executor did not replace it.
    """
    batch.progress = False if callable(progress) else progress
    kept = Memory(len(x), len(batch.columns[0])) if store is None else store
    chunk = chunk if store is None else store.chunk
    rows, total, bar = kept.open, len(x), Bar(what, progress)
    done = total - len(rows)
    bar(done, total)
    pieces = _on_cores(batch, x, rows) if executor is None else _on_executor(executor, batch, x, rows, chunk)
    errors: list[Exception] = []
    try:
        with contextlib.closing(pieces):
            for members, piece in pieces:
                if isinstance(piece, Exception):
                    errors.append(piece)
                    continue
                kept.write(members, piece)
                for member, code in zip(members.tolist(), piece[1].tolist(), strict=True):
                    if code != COMPUTED:
                        bar.failed(f"member {member} failed ({code_names()[code]}): {batch.free.text(x[member])}")
                done += len(members)
                bar(done, total)
    except KeyboardInterrupt:
        if not done:
            raise
        bar.say(f"interrupted after {done} of {total} members")
    finally:
        kept.close()
    if errors:
        _report(errors[0], f"{done} of {total} members of the {what}", kept, is_lost=not done)
    return Outcomes(*kept.read())


def _report(error: Exception, finished: str, kept: Memory, *, is_lost: bool) -> None:
    """Raises the error of a piece if the finished members are in a store or there are none; otherwise warns of it."""
    reason = "a worker died" if _is_death(error) else reason_of(error)
    text = f"Only {finished} could be computed, because {reason}. They are {kept.where}."
    if not is_lost and not kept.is_on_disk:
        warnings.warn(text, DesignWarning, stacklevel=4)
    elif _is_death(error):
        raise SimulationError(text) from error
    else:
        raise error


def compile_together(batches: Sequence[Batch], x: Sequence[np.ndarray]) -> None:
    """Compiles several batches in parallel, with the first member of each."""
    if len(batches) > 1:
        with threads(os.cpu_count() or 1) as pool:
            for _ in pool.map(lambda batch, rows: batch(rows[:1]), batches, x):
                pass


def _on_cores(batch: Batch, x: np.ndarray, rows: MemberNumbers) -> Pieces:
    def tried(members: np.ndarray) -> Piece | Exception:
        try:
            return batch(members)
        except Exception as error:
            return error

    with contextlib.closing(on_all_cores(tried, x[rows])) as pieces:
        for places, piece in pieces:
            yield rows[places], piece


def _on_executor(executor: Executor, batch: Batch, x: np.ndarray, rows: MemberNumbers, chunk: int) -> Pieces:
    submit = getattr(executor, "submit", lambda *work: None)
    pieces = [rows[i : i + chunk] for i in range(0, len(rows), chunk)]
    futures: dict[Any, np.ndarray] = {submit(batch, x[piece]): piece for piece in pieces}
    if not all(isinstance(future, concurrent.futures.Future) for future in futures):
        raise ArgumentError(
            "The submit method of executor must return a concurrent.futures.Future; "
            f"got {type(executor).__name__}. For a client of Dask, use client.get_executor()."
        )
    try:
        for future in concurrent.futures.as_completed(futures):
            try:
                yield futures[future], future.result()
            except Exception as error:
                yield futures[future], error
    finally:
        for future in futures:
            future.cancel()


def _is_death(error: Exception) -> bool:
    """Whether an error means that a worker died, not that the computation failed."""
    gone = concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError
    return isinstance(error, gone) or type(error).__name__ == "KilledWorker"  # of Dask
