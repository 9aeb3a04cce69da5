"""What takes the results of many members piece by piece: memory, or a store on disk that outlives an interruption."""

import hashlib
import importlib.metadata
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._declare.node import leaves_of
from .._errors import ModelError
from .._extras import needed
from ._batches import Piece, Task

OPEN = -1  # code of a member that is not computed yet
PARTS = {
    "members": "its parameters or their values are others",
    "results": "its results have other names",
    "model": "its model has other numbers",
    "program": "its model, run or results state something else",
}
_NAME = re.compile(r"(?!zarr\.json$|__|\.)[^/]+")  # what zarr takes for the name of an array

_CALLBACK = re.compile(r"custom_call @\w*callback")


class Memory:
    """Results and codes of numbered members, gone with the process."""

    where = "lost, as no store was given"

    def __init__(self, n: int, chunk: int) -> None:
        self.n, self.chunk = n, chunk
        self._pieces: dict[int, Piece] = {}

    def starts(self) -> list[int]:
        """The first members of the pieces that are not finished."""
        return [start for start in range(0, self.n, self.chunk) if start not in self._pieces]

    def write(self, start: int, piece: Piece) -> None:
        """Keep the outcome of a piece."""
        self._pieces[start] = piece

    def read(self) -> Piece:
        """All results and codes."""
        values, codes = zip(*(self._pieces[start] for start in sorted(self._pieces)), strict=True)
        return np.concatenate(values), np.concatenate(codes)


class Store:
    """Results and codes of numbered members in a zarr store; a piece counts as finished once its codes are written."""

    def __init__(self, path: Path, n: int, names: Sequence[str], chunk: int, study: Mapping[str, str]) -> None:
        zarr = needed("zarr", "stores", "A store on disk")
        if bad := [name for name in names if not _NAME.fullmatch(name)]:
            raise ModelError(f"{bad[0]!r} cannot be the name of an array in a store. Rename the result.")
        self.names = tuple(names)
        self.where = f"in {path}: the same call goes on from there"
        if path.exists():
            self._group = zarr.open_group(path, mode="r+")
            self._check(path, study)
        else:
            self._group = zarr.open_group(path, mode="w-", attributes={"study": dict(study), **_versions()})
            # Pieces are small: to compress them would take longer than to write them.
            like: Any = dict(shape=(n,), chunks=(chunk,), dimension_names=["member"], compressors=None)
            for name in self.names:
                self._group.create_array(name, dtype="float64", fill_value=np.nan, **like)
            self._group.create_array("code", dtype="int16", fill_value=OPEN, **like)
        self._columns = [self._group[name] for name in self.names]
        self._codes = self._group["code"]
        self.chunk = int(self._codes.chunks[0])

    def _check(self, path: Path, study: Mapping[str, str]) -> None:
        known = self._group.attrs.get("study")
        if not isinstance(known, dict):
            raise ModelError(f"{path} is not the store of a sweep. Name another folder.")
        other = [text for part, text in PARTS.items() if known.get(part) != study[part]]
        if other:
            raise ModelError(f"{path} belongs to another study: {'; '.join(other)}. Name another folder, or delete it.")

    def starts(self) -> list[int]:
        """The first members of the pieces that are not finished."""
        still = np.asarray(self._codes[:]) == OPEN
        return [start for start in range(0, len(still), self.chunk) if np.any(still[start : start + self.chunk])]

    def write(self, start: int, piece: Piece) -> None:
        """Keep the outcome of a piece; its codes come last, so that half a piece is none."""
        values, codes = piece
        where = slice(start, start + len(codes))
        for kept, column in zip(self._columns, values.T, strict=True):
            kept[where] = column
        self._codes[where] = codes.astype("int16")

    def read(self) -> Piece:
        """All results and codes."""
        values = np.stack([np.asarray(kept[:]) for kept in self._columns], axis=1)
        return values, np.asarray(self._codes[:])


def store_of(
    path: str | Path | None, task: Task, names: Sequence[str], x: Float[np.ndarray, "n k"], chunk: int
) -> Store | None:
    """The store of a task at a path, which may be there already; None without a path."""
    if path is None:
        return None
    return Store(Path(path), len(x), names, chunk, study_of(task, names, x))


def study_of(task: Task, results: Sequence[str], x: Float[np.ndarray, "n k"]) -> dict[str, str]:
    """What tells one study from another: digests of its members, its results, the numbers of its model and the program.

    The program is what is compiled, so that it tells all that the results depend on, wherever it is written. Raises
    `ModelError` where it calls Python, of which it does not tell what it computes.
    """
    program, arrays = task.lowered()
    if _CALLBACK.search(program):
        raise ModelError(
            "A store must tell whether its results are still right, but the run or a result calls Python, as "
            "jax.pure_callback, jax.debug.print and eqx.error_if do. Leave out these calls, or the store."
        )
    given = [leaf for leaf in leaves_of(task.model) if leaf.value is not None]
    numbers = [(leaf.path, np.asarray(leaf.value, float).tobytes()) for leaf in given]
    return {
        "members": _digest(repr(tuple(task.free.names)).encode() + np.ascontiguousarray(x).tobytes()),
        "results": _digest(repr(tuple(results)).encode()),
        "model": _digest(repr(numbers).encode()),
        "program": _digest(program.encode() + b"".join(array.tobytes() for array in arrays)),
    }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _versions() -> dict[str, str]:
    return {f"{name}_version": importlib.metadata.version(name) for name in ("acausal", "jax")}
