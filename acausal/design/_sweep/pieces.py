"""Batches computed piece by piece: on all cores or an executor, in memory or a store on disk."""

import concurrent.futures
import contextlib
import hashlib
import importlib.metadata
import os
import re
import warnings
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float, Int

from ..._declare.node import leaves_of
from ..._errors import ArgumentError, DesignWarning, ModelError, SimulationError, reason_of
from ..._extras import needed
from .._compute.cores import CHUNK, Bar, on_all_cores, threads
from .._problem.types import Executor, Progress
from .batches import COMPUTED, INTERRUPTED, Batch, Outcomes, Piece, code_names

OPEN = -1  # code of a pending member
PARTS = {
    "members": "it has other parameters or values",
    "results": "it has other results",
    "model": "its model has other parameter values",
    "program": "its model, run or results have another definition",
}
_NAME = re.compile(r"(?!zarr\.json$|__|\.)[^/]+")  # valid name of a zarr array

_CALLBACK = re.compile(r"custom_call @\w*callback")


class Memory:
    """Results and codes of numbered members, in memory."""

    where = "in the result, and the others are missing"
    is_on_disk = False

    def __init__(self, n: int, width: int) -> None:
        self._values, self._codes = np.full((n, width), np.nan), np.full(n, OPEN)

    @property
    def open(self) -> Int[np.ndarray, " n"]:
        """Pending members."""
        return np.flatnonzero(self._codes == OPEN)

    def write(self, rows: Int[np.ndarray, " n"], piece: Piece) -> None:
        """Stores results and codes of some members."""
        self._values[rows], self._codes[rows] = piece

    def close(self) -> None:
        """Ends writing."""

    def read(self) -> Piece:
        """All results and codes."""
        return self._values, np.where(self._codes == OPEN, INTERRUPTED, self._codes)


class Store(Memory):
    """Results and codes of numbered members, in a zarr store written chunk by chunk."""

    def __init__(self, path: Path, n: int, names: Sequence[str], chunk: int, study: Mapping[str, str]) -> None:
        zarr = needed("zarr", "stores", "A store on disk")
        if bad := [name for name in names if not _NAME.fullmatch(name)]:
            raise ModelError(f"{bad[0]!r} cannot be the name of an array in a store. Rename the result.")
        super().__init__(n, len(names))
        self.where = f"in {path}: the same call resumes from there"
        if path.exists():
            self._group = zarr.open_group(path, mode="r+")
            self._check(path, study)
        else:
            versions = {f"{name}_version": importlib.metadata.version(name) for name in ("acausal", "jax")}
            self._group = zarr.open_group(path, mode="w-", attributes={"study": dict(study), **versions})
            # Compressing small pieces would take longer than writing them.
            like: Any = dict(shape=(n,), chunks=(chunk,), dimension_names=["member"], compressors=None)
            for name in names:
                self._group.create_array(name, dtype="float64", fill_value=np.nan, **like)
            self._group.create_array("code", dtype="int16", fill_value=OPEN, **like)
        self._columns, self._column_of_codes = [self._group[name] for name in names], self._group["code"]
        self.chunk = int(self._column_of_codes.chunks[0])
        stored = [np.asarray(column[:]) for column in (*self._columns, self._column_of_codes)]
        self._values[:], self._codes[:] = np.stack(stored[:-1], axis=1), stored[-1]
        self.is_on_disk, self._error, self._path = True, "", path
        self._begun: set[int] = set()  # chunks that are not completely in the store

    def _check(self, path: Path, study: Mapping[str, str]) -> None:
        known = self._group.attrs.get("study")
        if not isinstance(known, dict):
            raise ModelError(f"{path} is not the store of a sweep. Name another folder.")
        other = [text for part, text in PARTS.items() if known.get(part) != study[part]]
        if other:
            raise ModelError(f"{path} belongs to another study: {'; '.join(other)}. Name another folder, or delete it.")

    def write(self, rows: Int[np.ndarray, " n"], piece: Piece) -> None:
        super().write(rows, piece)
        for number in np.unique(rows // self.chunk).tolist():
            self._begun.add(number)
            if not np.any(self._codes[self._members(number)] == OPEN):
                self._save(number)

    def close(self) -> None:
        for number in list(self._begun):
            self._save(number)
        if not self.is_on_disk:
            warnings.warn(
                f"{self._path} could not be written completely: {self._error}. The members that are not in the store "
                "are in the result.",
                DesignWarning,
                stacklevel=4,
            )

    def _members(self, number: int) -> slice:
        return slice(number * self.chunk, (number + 1) * self.chunk)

    def _save(self, number: int) -> None:
        """Writes a chunk to disk, its codes last, so that an incomplete chunk counts as pending.

        A chunk that cannot be written, as on a full disk, stays in memory.
        """
        where = self._members(number)
        try:
            for kept, column in zip(self._columns, self._values.T, strict=True):
                kept[where] = column[where]
            self._column_of_codes[where] = self._codes[where].astype("int16")
        except Exception as error:  # of any backend of zarr
            self.is_on_disk, self._error = False, reason_of(error)
        else:
            self._begun.discard(number)


def store_of(
    path: str | Path | None, batch: Batch, names: Sequence[str], x: Float[np.ndarray, "n k"], chunk: int
) -> Store | None:
    """The new or existing store of a batch at a path; None without a path."""
    if path is None:
        return None
    return Store(Path(path), len(x), names, chunk, study_of(batch, names, x))


def study_of(batch: Batch, results: Sequence[str], x: Float[np.ndarray, "n k"]) -> dict[str, str]:
    """Identity of a study: digests of its members, results, model parameters and compiled program.

    The compiled program includes everything that the results depend on. Raises `ModelError` if it calls Python, because
    it does not contain that code.
    """
    program, arrays = batch.lowered()
    if _CALLBACK.search(program):
        raise ModelError(
            "A store cannot check whether its results are still valid, because the run or a result calls Python, as "
            "jax.pure_callback, jax.debug.print and eqx.error_if do. Leave out these calls, or the store."
        )
    given = [leaf for leaf in leaves_of(batch.model) if leaf.value is not None]
    numbers = [(leaf.path, np.asarray(leaf.value, float).tobytes()) for leaf in given]
    return {
        "members": _digest(repr(tuple(batch.free.names)).encode() + np.ascontiguousarray(x).tobytes()),
        "results": _digest(repr(tuple(results)).encode()),
        "model": _digest(repr(numbers).encode()),
        "program": _digest(program.encode() + b"".join(array.tobytes() for array in arrays)),
    }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


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
