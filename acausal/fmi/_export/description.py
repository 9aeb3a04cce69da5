"""The model description of an FMU in XML: its variables, what it calls them, and where the C code keeps them."""

import collections
import dataclasses
import re
from collections.abc import Container, Mapping, Sequence
from typing import Literal, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..._declare.class_card import comment_of
from ..._declare.node import Node
from ..._errors import ModelError
from ..._evaluate.program import Use
from ..._reduce.incidence import Pair
from ..._unit_check.signal_units import unit_of_leaf
from ..._units.dimension import BASE_UNITS, TIME
from ..._units.parsing import UnknownUnit, parsed
from ...codegen.layout import Quantity
from ...codegen.model import CModel, Output

Causality = Literal["independent", "parameter", "input", "output", "local"]
Space = str  # "t": the time, "x" states, "p" parameters, "d" discrete, "v" values, "z" event indicators, "0" zero


@dataclasses.dataclass(frozen=True)
class FmuVariable:
    """A variable. `derivative_of` is the value reference of the state whose rate it is."""

    name: str
    causality: Causality
    variability: str
    unit: str
    space: Space
    place: int
    sign: int = 1
    start: float | None = None
    derivative_of: int | None = None
    minimum: float | None = None
    description: str = ""


@dataclasses.dataclass(frozen=True)
class Variables:
    """All variables, each with its value reference as its position, and the value references of some kinds."""

    all: list[FmuVariable]
    rates: list[int]
    outputs: list[int]
    indicators: list[int]
    state_places: list[int]  # of the FMU's states in the state vector of the C code, which holds the inputs, too


def variables_of(
    model: CModel, nodes: Mapping[str, Node], inputs: Sequence[str], sources: Sequence[str], n_indicators: int
) -> Variables:
    """The variables of an exported model. `sources` are the paths that hold the values of the inputs, and `nodes` the
    parts of the model by path.

    A state or a discrete variable that is an output is one variable of the FMU, not two.
    """
    shown = {output.name for output in model.outputs}
    signs = _input_places(model, inputs, sources)
    elements = _elements(model.states)
    states = [_stored(item, "x", "continuous", shown) for item in elements if item.place not in signs]
    found = [FmuVariable("time", "independent", "continuous", "s", "t", 0), *states]
    rates = [_rate(model, state, 1 + number) for number, state in enumerate(states)]
    found += rates
    starts = {item.place: item.value for item in elements}
    units = [_unit_of_input(model, name) for name in inputs]
    found += [
        FmuVariable(name, "input", "continuous", unit, "x", place, sign, start=sign * starts[place])
        for name, unit, (place, sign) in zip(inputs, units, signs.items(), strict=True)
    ]
    found += _parameters(model)
    found += [_stored(item, "d", "discrete", shown) for item in _elements(model.discrete)]
    known = {variable.name for variable in found}
    found += [_computed(output) for output in model.outputs if output.name not in known]
    outputs = [reference for reference, variable in enumerate(found) if variable.causality == "output"]
    indicators = range(len(found), len(found) + n_indicators)
    found += [FmuVariable(f"event_indicator[{i}]", "local", "continuous", "", "z", i) for i in range(n_indicators)]
    _check_names(found)
    found = [dataclasses.replace(variable, description=_description(nodes, variable.name)) for variable in found]
    first_rate = 1 + len(states)
    return Variables(
        found,
        list(range(first_rate, first_rate + len(rates))),
        outputs,
        list(indicators),
        [state.place for state in states],
    )


class _Element(NamedTuple):
    """An element of a named array of the C struct."""

    name: str
    unit: str
    place: int
    value: float


def _unit_of_input(model: CModel, name: str) -> str:
    """The unit of a signal, as far as the equations that read it determine one."""
    flat = model.system.flat
    return next(unit_of_leaf(flat, leaf) for path, (leaf, _) in flat.leaf_names.items() if path.startswith(f"{name}."))


def _description(nodes: Mapping[str, Node], name: str) -> str:
    """The comment behind the declaration of a variable or parameter; of an input, that of its port."""
    path, _, field = re.sub(r"(\[\d+\])+$", "", name).rpartition(".")
    return comment_of(type(nodes[path]), field) if path in nodes else ""


def _stored(element: _Element, space: Space, variability: str, shown: Container[str]) -> FmuVariable:
    """A state or a discrete variable."""
    causality = "output" if element.name in shown else "local"
    return FmuVariable(element.name, causality, variability, element.unit, space, element.place, start=element.value)


def _rate(model: CModel, state: FmuVariable, reference: int) -> FmuVariable:
    """The rate of the state with this value reference."""
    place = int(model.rate_places[state.place])
    unit = _per_second(state.unit)
    return FmuVariable(f"der({state.name})", "local", "continuous", unit, "v", place, derivative_of=reference)


