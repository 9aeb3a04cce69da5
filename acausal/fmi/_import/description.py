"""Declarations of an FMU: its parameters, inputs, states and outputs, sorted and named for Python."""

import dataclasses
import keyword
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._errors import ModelError
from ..._extras import needed
from ..._units.parsing import UnknownUnit, parsed

REAL = ("Real", "Float64")
WHOLE = ("Integer", "Enumeration", "Boolean", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))


@dataclasses.dataclass(frozen=True)
class ImportedVariable:
    """A variable of the FMU. `sizes` is its shape, empty for a scalar."""

    name: str
    field: str  # attribute of the component
    reference: int
    kind: str  # its type in FMI
    unit: str
    start: np.ndarray
    sizes: tuple[int, ...]
    description: str
    is_given: bool  # whether its start value is given, rather than calculated by the FMU

    @property
    def count(self) -> int:
        return math.prod(self.sizes)


@dataclasses.dataclass(frozen=True)
class Description:
    """The parts of a model description that the component needs."""

    raw: Any  # of FMPy
    parameters: tuple[ImportedVariable, ...]  # with the inputs that may change at events only
    inputs: tuple[ImportedVariable, ...]
    states: tuple[ImportedVariable, ...]
    rates: tuple[ImportedVariable, ...]
    outputs: tuple[ImportedVariable, ...]
    direct: tuple[bool, ...]  # whether each output depends on inputs
    fixed: tuple[ImportedVariable, ...]  # whole numbers, which are set before a run
    indicators: tuple[int, ...]  # value references; those of FMI 2.0 have none
    n_indicators: int

    @property
    def version(self) -> int:
        return int(self.raw.fmiVersion[0])

    @property
    def n_states(self) -> int:
        return size_of(self.states)

    @property
    def n_inputs(self) -> int:
        return size_of(self.inputs)


def size_of(variables: Iterable[ImportedVariable]) -> int:
    """The number of scalars."""
    return sum(variable.count for variable in variables)


def placed(variables: Iterable[ImportedVariable], place: int = 0) -> Iterator[tuple[ImportedVariable, int]]:
    """Variables whose values follow each other in an array, each with its place."""
    for variable in variables:
        yield variable, place
        place += variable.count


def read(path: Path, reserved: Iterable[str], extra: Sequence[str]) -> Description:
    """Read a model description. `extra` names further variables to show as outputs."""
    fmpy = needed("fmpy", "fmi", "An FMU")
    try:
        raw = fmpy.read_model_description(str(path))
    except Exception as error:
        raise ModelError(f"{path.name} has no readable model description: {error}") from error
    if raw.fmiVersion[0] not in "23":
        raise ModelError(f"{path.name} is an FMU of FMI {raw.fmiVersion}; FMI 2.0 and 3.0 can be read.")
    unique = [v for v in raw.modelVariables if v.alias is None]
    names = _fields([v.name for v in unique], reserved)
    made = {id(v): _variable(v, names[v.name]) for v in unique if v.type in REAL + WHOLE}
    by_name = {v.name: v for v in unique}
    if missing := [name for name in extra if name not in by_name or id(by_name[name]) not in made]:
        raise ModelError(f"{path.name} has no numeric variable {', '.join(missing)}.")
    rates = [unknown.variable for unknown in raw.derivatives]
    shown = [v for v in unique if id(v) in made and (v.causality == "output" or v.name in extra)]
    real = [v for v in unique if v.type in REAL]
    inputs = [v for v in real if v.causality == "input" and v.variability in ("continuous", None)]
    dependencies = {unknown.variable.name: unknown.dependencies for unknown in raw.outputs}
    taken = {id(v) for v in inputs}
    known = [dependencies.get(v.name) for v in shown]
    return Description(
        raw,
        tuple(made[id(v)] for v in real if v.causality == "parameter" or (v.causality == "input" and v not in inputs)),
        tuple(made[id(v)] for v in inputs),
        tuple(made[id(rate.derivative)] for rate in rates),
        tuple(made[id(rate)] for rate in rates),
        tuple(made[id(v)] for v in shown),
        tuple(found is None or any(id(v) in taken for v in found) for found in known),
        tuple(made[id(v)] for v in unique if v.type in WHOLE and v.causality in ("parameter", "input")),
        tuple(unknown.variable.valueReference for unknown in raw.eventIndicators),
        int(raw.numberOfEventIndicators),
    )


def _fields(names: Sequence[str], reserved: Iterable[str]) -> dict[str, str]:
    """Attributes by variable: `body.frame[1]` becomes `body_frame_1`."""
    found: dict[str, str] = {}
    taken = set(reserved)
    for name in names:
        field = re.sub(r"\W+", "_", name).strip("_") or "variable"
        if field[0].isdigit():
            field = f"v_{field}"
        while field in taken or keyword.iskeyword(field):
            field += "_"
        taken.add(field)
        found[name] = field
    return found


def _variable(v: Any, field: str) -> ImportedVariable:
    sizes = tuple(int(n) for n in v.shape or ())
    words = [_number(word) for word in str(v.start or 0).split()]
    start = np.resize(np.asarray(words), sizes) if sizes else np.asarray(words[0])
    unit = _unit(v.unit or (v.declaredType.unit if v.declaredType is not None else None))
    is_given = v.initial in (None, "exact", "approx")
    return ImportedVariable(v.name, field, v.valueReference, v.type, unit, start, sizes, v.description or "", is_given)


def _number(word: str) -> float:
    return float(word == "true") if word in ("true", "false") else float(word)


def _unit(name: str | None) -> str:
    """The unit, if it is an SI unit that the library knows; otherwise "", which is not checked."""
    if not name:
        return ""
    try:
        return name if parsed(name).is_si else ""
    except UnknownUnit:
        return ""
