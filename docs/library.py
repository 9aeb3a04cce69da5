"""Listing of the components of the library, generated from their code."""

import inspect
import types
from collections.abc import Iterator

from acausal import Component, Port, Record
from acausal._declare.class_card import Row, own_text, parameters, parts

from ._modelica import MODELICA

NAME_WIDTH = 30
MODELICA_WIDTH = 40
INDENT = 4
_SEPARATOR = {"=": " ", "o": ", "}  # before "= 1", before "optional"


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
    summary = own_text(item).split("\n")[0]
    yield f"{item.__name__:{NAME_WIDTH}}{modelica:{MODELICA_WIDTH}}{summary}"
    for row in parameters(item):
        given = f"{row.kind}{_SEPARATOR.get(row.default[:1], '')}{row.default}"
        yield f"{'':{INDENT}}{row.name:{NAME_WIDTH - INDENT}}{given:{MODELICA_WIDTH}}{row.meaning}".rstrip()
    taken = inspect.signature(item).parameters
    held = [row for row in parts(item, (Component, Record)) if row.name in taken]
    for heading, rows in (("parts", held), ("ports", list(parts(item, Port)))):
        if rows:
            yield f"{'':{INDENT}}{heading:{NAME_WIDTH - INDENT}}{', '.join(map(_part, rows))}"


def _part(row: Row) -> str:
    return f"{row.name}: {row.kind}" + (" (optional)" if row.default else "")