def _parameters(model: CModel) -> list[FmuVariable]:
    positive = _positive(model)
    return [
        FmuVariable(
            name, "parameter", "tunable", unit, "p", place, start=value, minimum=0.0 if place in positive else None
        )
        for name, unit, place, value in _elements(model.parameters)
    ]


def _computed(output: Output) -> FmuVariable:
    """An output that the C code evaluates."""
    places = output.places
    return FmuVariable(
        output.name, "output", "continuous", output.unit, places.space or "0", int(places.firsts[0]), places.sign
    )


def _per_second(unit: str) -> str:
    """The unit of a rate."""
    if not unit:
        return ""
    if unit.endswith("/s"):
        return f"{unit}2"
    return str(parsed(unit).dimension / TIME) if "/" in unit else f"{unit}/s"


def _elements(quantities: Sequence[Quantity]) -> list[_Element]:
    """The elements of all quantities."""
    found = []
    for quantity in quantities:
        for i, value in enumerate(quantity.value.tolist()):
            name = quantity.name if quantity.size == 1 else f"{quantity.name}[{i}]"
            found.append(_Element(name, quantity.unit, quantity.place + i, float(value)))
    return found


def _input_places(model: CModel, inputs: Sequence[str], sources: Sequence[str]) -> dict[int, int]:
    """The place of each input in the state vector, with the sign of the state.

    Raises `ModelError` if an input is no state of its own, or if equations need its derivative.
    """
    system, found = model.system, {}
    nodes = {leaf.path: leaf.first for leaf in system.flat.own_leaves if leaf.declaration.is_variable}
    starts = dict(zip(system.states, system.plan.starts.tolist(), strict=False))
    uses = [use for group in system.plan.groups for use in group.uses]
    for name, source in zip(inputs, sources, strict=True):
        pair, sign = system.pair_of_node(nodes[source])
        if pair is None or pair not in starts or any(_needs_rate(use, pair) for use in uses):
            raise ModelError(
                f"{name} cannot be an input of an FMU: the equations need its derivative, or determine it. Remedy: "
                "drive a force, a torque or a current, or put a filter such as FirstOrder behind the input."
            )
        found[starts[pair]] = sign
    return found


def _needs_rate(use: Use, pair: Pair) -> bool:
    """Whether a block reads the derivative of an input, or determines it together with other unknowns."""
    rate = pair[0], 1
    return rate in use.values or (rate in use.gives and len(use.gives) > 1)


def _positive(model: CModel) -> set[int]:
    """The places of parameters that cannot be negative."""
    found: set[int] = set()
    for leaf, start in model.layout.params.items():
        sign = model.system.flat.leaves[leaf].declaration.sign
        if sign is not None and sign.name in ("positive", "nonnegative"):
            found |= set(range(start, start + model.layout.size(leaf)))
    return found


def _check_names(variables: Sequence[FmuVariable]) -> None:
    counts = collections.Counter(variable.name for variable in variables)
    if several := [name for name, count in counts.items() if count > 1]:
        raise ModelError(f"An FMU has one variable of each name, but the model has several of {', '.join(several)}.")


TOOL = "acausal"


@dataclasses.dataclass(frozen=True)
class About:
    """Name, token and description of an FMU."""

    name: str
    identifier: str  # of its files and functions
    token: str
    description: str
    stop_time: float | None


