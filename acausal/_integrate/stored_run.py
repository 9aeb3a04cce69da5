"""Runs by programs that earlier processes have left in the library's cache, which need neither tracing nor lowering.

jax's own cache is asked for a program once that is traced and lowered, which takes longer than all else in a second
process. Here it is found by what it would be traced from (`made_from.py`). Where there is any doubt about that, a run
is traced, and nothing is stored.
"""

import contextlib
import functools as ft
import io
import pickle
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax import monitoring

from .. import _program_files as files
from .._fingerprint import NoFingerprintError
from .._jax_private import trace_context
from .._jax_settings import programs
from .._tracing import is_traced, within_transformation
from . import run as traced
from .field import Given
from .made_from import is_as_imported, key_of
from .settings import Settings
from .solution import Solution

Program = Callable[[list[Any]], Solution]


def run(settings: Settings, given: Given) -> Solution:
    """As `run.run`, where possible by a stored program; else what is compiled is stored, where that is possible."""
    leaves, structure = jax.tree.flatten(given)
    if within_transformation() or programs.folder is None or not _is_usual() or not all(map(_is_plain, leaves)):
        return traced.run(settings, given)
    kinds = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
    program = _program(settings, structure, kinds)
    return traced.run(settings, given) if program is None else program(leaves)


def _is_plain(leaf: Any) -> bool:
    """Whether a number is known and lies where programs run by default."""
    if isinstance(leaf, np.ndarray | np.generic):
        return True
    return isinstance(leaf, jax.Array) and not is_traced(leaf) and len(leaf.devices()) == 1 and not leaf.weak_type


def _is_usual() -> bool:
    """Whether jax compiles for the processor, and with the settings that it had when the library was imported."""
    config: Any = jax.config
    others = (config.jax_debug_nans, config.jax_debug_infs, config.jax_disable_jit, config.jax_default_device)
    if any(others) or not config.jax_enable_x64 or trace_context() != programs.context:
        return False
    return jax.default_backend() == "cpu" and jax.device_count() == 1


@ft.lru_cache(maxsize=256)
def _program(settings: Settings, structure: Any, kinds: tuple[tuple[tuple[int, ...], Any], ...]) -> Program | None:
    """The program for numbers of these shapes; None where what it is made from cannot be told."""
    assert programs.folder is not None
    try:
        file = programs.folder / f"run-{key_of(settings, structure, kinds)}-program"
    except NoFingerprintError:
        return None
    if (found := _loaded(file, settings, len(kinds))) is not None:
        return found
    return _compiled(file, settings, structure, kinds)


def _compiled(file: Path, settings: Settings, structure: Any, kinds: Any) -> Program:
    """Compile a run and store its program."""
    solutions: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, solution = jax.tree.flatten(traced.run(settings, structure.unflatten(leaves)))
        solutions[:] = [solution]
        return found

    run.__name__ = file.stem.replace("-", "_")  # in jax's own cache, too, each version has a name
    lowered = jax.jit(run).lower(*(jax.ShapeDtypeStruct(*kind) for kind in kinds))
    with _loads() as loaded:
        call = lowered.compile()
    n = lowered.out_tree.num_leaves
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
    # A program that jax has read from its own cache cannot be serialised. One that calls other libraries than LAPACK is
    # not stored: only LAPACK is known to be ready where it is loaded again.
    if not loaded and all(name.startswith("lapack_") for name in library) and is_as_imported():
        with contextlib.suppress(Exception):  # the program runs all the same
            _store(file, _without_settings(solutions[0].unflatten(range(n)), settings), call, bool(library))
    return lambda leaves: solutions[0].unflatten(call(*leaves))


@contextlib.contextmanager
def _loads() -> Any:
    """What jax reads from its own cache meanwhile."""
    found: list[str] = []

    def note(event: str, **others: Any) -> None:
        if event.endswith("/cache_hits"):
            found.append(event)

    monitoring.register_event_listener(note)
    try:
        yield found
    finally:
        monitoring.unregister_event_listener(note)


def _store(file: Path, solution: bytes, call: Any, needs_lapack: bool) -> None:
    from jax.experimental import serialize_executable

    payload, _, outputs = serialize_executable.serialize(call)
    files.write(file, zlib.compress(pickle.dumps((payload, outputs.num_leaves, solution, needs_lapack)), 1))


def _loaded(file: Path, settings: Settings, n: int) -> Program | None:
    """The program in a file; None where there is none, or none that can be read."""
    from jax.experimental import serialize_executable

    content = files.read(file)
    if content is None:
        return None
    try:
        payload, n_outputs, solution, needs_lapack = pickle.loads(zlib.decompress(content))
        if needs_lapack:  # jax loads LAPACK when it lowers a program that calls it
            jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))
        takes, gives = jax.tree.structure((tuple(range(n)), {})), jax.tree.structure(list(range(n_outputs)))
        call = serialize_executable.deserialize_and_load(payload, takes, gives)
        whole = jax.tree.structure(_Reader(io.BytesIO(solution), settings).load())
    except Exception:  # a file that cannot be read is made anew
        return None
    return lambda leaves: whole.unflatten(call(*leaves))


def _held(settings: Settings) -> dict[str, Any]:
    """What solutions hold that is there already, and cannot all be stored."""
    return {
        "system": settings.system,
        "peaks": None if settings.peaks is None else settings.peaks.tree,
        "integrals": None if settings.integrand is None else settings.integrand.tree,
    }


def _without_settings(solution: Solution, settings: Settings) -> bytes:
    stream = io.BytesIO()
    _Writer(stream, settings).dump(solution)
    return stream.getvalue()


class _Writer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, settings: Settings) -> None:
        super().__init__(stream)
        self.names = {id(value): name for name, value in _held(settings).items() if value is not None}

    def persistent_id(self, obj: Any) -> str | None:
        return self.names.get(id(obj))


class _Reader(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, settings: Settings) -> None:
        super().__init__(stream)
        self.held = _held(settings)

    def persistent_load(self, pid: str) -> Any:
        return self.held[pid]
