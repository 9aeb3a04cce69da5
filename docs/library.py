"""Listing of the components of the library, generated from their code."""

import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Iterator
from typing import Any

from acausal import Component, Port, Record

from ._modelica import MODELICA

NAME_WIDTH = 30
MODELICA_WIDTH = 40
INDENT = 4
_LINE = r"^ +{name}: .*?  # (?:noqa: \w+  # )?(?P<meaning>.*)$"


def listing(package: types.ModuleType) -> str:
    """The components and records that a package exports.

    Each has its name, its name in MSL, and the first line of its docstring, followed by its parameters with unit,
    default and meaning, and its ports.
    """
    names = MODELICA.get(package.__name__.rpartition(".")[2], {})
    return "\n\n".join("\n".join(_entry(item, names.get(item.__name__, "-"))) for item in exported(package))


def exported(package: types.ModuleType) -> list[type]:
    """The components and records of a package that are not partial, by name."""
    members = [item for _, item in inspect.getmembers(package, inspect.isclass)]
    final = [item for item in members if issubclass(item, Component | Record) and not item._partial]
    return sorted(final, key=lambda item: item.__name__.lower())


def _entry(item: type, modelica: str) -> Iterator[str]:
    summary = (inspect.getdoc(item) or "").split("\n")[0]
    yield f"{item.__name__:{NAME_WIDTH}}{modelica:{MODELICA_WIDTH}}{summary}"
    for name, unit, default, meaning in _parameters(item):
        yield f"{'':{INDENT}}{name:{NAME_WIDTH - INDENT}}{_given(unit, default):{MODELICA_WIDTH}}{meaning}".rstrip()
    if parts := list(_parts(item, Component | Record)):
        yield f"{'':{INDENT}}{'parts':{NAME_WIDTH - INDENT}}{', '.join(parts)}"
    if ports := list(_parts(item, Port)):
        yield f"{'':{INDENT}}{'ports':{NAME_WIDTH - INDENT}}{', '.join(ports)}"


def _given(unit: str, default: Any) -> str:
    if default is inspect.Parameter.empty or default is dataclasses.MISSING:
        return unit
    return f"{unit} = {default:g}" if isinstance(default, float | int) else f"{unit}, optional"


def _parameters(item: type) -> Iterator[tuple[str, str, Any, str]]:
    """Name, unit, default and meaning of each parameter of the constructor."""
    hints = typing.get_type_hints(item.__init__, include_extras=True) | _field_hints(item)
    for name, argument in list(inspect.signature(item.__init__).parameters.items())[1:]:
        declaration = _declaration(hints.get(name))
        if declaration is not None and declaration.role == "param":
            yield name, declaration.unit or "any unit", argument.default, _meaning(item, name)


def _field_hints(item: Any) -> dict[str, Any]:
    fields = {field.name: field.metadata.get("declaration") for field in dataclasses.fields(item)}
    return {name: declaration for name, declaration in fields.items() if declaration is not None}


def _declaration(hint: Any) -> Any:
    """The declaration in the annotation of a field or of an argument, which can be optional."""
    if hasattr(hint, "role"):
        return hint
    found = [_declaration(part) for part in (*getattr(hint, "__metadata__", ()), *typing.get_args(hint))]
    return next((one for one in found if one is not None), None)


def _parts(item: Any, of: Any) -> Iterator[str]:
    """The fields of a kind of parts that the constructor takes or that a user connects."""
    hints, taken = typing.get_type_hints(item), inspect.signature(item.__init__).parameters
    for field in dataclasses.fields(item):
        kinds = [hints[field.name], *typing.get_args(hints[field.name])]
        found = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, of)]
        if found and (of is Port or field.name in taken):
            yield f"{field.name}: {found[0].__name__}" + (" (optional)" if types.NoneType in kinds else "")


def _meaning(item: Any, name: str) -> str:
    """The comment on the line that declares a parameter, in the class or one of its bases, and its names in MSL."""
    pattern = re.compile(_LINE.format(name=re.escape(name)), re.MULTILINE)
    elsewhere = getattr(item, "elsewhere", {}).items()
    others = [other for other, here in elsewhere if name in re.findall(r"\w+", here.split(",")[0])]
    known = f" (MSL {', '.join(others)})" if others else ""
    for cls in item.__mro__[:-1]:
        if cls.__module__.startswith("components") and (found := pattern.search(inspect.getsource(cls))):
            return found["meaning"] + known
    return known.strip()
