"""Programs of functions with known numbers, stored in the library's cache.

A function is traced once. Its jaxpr is interpreted, and compiled in parts when that pays (`Program`). Both the jaxpr and
the compiled parts are stored, so that later processes neither trace nor compile. The cache of jax would need a traced
and lowered program as its key. Here, the key is a digest of everything that determines the trace (`made_from.py`). If
the digest is in doubt, nothing is stored.
"""

import contextlib
import dataclasses
import pickle
import re
import threading
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import jax
import numpy as np
from jax import monitoring
from jaxtyping import PyTree

from ... import _program_files as files
from ..._fingerprint import NoFingerprintError
from ..._interpret.program import OPTIONS, REPAYS, Program
from ..._interpret.simplify import NotPlainError, simplified
from ..._interpret.tape import closed_of, tape_of
from ..._jax_private import ClosedJaxpr, deserialized, serialized, trace_context
from ..._jax_settings import programs
from ..._made_once import made_once
from ..._tracing import is_traced, within_transformation
from .made_from import is_as_imported, key_of

Kinds = tuple[tuple[tuple[int, ...], Any], ...]  # shape and type of each number
Call = Callable[[list[Any]], PyTree]


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
    """Evaluates the function by its stored program. If there is none, compiles and, if possible, stores one."""
    return program_for(function, arguments)(arguments)


def program_for(function: Storable, arguments: Any) -> Callable[[Any], PyTree]:
    """The stored program of the function, if possible, for numbers of the same shapes and structure."""
    leaves, structure = jax.tree.flatten(arguments)
    is_known = not within_transformation() and all(map(_is_plain, leaves))
    if not is_known or not _is_usual():
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


def in_parts(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A function of known arrays, as `jax.jit` returns it, interpreted at first and compiled in parts when that pays."""
    jitted = jax.jit(function)
    made: dict[Kinds, Call | None] = {}

    def call(*arrays: Any) -> PyTree:
        arrays = tuple(np.asarray(a) if isinstance(a, float) else a for a in arrays)
        if within_transformation() or not all(map(_is_plain, arrays)) or not _is_usual():
            return jitted(*arrays)
        kinds = tuple((a.shape, a.dtype) for a in arrays)
        if kinds not in made:
            made[kinds] = _made(_Plain(jitted), jax.tree.structure(arrays), kinds)
        program = made[kinds]
        return jitted(*arrays) if program is None else program(list(arrays))

    return call


@dataclasses.dataclass(frozen=True)
class _Plain:
    """A function of arrays, of which nothing is stored."""

    function: Callable[..., PyTree]
    name: str = "function"

    def __call__(self, arguments: Any) -> PyTree:
        return self.function(*arguments)

    def steps(self, arguments: Any) -> int:
        return REPAYS // 100

    def contents(self, arguments: Any) -> list[object]:
        raise NoFingerprintError("the function of a user")


def _made(function: Storable, structure: Any, kinds: Kinds) -> Call | None:
    """The program for numbers of these shapes; None if it prints or calls Python, which only jax can do."""
    file, shapes = _file_of(function, structure, kinds), [jax.ShapeDtypeStruct(*kind) for kind in kinds]
    try:
        closed, outputs = _read(file) or _traced(file, function, structure, shapes)
    except NotPlainError:
        return None
    steps = function.steps(structure.unflatten(shapes))
    program = Program(closed, _Store(file, function.name), steps, at_once=not programs.in_parts)
    return lambda leaves: outputs.unflatten(jax.device_put(program(leaves), may_alias=False))


_program = made_once(maxsize=256)(_made)


def _file_of(function: Storable, structure: Any, kinds: Kinds) -> Path | None:
    """The file of the jaxpr; None if there is no cache, or if the program has no digest."""
    if programs.folder is None:
        return None
    try:
        key = key_of(function.contents(structure.unflatten(kinds)), structure, kinds)
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


def _traced(file: Path | None, function: Storable, structure: Any, shapes: Sequence[Any]) -> tuple[ClosedJaxpr, Any]:
    """The jaxpr of a function and the structure of its results, traced and, if possible, stored."""
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    closed = simplified(jax.make_jaxpr(run)(*shapes))
    (whole,) = outputs
    if file is not None and is_as_imported():
        with contextlib.suppress(Exception):  # storing is optional
            content = pickle.dumps((tape_of(closed), whole.unflatten(range(whole.num_leaves))))
            files.write(file, zlib.compress(content, 1))
    return closed, whole


class _Store:
    """The compiled parts of a program, on disk if possible."""

    def __init__(self, file: Path | None, name: str) -> None:
        self._file, self._name = file, name

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

        def named(*values: Any) -> Any:
            return run(*values)

        # Each version gets its own name in jax's cache, too.
        named.__name__ = self._name if file is None else file.stem.replace("-", "_")
        lowered = jax.jit(named).lower(*shapes)
        with _loads() as loaded:
            call = lowered.compile(OPTIONS[level])
        if file is not None and not loaded:
            _write(file, call, lowered)
        return call

    def _place(self, part: str, level: str) -> Path | None:
        file = self._file
        return None if file is None else file.with_name(f"{file.name.removesuffix('program')}{part}-{level}-program")


def _write(file: Path, call: Any, lowered: Any) -> None:
    """Store a compiled part, if possible. One that jax has loaded from its own cache cannot be serialised. One that
    calls libraries other than LAPACK is not stored, because only LAPACK is known to be available when it is read again.
    """
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
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
