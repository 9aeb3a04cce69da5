"""What a program is made from: everything that decides which one is compiled, as a digest."""

import functools as ft
import hashlib
import os
import platform
import sys
import time
from pathlib import Path
from types import ModuleType

import diffrax
import equinox
import jax
import jaxlib
import lineax
import numpy as np
import optimistix
from jax.tree_util import PyTreeDef

from ..._evaluate.system import System
from ..._fingerprint import DERIVATIVES, NoFingerprintError, fingerprint
from ..._jax_settings import programs
from ..._reduce.required import required
from ..._reduce.stated import initial_templates, templates

_IMPORTED = time.time()


def key_of(made_from: list[object], structure: PyTreeDef, kinds: tuple[tuple[tuple[int, ...], object], ...]) -> str:
    """The digest of a program for numbers of some structure and shapes. Raises `NoFingerprintError` for none."""
    if os.environ.get("XLA_FLAGS") != programs.flags:
        raise NoFingerprintError("flags that XLA may have read or not")
    shapes = [str(kind) for kind in kinds]
    options = [(k, str(value)) for k, value in jax.config.values.items() if "cache" not in k and "log" not in k]
    return fingerprint((machine(), options, programs.flags, str(structure), shapes, made_from))


@ft.cache
def machine() -> tuple[object, ...]:
    """What programs from the same contents differ by: the packages, the library itself, the processor."""
    packages = (jax, jaxlib, diffrax, equinox, lineax, optimistix, np)
    info = Path("/proc/cpuinfo")
    lines = info.read_text().partition("\n\n")[0].splitlines() if info.exists() else [platform.node()]
    processor = [line for line in lines if line.startswith(("model", "flags", "Features", "CPU"))] or lines
    sources = hashlib.sha256()
    for file in _sources():
        sources.update(hashlib.sha256(file.read_bytes()).digest())
    return (
        *(package.__version__ for package in packages),
        *(sys.version, platform.machine(), processor, sources.hexdigest()),
    )


def is_as_imported() -> bool:
    """Whether the files of the libraries are those that were imported, as far as the clock can tell."""
    return all(file.stat().st_mtime < _IMPORTED for file in _sources())


def _sources() -> list[Path]:
    """The files whose classes are known by name."""
    folders = [Path(__file__).parents[2], *map(_folder, (diffrax, equinox, lineax, optimistix))]
    return [file for folder in folders for file in sorted(folder.rglob("*.py"))]


def _folder(package: ModuleType) -> Path:
    assert package.__file__ is not None
    return Path(package.__file__).parent


def contents(system: System) -> list[object]:
    """What a system is made from: what was declared and connected, and all that the components state.

    The choices that the passes have made belong to it, too: a solution is read by those of the process that reads it.
    """
    flat, events = system.flat, system.events
    # Functions with derivative rules of their own are compared up to DERIVATIVES derivatives. Besides those that index
    # reduction takes, a linear block takes one, and the solver another.
    if np.max(system.reduced.differentiations, initial=0) > DERIVATIVES - 2:
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
    functions = [] if events is None else [events.margins, events.times, events.actions]
    return [
        *(flat.leaves, flat.n_nodes, holders, flat.across, flat.flow_sets, flat.split),
        *([] if events is None else [events.entries, events.logic]),
        [(f.closed, f.leaves) for f in functions],
        _choice(system),
        *(system.merged.representative, system.merged.sign, system.ordered.table.variables, system.nominals),
        *(system.states, system.algebraic, system.carried.memory, system.intake.used),
    ]


@ft.lru_cache(maxsize=256)
def digest_of(system: System) -> str:
    """The digest of what a system is made from. Raises `NoFingerprintError` where that cannot be told."""
    return fingerprint(contents(system))


def equations_of(system: System) -> str | None:
    """The same; None where it cannot be told."""
    try:
        return digest_of(system)
    except NoFingerprintError:
        return None


def _choice(system: System) -> list[object]:
    """By what its states were chosen, and in which form it is."""
    made, numbers = system.made
    return [made.__name__, [_choice(x) if isinstance(x, System) else x for x in numbers if not _is_model(x)]]


def _is_model(value: object) -> bool:
    return not isinstance(value, System | np.ndarray | None)
