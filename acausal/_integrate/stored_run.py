"""Runs by programs that earlier processes have left in the library's cache, which need neither tracing nor lowering.

jax's own cache is asked for a program once that is traced and lowered, which takes longer than all else in a second
process. Here it is found by what it would be traced from (`_made_from`).
"""

import contextlib
import dataclasses
import functools as ft
import io
import os
import pickle
import platform
import re
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import diffrax
import equinox
import jax
import jaxlib
import lineax
import numpy as np
import optimistix
from jax import monitoring

from .._evaluate.system import System
from .._fingerprint import DERIVATIVES, NoFingerprintError, fingerprint
from .._jax_settings import programs
from .._reduce.required import required
from .._reduce.stated import initial_templates, templates
from .._tracing import is_traced, within_transformation
from . import run as traced
from .field import Given
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
    """Whether jax compiles for the processor, and as it does by default."""
    config: Any = jax.config
    others = (config.jax_debug_nans, config.jax_debug_infs, config.jax_disable_jit, config.jax_default_device)
    return not any(others) and config.jax_enable_x64 and jax.default_backend() == "cpu" and jax.device_count() == 1


@ft.lru_cache(maxsize=256)
def _program(settings: Settings, structure: Any, kinds: tuple[tuple[tuple[int, ...], Any], ...]) -> Program | None:
    """The program for numbers of these shapes; None where what it is made from cannot be told."""
    assert programs.folder is not None
    try:
        given = structure.unflatten(kinds).inputs.given  # the leaves whose start values are given
        shapes = [str(kind) for kind in kinds]
        key = fingerprint((_versions(), str(structure), shapes, given, _made_from(settings)))
    except NoFingerprintError:
        return None
    file = programs.folder / f"run-{key}-program"
    if (found := _loaded(file, settings, len(kinds))) is not None:
        return found
    return _compiled(file, settings, structure, kinds)


@ft.cache
def _versions() -> tuple[Any, ...]:
    """What programs from the same contents differ by: the packages and their settings, the library, the processor."""
    packages = (jax, jaxlib, diffrax, equinox, lineax, optimistix, np)
    settings = [(k, str(v)) for k, v in jax.config.values.items() if "cache" not in k and "log" not in k]
    info = Path("/proc/cpuinfo")
    lines = info.read_text().partition("\n\n")[0].splitlines() if info.exists() else [platform.node()]
    processor = [line for line in lines if line.startswith(("model", "flags", "Features", "CPU"))] or lines
    return (
        *(package.__version__ for package in packages),
        *(sys.version, platform.machine(), processor, settings, os.environ.get("XLA_FLAGS"), _SOURCES),
    )


def _sources() -> list[tuple[str, int, int]]:
    """The files of the library, as they are when it is imported."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return [(str(file), file.stat().st_mtime_ns, file.stat().st_size) for file in files]


_SOURCES = _sources()


def _made_from(settings: Settings) -> list[Any]:
    """All that a run is traced from, but for the library itself."""
    if settings.adjoint is not None or not isinstance(settings.progress, diffrax.NoProgressMeter):
        raise NoFingerprintError("a way of differentiating, or a meter of progress")
    functions = (settings.stop, settings.integrand, settings.peaks, settings.stored)
    seen = ("system", "stop", "integrand", "peaks", "stored", "adjoint", "progress")
    return [
        *_system(settings.system),
        *(None if f is None else (f.closed, f.leaves) for f in functions),
        *(getattr(settings, field.name) for field in dataclasses.fields(settings) if field.name not in seen),
    ]


def _system(system: System) -> list[Any]:
    """What a system is made from: what was declared and connected, and all that the components state."""
    flat, events = system.flat, system.events
    if np.max(system.reduced.differentiations, initial=0) >= DERIVATIVES:  # and the solver differentiates once more
        raise NoFingerprintError("equations of too high an index")
    holders = [
        (
            *(holder.kind.cls, holder.kind.names, holder.kind.sizes, holder.kind.declarations, holder.kind.depth),
            *(holder.paths, holder.stacks, holder.first_leaf),
            [(t.name, t.jaxpr, t.inputs, t.signs) for t in stated(holder.kind)],
            [(needed.texts, needed.slots, needed.jaxpr) for needed in [required(holder.kind)]],
        )
        for holders, stated in (
            (flat.instances, ft.partial(templates, split=flat.split)),
            (flat.composites, lambda kind: ()),
            (flat.starters, initial_templates),
        )
        for holder in holders
    ]
    functions = [] if events is None else [events.truths, events.margins, events.times, events.actions]
    return [
        *(flat.leaves, flat.n_nodes, holders, flat.across, flat.flow_sets, flat.split),
        *([] if events is None else [events.entries]),
        [(f.closed, f.leaves) for f in functions],
        _choice(system),
    ]


def _choice(system: System) -> list[Any]:
    """By what its states were chosen, and in which form it is."""
    made, numbers = system.made
    return [made.__name__, [_choice(x) if isinstance(x, System) else x for x in numbers if not _is_model(x)]]


def _is_model(value: Any) -> bool:
    return not isinstance(value, System | np.ndarray | None)


def _compiled(file: Path, settings: Settings, structure: Any, kinds: Any) -> Program:
    """Compile a run and store its program."""
    solutions: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, solution = jax.tree.flatten(traced.run(settings, structure.unflatten(leaves)))
        solutions[:] = [solution]
        return found

    run.__name__ = file.stem.replace("-", "_")  # so that jax takes it for no program of earlier versions
    lowered = jax.jit(run).lower(*(jax.ShapeDtypeStruct(*kind) for kind in kinds))
    with _loads() as loaded:
        call = lowered.compile()
    n = lowered.out_tree.num_leaves
    library = set(re.findall(r"custom_call @(\w+)", lowered.as_text()))
    # What jax has read from its own cache cannot be stored again, and only of LAPACK is known how it gets ready.
    if not loaded and all(name.startswith("lapack_") for name in library):
        with contextlib.suppress(pickle.PicklingError, AttributeError, TypeError, ValueError, OSError):
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
    """Write a program: elsewhere first, so that no other process reads half of it."""
    from jax.experimental import serialize_executable

    payload, _, outputs = serialize_executable.serialize(call)
    part = file.with_name(f"{file.name}.{os.getpid()}")
    part.write_bytes(zlib.compress(pickle.dumps((payload, outputs.num_leaves, solution, needs_lapack)), 1))
    part.replace(file)


def _loaded(file: Path, settings: Settings, n: int) -> Program | None:
    """The program in a file; None where there is none, or none that can be read."""
    from jax.experimental import serialize_executable

    try:
        payload, n_outputs, solution, needs_lapack = pickle.loads(zlib.decompress(file.read_bytes()))
        if needs_lapack:  # which jax loads when it lowers a program with it
            jax.jit(jax.lax.linalg.lu).lower(jax.ShapeDtypeStruct((1, 1), float))
        takes, gives = jax.tree.structure((tuple(range(n)), {})), jax.tree.structure(list(range(n_outputs)))
        call = serialize_executable.deserialize_and_load(payload, takes, gives)
        whole = jax.tree.structure(_Reader(io.BytesIO(solution), settings).load())
    except FileNotFoundError:
        return None
    except Exception:  # whatever is wrong with it, it can be made anew
        file.unlink(missing_ok=True)
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
