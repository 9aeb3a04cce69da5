"""`export_fmu`: writes a model as an FMU."""

import functools as ft
import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..._declare.annotations import Scalar, Var, prefer
from ..._declare.component import Component, Connections, Equations, connect, eq
from ..._declare.node import Port, derived, extended, leaves_of, nodes_of
from ..._errors import ModelError, suggestion
from ..._evaluate.dependence import dependence
from ..._extras import needed
from ..._integrate.setup.options import names_of
from ...codegen.export import c_model
from ...codegen.expressions import identifier
from ...codegen.files import DECLARATIONS, events_of, header_of, source_of
from ...codegen.model import CModel
from ...codegen.source import along
from .description import About, Variables, build_description, description, variables_of
from .source import fmu_source, own_functions

FIELD = "_inputs"


class FromOutside(Component, partial=True):
    """A source of a signal that changes between evaluations only: a state with the rate 0.

    As a state it has exact derivatives, like any other.
    """

    value: Var[Scalar, "", prefer] = 0.0

    def equations(self, d: Any) -> Equations:
        return dict(held=eq(d.value))


@ft.cache
def _source(port: Any) -> Any:
    """A source for a class of signal port."""
    (leaf,) = leaves_of(port())

    def equations(self: Any, d: Any) -> Equations:
        held = FromOutside.equations(self, d)
        return held | dict(signal=eq(getattr(self.port, leaf.path), self.value, check_units=False))

    return derived(FromOutside, {"port": port}, {"port": port(), "equations": equations})


def driven(model: Component, inputs: Sequence[str]) -> tuple[Component, list[str]]:
    """The model with sources at its open inputs, and the paths of the variables that hold their values.

    Raises `ModelError` for a name that is not an open signal input.
    """
    if not inputs:
        return model, []
    ports = {path: node for path, node in nodes_of(model) if isinstance(node, Port) and type(node).needs_connection}
    for name in inputs:
        if inputs.count(name) > 1:
            raise ModelError(f"inputs names {name} more than once.")
        if name not in ports:
            raise ModelError(
                f"{name!r} is not an open signal input, such as a block's u.{suggestion(name, ports)} Quantities that "
                "are constant during a run are parameters, which an FMU can set too."
            )
    classes: tuple[Any, ...] = tuple(type(ports[name]) for name in inputs)
    own_class: Any = type(model)
    cls = _driven_class(own_class, tuple(inputs), classes)
    fields = {}
    for i, (name, port) in enumerate(zip(inputs, classes, strict=True)):
        (leaf,) = leaves_of(ports[name])
        start = leaf.value if leaf.value is not None else leaf.declaration.guess
        fields[f"{FIELD}{i}"] = _source(port)(value=float(start))
    return extended(model, cls, **fields), [f"{name}.value" for name in fields]


@ft.cache
def _driven_class(cls: Any, inputs: tuple[str, ...], ports: tuple[Any, ...]) -> Any:
    def connections(self: Any) -> Connections:
        nodes: dict[str, Any] = dict(nodes_of(self))
        own = [connect(getattr(self, f"{FIELD}{i}").port, nodes[name]) for i, name in enumerate(inputs)]
        return (*cls.connections(self), *own)

    fields = {f"{FIELD}{i}": _source(port) for i, port in enumerate(ports)}
    return derived(cls, fields, {"connections": connections})


# Platform: its name in FMI 2.0, the ending of shared libraries, and the target of zig.
PLATFORMS = {
    "x86_64-linux": ("linux64", "so", "x86_64-linux-gnu"),
    "aarch64-linux": ("aarch64-linux", "so", "aarch64-linux-gnu"),
    "x86_64-windows": ("win64", "dll", "x86_64-windows-gnu"),
    "x86_64-darwin": ("darwin64", "dylib", "x86_64-macos"),
    "aarch64-darwin": ("aarch64-darwin", "dylib", "aarch64-macos"),
}
FLAGS = ["-std=c99", "-O2", "-shared", "-fvisibility=hidden"]


def this_platform() -> str:
    """The platform of this machine."""
    system = {"linux": "linux", "win32": "windows", "darwin": "darwin"}.get(sys.platform, sys.platform)
    machine = {"arm64": "aarch64", "amd64": "x86_64"}.get(_machine(), _machine())
    return f"{machine}-{system}"


def _machine() -> str:
    return sysconfig.get_platform().rpartition("-")[2].lower()


def libraries(
    sources: Mapping[str, str], identifier: str, platforms: Sequence[str] | None, version: int
) -> dict[str, bytes]:
    """The shared libraries by their place in the FMU. Without `platforms`, the one of this machine by its own compiler;
    with, all by zig.

    Raises `ModelError` if there is no compiler, or for an unknown platform.
    """
    if unknown := sorted(set(platforms or ()) - PLATFORMS.keys()):
        raise ModelError(f"The platform {unknown[0]!r} is unknown: there are {', '.join(PLATFORMS)}.")
    found = {}
    for platform in [this_platform()] if platforms is None else platforms:
        folder, ending, target = PLATFORMS.get(platform, (platform, "so", ""))
        command = _own_compiler() if platforms is None else [*_zig(), "-target", target]
        place = f"binaries/{folder if version == 2 else platform}/{identifier}.{ending}"
        found[place] = _compiled(sources, command, is_windows="windows" in platform)
    return found


