"""Programs stored in the library's cache by earlier processes, which need neither tracing nor lowering.

The cache of jax needs a traced and lowered program as its key, which takes most of the time in a second process. Here,
the key is a digest of everything that determines the trace (`made_from.py`). If the digest is in doubt, the function is
traced and nothing is stored.
"""

import contextlib
import functools as ft
import io
import pickle
import re
import threading
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import jax
import numpy as np
from jax import monitoring
from jaxtyping import PyTree

from ... import _program_files as files
from ..._fingerprint import NoFingerprintError
from ..._jax_private import deserialized, serialized, trace_context
from ..._jax_settings import programs
from ..._tracing import is_traced, within_transformation
from .made_from import is_as_imported, key_of

Kinds = tuple[tuple[tuple[int, ...], Any], ...]  # shape and type of each number
Program = Callable[[list[Any]], PyTree]


class Storable(Protocol):
    """A compiled function of one pytree of numbers. Equal functions compare equal and have equal hashes."""

    def __hash__(self) -> int: ...

    def __call__(self, given: Any) -> PyTree: ...

    @property
    def name(self) -> str:
        """The prefix of its program files."""
        ...

    def contents(self, given: Any) -> list[object]:
        """Everything that determines the trace, except the library itself and the numbers. `given` holds the shapes
        and types of the numbers. Raises `NoFingerprintError` if the contents cannot be determined.
        """
        ...

    def held(self) -> Mapping[str, Any]:
        """Existing objects in the outputs, referred to by name because not all of them can be stored."""
        ...


def result_of(function: Storable, given: Any) -> PyTree:
    """Evaluates the function by its stored program. If there is none, compiles and, if possible, stores one."""
    return program_for(function, given)(given)


def program_for(function: Storable, given: Any) -> Callable[[Any], PyTree]:
    """The stored program of the function, if possible, for numbers of the same shapes and structure."""
    if not _can_be_stored(given):
        return function
    program = _program(function, *_structure_and_kinds(given))
    return function if program is None else lambda given: program(jax.tree.leaves(given))


def is_missing(function: Storable, given: Any) -> bool:
    """Whether the program of a function can be stored but does not exist yet."""
    if not _can_be_stored(given):
        return False
    file = _file_of(function, *_structure_and_kinds(given))
    return file is not None and not file.exists()


def _can_be_stored(given: Any) -> bool:
    is_usual = not within_transformation() and programs.folder is not None and _is_usual()
    return is_usual and all(map(_is_plain, jax.tree.leaves(given)))


def _structure_and_kinds(given: Any) -> tuple[Any, Kinds]:
    leaves, structure = jax.tree.flatten(given)
    return structure, tuple((leaf.shape, leaf.dtype) for leaf in leaves)


def _is_plain(leaf: Any) -> bool:
    """Whether a leaf is a known number on the default device, or only a shape."""
    if isinstance(leaf, np.ndarray | np.generic | jax.ShapeDtypeStruct):
        return True
    return isinstance(leaf, jax.Array) and not is_traced(leaf) and len(leaf.devices()) == 1 and not leaf.weak_type


def _is_usual() -> bool:
    """Whether jax compiles for the CPU with the settings that it had when the library was imported."""
    config: Any = jax.config
    others = (config.jax_debug_nans, config.jax_debug_infs, config.jax_disable_jit, config.jax_default_device)
    if any(others) or not config.jax_enable_x64 or trace_context() != programs.context:
        return False
    return jax.default_backend() == "cpu" and jax.device_count() == 1


@ft.lru_cache(maxsize=256)
def _program(function: Storable, structure: Any, kinds: Kinds) -> Program | None:
    """The program for numbers of these shapes; None if it has no digest."""
    file = _file_of(function, structure, kinds)
    if file is None:
        return None
    if (found := _loaded(file, function, len(kinds))) is not None:
        return found
    return _compiled(file, function, structure, kinds)


@ft.lru_cache(maxsize=256)
def _file_of(function: Storable, structure: Any, kinds: Kinds) -> Path | None:
    """The file of a program; None if it has no digest."""
    assert programs.folder is not None
    try:
        key = key_of(function.contents(structure.unflatten(kinds)), structure, kinds)
    except NoFingerprintError:
        return None
    return programs.folder / f"{function.name}-{key}-program"


def _compiled(file: Path, function: Storable, structure: Any, kinds: Kinds) -> Program:
    """Compile a function and, if possible, store its program."""
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    run.__name__ = file.stem.replace("-", "_")  # gives each version its own name in jax's cache, too
    lowered = jax.jit(run).lower(*(jax.ShapeDtypeStruct(*kind) for kind in kinds))
    with _loads() as loaded:
        call = lowered.compile()
    n = lowered.out_tree.num_leaves
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
    # A program that jax has loaded from its own cache cannot be serialised. A program that calls libraries other than
    # LAPACK is not stored, because only LAPACK is known to be available when it is loaded again.
    if not loaded and all(name.startswith("lapack_") for name in library) and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional: the program runs anyway
            _store(file, _pickled(outputs[0].unflatten(range(n)), function), call, bool(library))
    return lambda leaves: outputs[0].unflatten(call(*leaves))


@contextlib.contextmanager
def _loads() -> Any:
    """Collects the cache hits of jax in this thread."""
    found: list[str] = []
    own = threading.get_ident()

    def note(event: str, **others: Any) -> None:
        if event.endswith("/cache_hits") and threading.get_ident() == own:
            found.append(event)

    monitoring.register_event_listener(note)
    try:
        yield found
    finally:
        monitoring.unregister_event_listener(note)


def _store(file: Path, whole: bytes, call: Any, needs_lapack: bool) -> None:
    files.write(file, zlib.compress(pickle.dumps((*serialized(call), whole, needs_lapack)), 1))


def _loaded(file: Path, function: Storable, n: int) -> Program | None:
    """The program in a file; None if the file does not exist or cannot be read."""
    content = files.read(file)
    if content is None:
        return None
    try:
        payload, n_outputs, pickled, needs_lapack = pickle.loads(zlib.decompress(content))
        if needs_lapack:  # jax loads LAPACK when it lowers a program that calls it
            jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))
        call = deserialized(payload, n, n_outputs)
        whole = jax.tree.structure(_Reader(io.BytesIO(pickled), function).load())
    except Exception:  # an unreadable file is written again
        return None
    return lambda leaves: whole.unflatten(call(*leaves))


def _pickled(outputs: PyTree, function: Storable) -> bytes:
    stream = io.BytesIO()
    _Writer(stream, function).dump(outputs)
    return stream.getvalue()


class _Writer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, function: Storable) -> None:
        super().__init__(stream)
        self.names = {id(value): name for name, value in function.held().items() if value is not None}

    def persistent_id(self, obj: Any) -> str | None:
        return self.names.get(id(obj))


class _Reader(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, function: Storable) -> None:
        super().__init__(stream)
        self.held = function.held()

    def persistent_load(self, pid: str) -> Any:
        return self.held[pid]
