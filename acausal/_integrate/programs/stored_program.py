"""Programs of functions with known numbers, stored in the library's cache.

A function is traced once. Its jaxpr is interpreted, and compiled in parts when that pays (`NumbersProgram`). The jaxpr
and the compiled parts are stored, so that later processes neither trace nor compile. The cache of jax would need a
traced and lowered program as its key. Here, the key is a digest of everything that determines the trace
(`program_digest.py`). If the digest is in doubt, nothing is stored.
"""

import contextlib
import pickle
import re
import threading
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import jax
from jax import monitoring
from jaxtyping import PyTree

from ... import _program_files as files
from ..._fingerprint import NoFingerprintError
from ..._interpret.in_parts import Call, Kinds, evaluated, runner, traced
from ..._interpret.program import OPTIONS, Compiler, lowered
from ..._interpret.simplify import NotPlainError
from ..._interpret.tape import closed_of, tape_of
from ..._jax_private import ClosedJaxpr, deserialized, serialized
from ..._jax_settings import programs
from ..._made_once import made_once
from .program_digest import is_as_imported, key_of


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


def result_of(function: Storable, arguments: Any) -> PyTree:
    """Evaluates the function, if possible by a stored program."""
    leaves, structure = jax.tree.flatten(arguments)

    def by_jax(leaves: list[Any]) -> PyTree:
        return function(structure.unflatten(leaves))

    return evaluated(leaves, lambda kinds, moving: _program(function, structure, kinds, moving), by_jax)


@made_once(maxsize=256)
def _program(function: Storable, structure: Any, kinds: Kinds, moving: tuple[int, ...]) -> Call | None:
    """The program for numbers of these shapes; None if it prints or calls Python, which only jax can do."""
    file, shapes = _file_of(function, structure, kinds, moving), [jax.ShapeDtypeStruct(*kind) for kind in kinds]
    found = _read(file)
    if found is None:
        try:
            found = traced(function, structure, shapes, moving)
        except NotPlainError:
            return None
        _write_jaxpr(file, *found)
    closed, outputs = found
    steps = function.steps(structure.unflatten(shapes))
    return runner(closed, outputs, _Store(file, function.name), steps)


def _file_of(function: Storable, structure: Any, kinds: Kinds, moving: tuple[int, ...]) -> Path | None:
    """The file of the jaxpr; None if there is no cache, or if the program has no digest."""
    if programs.folder is None:
        return None
    try:
        key = key_of([*function.contents(structure.unflatten(kinds)), moving], structure, kinds)
    except NoFingerprintError:
        return None
    return programs.folder / f"{function.name}-{key}-program"


def _read(file: Path | None) -> tuple[ClosedJaxpr, Any] | None:
    """The stored jaxpr of a function and the structure of its results."""
    content = None if file is None else files.read(file)
    if content is not None:
        with contextlib.suppress(Exception):  # an unreadable file is written again
            tape, outputs = pickle.loads(zlib.decompress(content))
            return closed_of(tape), jax.tree.structure(outputs)
    return None


def _write_jaxpr(file: Path | None, closed: ClosedJaxpr, outputs: Any) -> None:
    """Store the jaxpr of a function and the structure of its results, if possible."""
    if file is not None and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional
            content = pickle.dumps((tape_of(closed), outputs.unflatten(range(outputs.num_leaves))))
            files.write(file, zlib.compress(content, 1))


class _Store(Compiler):
    """The compiled parts of a program, on disk if possible."""

    def __init__(self, file: Path | None, name: str) -> None:
        super().__init__(name)
        self._file = file

    def stored(self, part: str, level: str, n_inputs: int) -> Callable[..., list[Any]] | None:
        """The stored program of a part; None if there is none that can be read."""
        file = self._place(part, level)
        content = None if file is None else files.read(file)
        if content is not None:
            with contextlib.suppress(Exception):  # an unreadable file is written again
                payload, n_outputs, needs_lapack = pickle.loads(zlib.decompress(content))
                if needs_lapack:  # jax loads LAPACK when it lowers a program that calls it
                    jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))
                return deserialized(payload, n_inputs, n_outputs)
        return None

    def compiled(self, part: str, level: str, run: Callable[..., Any], shapes: Sequence[Any]) -> Callable[..., Any]:
        """Compile a part and, if possible, store it."""
        file = self._place(part, level)
        # Each version gets its own name in jax's cache, too.
        program = lowered(self.name if file is None else file.stem.replace("-", "_"), run, shapes)
        with _loads() as loaded:
            call = program.compile(OPTIONS[level])
        if file is not None and not loaded:
            _write(file, call, program)
        return call

    def _place(self, part: str, level: str) -> Path | None:
        file = self._file
        return None if file is None else file.with_name(f"{file.name.removesuffix('program')}{part}-{level}-program")


def _write(file: Path, call: Any, program: Any) -> None:
    """Store a compiled part, if possible. One that jax has loaded from its own cache cannot be serialised. One that
    calls libraries other than LAPACK is not stored, because only LAPACK is known to be available when it is read again.
    """
    library = set(re.findall(r"custom_call @(\w+)", program.as_text()))
    if all(name.startswith("lapack_") for name in library) and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional: the program runs anyway
            files.write(file, zlib.compress(pickle.dumps((*serialized(call), bool(library))), 1))


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