def _own_compiler() -> list[str]:
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        if name and shutil.which(name):
            return [name]
    raise ModelError(
        "No C compiler was found (CC, cc, gcc or clang). Remedy: install one, or name the platforms, as in "
        'platforms=["x86_64-linux"], which zig compiles for; platforms=[] writes the sources only.'
    )


def _zig() -> list[str]:
    needed("ziglang", "fmi", "A library for a given platform")
    return [sys.executable, "-m", "ziglang", "cc"]


def _compiled(sources: Mapping[str, str], command: list[str], *, is_windows: bool) -> bytes:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text)
        own = [] if is_windows else ["-fPIC", "-lm"]
        run = subprocess.run(
            [*command, *FLAGS, "fmu.c", "-o", "library", *own], cwd=folder, capture_output=True, text=True
        )
        if run.returncode:
            raise ModelError(f"The C compiler failed: {' '.join(command)}\n{run.stderr[-2000:]}")
        return (folder / "library").read_bytes()


def write(file: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write the FMU, a zip file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)


def export_fmu(
    model: Component,
    file: str | Path,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    version: Literal["2.0", "3.0"] = "3.0",
    platforms: Sequence[str] | None = None,
    stop_time: float | None = None,
) -> Path:
    """Write a model as a functional mock-up unit for model exchange and co-simulation, with its sources.

    `inputs` are open signal inputs, such as "motor.u", and `outputs` names of variables, by default all that are not in
    ports. Parameters can be set until the run starts, and at events. States, parameters and outputs have the names and
    units of the model. States start from the values of the model; those that `initialise` has found stay as they are if
    parameters change. The FMU gives exact derivatives with respect to states, inputs and the time, and, in version 3.0,
    adjoint ones. In co-simulation it integrates by Rodas5P with the tolerance of the importer, and locates events.

    The library is compiled for this machine by its C compiler. `platforms`, such as ["x86_64-linux", "x86_64-windows"],
    compiles it for others by zig (`pip install "acausal[fmi]"`); an empty list leaves the sources only.

    Returns the path of the file. Raises `ModelError` for unknown names, for an input whose derivative the equations
    need, for an operation without a C form, and without a C compiler.
    """
    path = Path(file)
    if version not in ("2.0", "3.0"):
        raise ModelError(f"The version of FMI must be '2.0' or '3.0', not {version!r}.")
    number = int(version[0])
    inputs = names_of(inputs, "inputs")
    platforms = None if platforms is None else names_of(platforms, "platforms")
    opened, sources = driven(model, inputs)
    own = identifier(path.stem)
    found = c_model(opened, f"{own}_model", outputs)  # not a name of the C code that all FMUs share
    events, tangents = events_of(found), along(found, with_rest=True)
    header = header_of(found, events, "equations of an FMU", DECLARATIONS)
    equations = source_of(found, events, tangents, own_functions(found, events, tangents))
    variables = variables_of(found, dict(nodes_of(model)), inputs, sources, events.n_relations if events else 0)
    about = About(path.stem, own, _token(header, equations, repr(variables)), _text(model), stop_time)
    texts = {
        f"{found.name}.h": header,
        f"{found.name}.c": equations,
        "fmu.c": fmu_source(found, about, variables, number),
    }
    contents: dict[str, str | bytes] = {
        "modelDescription.xml": description(about, variables, _dependencies(found, variables), number)
    }
    contents |= {f"sources/{name}": text for name, text in texts.items()}
    if number == 3:
        contents["sources/buildDescription.xml"] = build_description(own)
    contents |= libraries(texts, own, platforms, number)
    write(path, contents)
    return path


def _token(*texts: str) -> str:
    """A token that belongs to these equations and variables."""
    digest = hashlib.sha256("".join(texts).encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def _text(model: Component) -> str:
    """The first line of the documentation of the class."""
    return (type(model).__doc__ or "").strip().partition("\n")[0]


def _dependencies(model: CModel, variables: Variables) -> dict[int, list[int]]:
    """The states and inputs on which outputs and rates depend, by value reference."""
    of_place = {v.place: i for i, v in enumerate(variables.all) if v.space == "x"}
    references = [*variables.outputs, *variables.rates]
    found = {i: [i] if variables.all[i].space == "x" else [] for i in references}
    computed = [i for i in references if variables.all[i].space == "v"]
    places = [model.layout.pair_at(variables.all[i].place) for i in computed]
    plan = model.system.plan
    structure = dependence(plan, [pair for pair, _ in places])
    starts = np.cumsum([0, *(plan.size(variable) for (variable, _), _ in places)]).tolist()
    for reference, start, (_, element) in zip(computed, starts, places, strict=False):
        row = structure[[start + element]]
        found[reference] = sorted(of_place[place] for place in row.indices.tolist())
    return found
