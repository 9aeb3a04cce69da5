"""The digest of a program: a hash of everything that determines its compilation."""

import functools as ft
import hashlib
import os
import platform
import sys
import time
from collections.abc import Iterator
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
from ..._jax_private import options
from ..._jax_settings import programs
from ..._reduce.class_equations import initial_templates, required, templates

_IMPORTED = time.time()


def key_of(made_from: list[object], structure: PyTreeDef, kinds: tuple[tuple[tuple[int, ...], object], ...]) -> str:
    """The digest of a program for given structure and shapes. Raises `NoFingerprintError` if it has none."""
    if os.environ.get("XLA_FLAGS") != programs.flags:
        raise NoFingerprintError("XLA_FLAGS changed after the import")
    shapes = [str(kind) for kind in kinds]
    settings = [(k, str(value)) for k, value in options().items() if "cache" not in k and "log" not in k]
    return fingerprint((machine(), settings, programs.flags, list(_nodes(structure)), shapes, made_from))


def _nodes(structure: PyTreeDef) -> Iterator[str]:
    """The nodes of a structure and what they hold. Equal sets count as equal, though their texts may differ."""
    data = structure.node_data()
    kind, own = (None, None) if data is None else data
    try:
        held = fingerprint(own)
    except NoFingerprintError:
        held = str(own)
    yield f"{kind} {held} {structure.num_nodes}"
    for child in structure.children():
        yield from _nodes(child)


@ft.cache
def machine() -> tuple[object, ...]:
    """The environment of a program: the versions of packages, the source of the library, and the processor."""
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
    """Whether the source files are unchanged since the import, according to their modification times."""
    return all(file.stat().st_mtime < _IMPORTED for file in _sources())


def _sources() -> list[Path]:
    """The source files of the library and of the packages whose classes are fingerprinted by name."""
    folders = [Path(__file__).parents[2], *map(_folder, (diffrax, equinox, lineax, optimistix))]
    return [file for folder in folders for file in sorted(folder.rglob("*.py"))]


def _folder(package: ModuleType) -> Path:
    assert package.__file__ is not None
    return Path(package.__file__).parent


def contents(system: System) -> list[object]:
    """The contents of a system: its declarations and connections, and all equations of its components.

    They include the choices of the passes, because each process reads a solution with its own choices.
    """
    flat, events = system.flat, system.events
    # Functions with custom derivative rules are compared up to DERIVATIVES derivatives. In addition to those of index
    # reduction, a linear block, the solver and a gradient take one derivative each.
    if np.max(system.reduced.differentiations, initial=0) > DERIVATIVES - 3:
        raise NoFingerprintError("the index of the equations is too high")
    holders = [
        (
            *(holder.kind.cls, holder.kind.names, holder.kind.sizes, holder.kind.declarations, holder.kind.depth),
            *(holder.paths, holder.stacks, [list(leaves) for leaves in holder.own_leaves]),
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
    functions = (
        [] if events is None else [events.indicators, events.times, events.actions, events.signals, events.delays]
    )
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
    """The digest of the contents of a system. Raises `NoFingerprintError` if they have none."""
    return fingerprint(contents(system))


def equations_of(system: System) -> str | None:
    """The digest of the contents of a system; None if they have none."""
    try:
        return digest_of(system)
    except NoFingerprintError:
        return None


def _choice(system: System) -> list[object]:
    """The function that made the system and its arguments: the choice of states and the form."""
    made, numbers = system.made
    return [made.__name__, [_choice(x) if isinstance(x, System) else x for x in numbers if not _is_model(x)]]


def _is_model(value: object) -> bool:
    return not isinstance(value, System | np.ndarray | None)
