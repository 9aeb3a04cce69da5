"""Programs stored in the library's cache by earlier processes, which need neither tracing nor lowering.

The cache of jax needs a traced and lowered program as its key, which takes most of the time in a second process. Here,
the key is a digest of everything that determines the trace (`made_from.py`). If the digest is in doubt, the function is
traced and nothing is stored.
"""

import contextlib
import pickle
import re
import threading
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
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
from ..._made_once import made_once
from ..._tracing import is_traced, within_transformation
from .made_from import is_as_imported, key_of

Kinds = tuple[tuple[tuple[int, ...], Any], ...]  # shape and type of each number
Program = Callable[[list[Any]], PyTree]


class Storable(Protocol):
    """A compiled function of one pytree of numbers. Equal functions compare equal and have equal hashes."""

    def __hash__(self) -> int: ...

    def __call__(self, arguments: Any) -> PyTree: ...

    @property
    def name(self) -> str:
        """The prefix of its program files."""
        ...

    def contents(self, arguments: Any) -> list[object]:
        """Everything that determines the trace, except the library itself and the numbers. `arguments` holds the shapes
        and types of the numbers. Raises `NoFingerprintError` if the contents cannot be determined.
        """
        ...

    def followers(self, arguments: Any) -> "Sequence[tuple[Storable, Any]]":
        """The functions that are called next, with the shapes of their numbers, for numbers with the shapes
        `arguments`.
        """
        ...


def result_of(function: Storable, arguments: Any) -> PyTree:
    """Evaluates the function by its stored program. If there is none, compiles and, if possible, stores one."""
    return program_for(function, arguments)(arguments)


def program_for(function: Storable, arguments: Any) -> Callable[[Any], PyTree]:
    """The stored program of the function, if possible, for numbers of the same shapes and structure."""
    leaves, structure = jax.tree.flatten(arguments)
    if within_transformation() or programs.folder is None or not _is_usual() or not all(map(_is_plain, leaves)):
        return function
    kinds = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
    program = _program(function, structure, kinds)
    return function if program is None else lambda arguments: program(jax.tree.leaves(arguments))


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


@made_once(maxsize=256)
def _program(function: Storable, structure: Any, kinds: Kinds) -> Program | None:
    """The program for numbers of these shapes; None if it has no digest."""
    assert programs.folder is not None
    try:
        key = key_of(function.contents(structure.unflatten(kinds)), structure, kinds)
    except NoFingerprintError:
        return None
    file = programs.folder / f"{function.name}-{key}-program"
    if (found := _loaded(file, len(kinds))) is not None:
        return found
    return _compiled(file, function, structure, kinds)


def _compiled(file: Path, function: Storable, structure: Any, kinds: Kinds) -> Program:
    """Compile a function and, if possible, store its program."""
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    run.__name__ = file.stem.replace("-", "_")  # gives each version its own name in jax's cache, too
    shapes = [jax.ShapeDtypeStruct(*kind) for kind in kinds]
    _compile_in_parallel(function.followers(structure.unflatten(shapes)))
    lowered = jax.jit(run).lower(*shapes)
    with _loads() as loaded:
        call = lowered.compile()
    n = lowered.out_tree.num_leaves
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
    # A program that jax has loaded from its own cache cannot be serialised. A program that calls libraries other than
    # LAPACK is not stored, because only LAPACK is known to be available when it is loaded again.
    if not loaded and all(name.startswith("lapack_") for name in library) and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional: the program runs anyway
            parts = (*serialized(call), outputs[0].unflatten(range(n)), bool(library))
            files.write(file, zlib.compress(pickle.dumps(parts), 1))
    return lambda leaves: outputs[0].unflatten(call(*leaves))


def _compile_in_parallel(functions: Sequence[tuple[Storable, Any]]) -> None:
    """Begin to compile the programs of other functions in threads, because XLA uses one core for each program.

    The thread that needs one of them waits for it; an error or an interrupt of the current one does not.
    """
    pool = ThreadPoolExecutor()
    with contextlib.suppress(RuntimeError):  # no thread starts while the interpreter ends
        for function in functions:
            pool.submit(program_for, *function)
    pool.shutdown(wait=False)


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


def _loaded(file: Path, n: int) -> Program | None:
    """The program in a file; None if the file does not exist or cannot be read."""
    content = files.read(file)
    if content is None:
        return None
    try:
        payload, n_outputs, outputs, needs_lapack = pickle.loads(zlib.decompress(content))
        if needs_lapack:  # jax loads LAPACK when it lowers a program that calls it
            jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))
        call = deserialized(payload, n, n_outputs)
        whole = jax.tree.structure(outputs)
    except Exception:  # an unreadable file is written again
        return None
    return lambda leaves: whole.unflatten(call(*leaves))
