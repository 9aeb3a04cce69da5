"""The model description of an FMU in XML."""

import dataclasses
from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..._units.dimension import BASE_UNITS
from ..._units.parsing import UnknownUnit, parsed
from .variables import FmuVariable, Variables

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