def description(about: About, variables: Variables, dependencies: dict[int, list[int]], version: int) -> str:
    """The text of modelDescription.xml for FMI 2.0 or 3.0. `dependencies` are those of outputs and rates."""
    root = _root(about, variables, version)
    _interfaces(root, about, version)
    _units(root, variables)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="error", description="Errors, with the path of the component")
    if about.stop_time is not None:
        SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=_number(about.stop_time))
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables.all):
        (_variable_3 if version == 3 else _variable_2)(listed, reference, variable)
    (_structure_3 if version == 3 else _structure_2)(root, variables, dependencies)
    ElementTree.indent(root, "  ")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def build_description(identifier: str) -> str:
    """The text of sources/buildDescription.xml of FMI 3.0."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    SubElement(files, "SourceFile", name="fmu.c")
    ElementTree.indent(root, "  ")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _root(about: About, variables: Variables, version: int) -> Element:
    token = {"instantiationToken": about.token} if version == 3 else {"guid": about.token}
    count = {} if version == 3 else {"numberOfEventIndicators": str(len(variables.indicators))}
    attributes = {"fmiVersion": f"{version}.0", "modelName": about.name, **token}
    attributes |= {"description": about.description} if about.description else {}
    return Element("fmiModelDescription", {**attributes, "generationTool": TOOL, **count})


def _interfaces(root: Element, about: About, version: int) -> None:
    if version == 3:
        derivatives = {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}
        copies = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    else:
        derivatives = {"providesDirectionalDerivative": "true"}
        copies = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
    steps = {"canHandleVariableCommunicationStepSize": "true"}
    exchange = {} if version == 3 else {"completedIntegratorStepNotNeeded": "true"}
    common = {"modelIdentifier": about.identifier, **copies, **derivatives}
    for kind, own in (("ModelExchange", exchange), ("CoSimulation", steps)):
        element = SubElement(root, kind, {**common, **own})
        if version == 2:
            SubElement(SubElement(element, "SourceFiles"), "File", name="fmu.c")


def _units(root: Element, variables: Variables) -> None:
    units = dict.fromkeys(variable.unit for variable in variables.all if _base_unit(variable.unit) is not None)
    if not units:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for unit in units:
        SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", _base_unit(unit) or {})


def _base_unit(unit: str) -> dict[str, str] | None:
    """The exponents of the base units; None for a unit that FMI cannot express."""
    if not unit:
        return None
    try:
        exponents = parsed(unit).dimension.exponents
    except UnknownUnit:
        return None
    if any(exponent.denominator != 1 for exponent in exponents):
        return None
    pairs = zip(BASE_UNITS, exponents, strict=True)
    return {name: str(exponent) for name, exponent in pairs if exponent}


def _number(value: float) -> str:
    """A number as XML writes it."""
    return repr(float(value) + 0.0).replace("inf", "INF").replace("nan", "NaN")


def _initial(variable: FmuVariable) -> str | None:
    """The attribute `initial` of a variable; None if FMI fixes it."""
    if variable.causality in ("independent", "input"):
        return None
    return "calculated" if variable.start is None else "exact"


def _common(variable: FmuVariable, reference: int) -> dict[str, str]:
    attributes = {"name": variable.name, "valueReference": str(reference), "causality": variable.causality}
    attributes |= {"description": variable.description} if variable.description else {}
    attributes["variability"] = variable.variability
    if (initial := _initial(variable)) is not None:
        attributes["initial"] = initial
    return attributes


def _real(variable: FmuVariable) -> dict[str, str]:
    attributes = {"unit": variable.unit} if _base_unit(variable.unit) is not None else {}
    attributes |= {} if variable.minimum is None else {"min": _number(variable.minimum)}
    return attributes | ({} if variable.start is None else {"start": _number(variable.start)})


def _variable_3(listed: Element, reference: int, variable: FmuVariable) -> None:
    attributes = _common(variable, reference) | _real(variable)
    if variable.derivative_of is not None:
        attributes["derivative"] = str(variable.derivative_of)
    if variable.space == "x" and variable.causality != "input":
        attributes["reinit"] = "true"
    SubElement(listed, "Float64", attributes)


def _variable_2(listed: Element, reference: int, variable: FmuVariable) -> None:
    real = _real(variable)
    if variable.derivative_of is not None:
        real["derivative"] = str(variable.derivative_of + 1)
    if variable.space == "x" and variable.causality != "input":
        real["reinit"] = "true"
    SubElement(SubElement(listed, "ScalarVariable", _common(variable, reference)), "Real", real)


def _structure_3(root: Element, variables: Variables, dependencies: dict[int, list[int]]) -> None:
    structure = SubElement(root, "ModelStructure")
    parts = (("Output", variables.outputs), ("ContinuousStateDerivative", variables.rates))
    for kind, references in (*parts, ("InitialUnknown", _unknown(variables))):
        for reference in references:
            attributes = {"valueReference": str(reference)}
            if kind != "InitialUnknown":
                attributes["dependencies"] = " ".join(map(str, dependencies[reference]))
            SubElement(structure, kind, attributes)
    for reference in variables.indicators:
        SubElement(structure, "EventIndicator", valueReference=str(reference))


def _structure_2(root: Element, variables: Variables, dependencies: dict[int, list[int]]) -> None:
    structure = SubElement(root, "ModelStructure")
    parts = (("Outputs", variables.outputs), ("Derivatives", variables.rates), ("InitialUnknowns", _unknown(variables)))
    for kind, references in parts:
        if not references:
            continue
        element = SubElement(structure, kind)
        for reference in references:
            attributes = {"index": str(reference + 1)}
            if kind != "InitialUnknowns":
                attributes["dependencies"] = " ".join(str(other + 1) for other in dependencies[reference])
            SubElement(element, "Unknown", attributes)


def _unknown(variables: Variables) -> Sequence[int]:
    """The variables that initialisation calculates."""
    both = [*variables.outputs, *variables.rates]
    return sorted(reference for reference in both if variables.all[reference].start is None)
