"""Storage of results piece by piece: in memory, or in a store on disk that outlives an interrupt."""

import hashlib
import importlib.metadata
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..._declare.node import leaves_of
from ..._errors import DesignWarning, ModelError, reason_of
from ..._extras import needed
from .batches import INTERRUPTED, Batch, Piece

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
