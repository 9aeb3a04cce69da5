"""What takes the results of many members piece by piece: memory, or a store on disk that outlives an interruption."""

import functools
import hashlib
import importlib.metadata
import re
import types
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from .._declare.component import Component
from .._errors import ModelError
from .._extras import needed
from ._batches import Piece, Task

OPEN = -1  # code of a member that is not computed yet
PARTS = {
    "members": "its parameters or their values are others",
    "results": "its results have other names",
    "model": "its model has another structure or other numbers",
    "functions": "its run or its results are computed by other code",
}
_NAME = re.compile(r"(?!zarr\.json$|__|\.)[^/]+")  # what zarr takes for the name of an array


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
    """What tells one study from another: digests of its members, results, model and functions."""
    leaves, structure = jax.tree_util.tree_flatten(task.model)
    numbers = b"".join(np.asarray(leaf, float).tobytes() for leaf in leaves)
    return {
        "members": _digest(repr(tuple(task.free.names)).encode() + np.ascontiguousarray(x).tobytes()),
        "results": _digest(repr(tuple(results)).encode()),
        "model": _digest(repr(structure).encode() + numbers),
        "functions": _digest(b"".join(_code(function) for function in (*task.functions.values(), task.run))),
    }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _code(function: object) -> bytes:
    """What a function computes: its code with that of functions within it, and what it closes over."""
    return repr(_content(function, set())).encode()


def _content(value: object, seen: set[int]) -> object:
    """What a value is, as text that is the same in each process; `seen` are functions that are described already."""
    if isinstance(value, functools.partial):
        return [_content(part, seen) for part in (value.func, value.args, value.keywords)]
    if isinstance(value, types.MethodType):
        return [_content(part, seen) for part in (value.__func__, value.__self__)]
    if isinstance(value, types.FunctionType):
        if id(value) in seen:
            return value.__qualname__
        seen.add(id(value))
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        return [_of_code(value.__code__), *(_content(part, seen) for part in (cells, value.__defaults__, _own(value)))]
    if isinstance(value, Mapping):
        return [(repr(key), _content(part, seen)) for key, part in value.items()]
    if isinstance(value, list | tuple):
        return [_content(part, seen) for part in value]
    if isinstance(value, Component | np.ndarray | jax.Array):
        leaves, structure = jax.tree_util.tree_flatten(value)
        return [repr(structure), *((np.shape(leaf), np.asarray(leaf).tobytes()) for leaf in leaves)]
    return repr(value) if isinstance(value, bool | int | float | str | None) else repr(type(value))


def _own(function: types.FunctionType) -> dict[str, object]:
    """The globals that a function names, numbers or functions; not the functions that its module has imported."""
    known = {name: function.__globals__.get(name) for name in sorted(_names(function.__code__))}
    return {
        name: value
        for name, value in known.items()
        if isinstance(value, bool | int | float | str | list | tuple | dict | np.ndarray | jax.Array)
        or (isinstance(value, types.FunctionType) and value.__module__ == function.__module__)
    }


def _names(code: types.CodeType) -> set[str]:
    inner = (item for item in code.co_consts if isinstance(item, types.CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _of_code(code: types.CodeType) -> bytes:
    constants = [_of_code(item) if isinstance(item, types.CodeType) else repr(item).encode() for item in code.co_consts]
    return code.co_code + repr(code.co_names).encode() + b"".join(constants)


def _versions() -> dict[str, str]:
    return {f"{name}_version": importlib.metadata.version(name) for name in ("acausal", "jax")}
