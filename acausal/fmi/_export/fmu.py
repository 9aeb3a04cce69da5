"""`export_fmu`: writes a model as an FMU."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ..._declare.component import Component
from ..._declare.node import nodes_of
from ..._errors import ModelError
from ..._evaluate.dependence import dependence
from ..._integrate.setup.options import names_of
from ...codegen.derivatives import along
from ...codegen.expressions import identifier
from ...codegen.files import DECLARATIONS, events_of, header_of, source_of
from ...codegen.model import CModel
from ...codegen.prepare import c_model
from .build import libraries, write
from .description import About, build_description, description
from .opened import driven
from .source import fmu_source, own_functions
from .variables import Variables, variables_of


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
