"""Programs stored in the library's cache by earlier processes, which need neither tracing nor lowering.

The cache of jax needs a traced and lowered program as its key, which takes most of the time in a second process. Here,
the key is a digest of everything that determines the trace (`made_from.py`). If the digest is in doubt, the function is
traced and nothing is stored.

Most programs are compiled without LLVM's optimisations, which take longer than all runs that most models ever see. A
program that has run often enough to repay them is compiled again.
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

# Levels of optimisation in LLVM. Loops of 12,000 and 18,000 equations take two thirds of the time at level 1 that they
# take at the usual level 3, and are as fast. Level 0 takes half the time of level 1, and a step is four times slower.
QUICK, OPTIMISED = 0, 1
# Steps after which the slower ones have cost as much time as compilation with optimisations takes. Both times are
# proportional to the size of the model. Programs that end earlier are never optimised. All others take at most twice
# the least possible time (the ski rental problem: Karlin, Manasse, Rudolph and Sleator, Algorithmica 3, 1988).
REPAYS = 50_000


class Storable(Protocol):
    """A compiled function of one pytree of numbers. Equal functions compare equal and have equal hashes."""

    def __hash__(self) -> int: ...

    def __call__(self, arguments: Any) -> PyTree: ...

    @property
    def name(self) -> str:
        """The prefix of its program files."""
        ...

    def steps(self, arguments: Any) -> int:
        """The number of steps, or other evaluations of the model, in a call with numbers of the shapes `arguments`."""
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
    is_known = not within_transformation() and all(map(_is_plain, leaves))
    if not is_known or not (programs.in_stages or programs.folder) or not _is_usual():
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
    """The program for numbers of these shapes; None if jax is to compile it as any other function."""
    file = _file_of(function, structure, kinds)
    if programs.in_stages:
        return _Staged(file, function, structure, kinds)
    return None if file is None else _made(file, function, structure, kinds)


def _file_of(function: Storable, structure: Any, kinds: Kinds) -> Path | None:
    """The file of the optimised program; None if there is no cache, or if the program has no digest."""
    if programs.folder is None:
        return None
    try:
        key = key_of(function.contents(structure.unflatten(kinds)), structure, kinds)
    except NoFingerprintError:
        return None
    return programs.folder / f"{function.name}-{key}-program"


class _Staged:
    """A program that is compiled quickly at first, and with optimisations after `REPAYS` steps."""

    def __init__(self, file: Path | None, function: Storable, structure: Any, kinds: Kinds) -> None:
        self._optimised = lambda: _made(file, function, structure, kinds, OPTIMISED)
        self._steps_in_call, self._lock = function.steps(structure.unflatten(_shapes(kinds))), threading.Lock()
        found = _loaded(file, len(kinds))
        self._left = 0 if found is not None else REPAYS
        quick = None if file is None else file.with_name(f"{file.name.removesuffix('-program')}-quick-program")
        self._call = found or _made(quick, function, structure, kinds, QUICK)

    def __call__(self, leaves: list[Any]) -> PyTree:
        if self._left > 0:
            with self._lock:
                if 0 < self._left <= self._steps_in_call:
                    with contextlib.suppress(Exception):  # optimisation is optional: the quick program runs anyway
                        self._call = self._optimised()
                self._left -= self._steps_in_call  # after an interrupt, the next call optimises again
        return self._call(leaves)


def _made(file: Path | None, function: Storable, structure: Any, kinds: Kinds, level: int | None = None) -> Program:
    """The program in a file, or else compiled and, if possible, stored there; at a level of optimisation other than
    that of the process, if one is given.
    """
    return _loaded(file, len(kinds)) or _compiled(file, function, structure, kinds, level)


def _compiled(file: Path | None, function: Storable, structure: Any, kinds: Kinds, level: int | None) -> Program:
    """Compile a function and, if possible, store its program."""
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    # Each version gets its own name in jax's cache, too.
    run.__name__ = function.name if file is None else file.stem.replace("-", "_")
    shapes = _shapes(kinds)
    if level != OPTIMISED:
        _compile_in_parallel(function.followers(structure.unflatten(shapes)))
    lowered = jax.jit(run).lower(*shapes)
    options: Any = None if level is None else {"xla_backend_optimization_level": level}
    with _loads() as loaded:
        call = lowered.compile(options)
    if file is not None and not loaded:
        _store(file, call, lowered, outputs[0])
    return lambda leaves: outputs[0].unflatten(call(*leaves))


def _store(file: Path, call: Any, lowered: Any, outputs: Any) -> None:
    """Store a program, if possible. One that jax has loaded from its own cache cannot be serialised. One that calls
    libraries other than LAPACK is not stored, because only LAPACK is known to be available when it is loaded again.
    """
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
    if all(name.startswith("lapack_") for name in library) and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional: the program runs anyway
            parts = (*serialized(call), outputs.unflatten(range(lowered.out_tree.num_leaves)), bool(library))
            files.write(file, zlib.compress(pickle.dumps(parts), 1))


def _shapes(kinds: Kinds) -> list[jax.ShapeDtypeStruct]:
    return [jax.ShapeDtypeStruct(*kind) for kind in kinds]


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


def _loaded(file: Path | None, n: int) -> Program | None:
    """The program in a file; None if the file does not exist or cannot be read."""
    content = None if file is None else files.read(file)
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
