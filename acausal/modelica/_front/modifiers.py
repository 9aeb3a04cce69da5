"""Values of parameters as Modelica text, and modifiers that give them."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..._errors import ModelError
from .._errors import ModelicaError
from .._syntax.read import flat_model
from .._translate.known import KnownValues
from .._translate.paths import PathTree, split, tree_of
from .._translate.scope import NotKnown

_ELEMENTS = (
    "{} selects equations and reads an outer component, but not all elements of its array have a value. "
    "Remedy: declare them as separate components."
)


class KnownContent:
    """The values of the parameters and constants of a flat model."""

    def __init__(self, content: dict[str, Any]) -> None:
        self._flat = flat_model(content, "")
        self._known = KnownValues(self._flat)
        self._known.structural |= {v.name for v in self._flat.variables.values() if v.variability == "parameter"}

    def value(self, name: str) -> Any:
        """The value of a variable; None if it has none, or none that is known when the model is loaded."""
        variable = self._flat.variables[name]
        if not self._known.has(variable) or (variable.binding is None and variable.start is None):
            return None
        try:
            return self._known.value_of(variable)
        except (NotKnown, ModelError):
            return None


class ValueTexts:
    """The values of the parameters and constants of a flat model as text."""

    def __init__(self, content: dict[str, Any]) -> None:
        self._content, self._known = content, KnownContent(content)
        self._enumerations = dict(_enumerations(content, content))

    def text(self, name: str) -> str | None:
        """The value of a variable; None if it has none, or none that is known when the model is loaded."""
        value = self._known.value(name)
        return None if value is None else _text(value, self._literals(name))

    def _literals(self, name: str) -> dict[int, str]:
        """The literals of the enumeration of a variable by their ordinals; none if it has another type."""
        declared = self._content["effective_types"][str(self._content["variables"][name]["type_id"])]
        return self._enumerations.get(declared["canonical_type"], {})


def _text(value: Any, literals: dict[int, str]) -> str:
    if np.ndim(value):
        return "{" + ", ".join(_text(item, literals) for item in value) + "}" if np.size(value) else _empty(value)
    plain = np.asarray(value).item()
    return literals[plain] if literals else json.dumps(plain)


def _empty(value: Any) -> str:
    return f"fill(0, {', '.join(str(size) for size in np.shape(value))})"


def _enumerations(node: Any, content: dict[str, Any]) -> Iterator[tuple[int, dict[int, str]]]:
    """The enumerations that occur in a flat model, by their types: literals by ordinals."""
    ordinals = content["enum_literal_ordinals"]
    if isinstance(node, dict) and "VarRef" in node:
        name = node["VarRef"]["name"]
        if name["name"] in ordinals and name["component_ref"]:
            type_ = content["type_ids_by_def_id"].get(str(name["component_ref"]["parts"][-1]["def_id"]))
            if type_ is not None:
                yield type_, _literals(name["name"].rpartition(".")[0], ordinals)
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _enumerations(inner, content)


def _literals(enumeration: str, ordinals: dict[str, int]) -> dict[int, str]:
    """The literals of an enumeration. Names with quotes and without are listed, as declared first."""
    return {ordinal: name for name, ordinal in reversed(ordinals.items()) if name.rpartition(".")[0] == enumeration}


def written(values: dict[str, str]) -> str:
    """A modifier that gives values by their paths: `(tank(d = 2), cell(each d = true, each e(f = 1)))`.

    Values that differ between the elements of an array of components become an array of values. Raises `ModelicaError`
    if one of its elements has no value.
    """
    found: dict[str, dict[tuple[int, ...], str]] = {}
    for path, value in values.items():
        parts = split(path)
        found.setdefault(".".join(name for name, _ in parts), {})[sum((index for _, index in parts), ())] = value
    tree = tree_of(found, str)
    return f"({_written(tree, found)})" if values else ""


def _written(tree: PathTree[str], values: dict[str, dict[tuple[int, ...], str]]) -> str:
    return ", ".join(
        f"{name}({_written(part, values)})" if part.item is None else _modifier(name, part.item, values[part.item])
        for name, part in tree.parts.items()
    )


def _modifier(name: str, path: str, values: dict[tuple[int, ...], str]) -> str:
    each = "each " if () not in values else ""
    if len(set(values.values())) == 1:
        return f"{each}{name} = {next(iter(values.values()))}"
    return f"{name} = {_array(path, values)}"


def _array(path: str, values: dict[tuple[int, ...], str]) -> str:
    """An array of values by their indices."""
    if () in values:
        return values[()]
    rows: dict[int, dict[tuple[int, ...], str]] = {}
    for (first, *rest), value in sorted(values.items()):
        rows.setdefault(first, {})[tuple(rest)] = value
    if list(rows) != list(range(1, len(rows) + 1)):
        raise ModelicaError(_ELEMENTS.format(path))
    return "{" + ", ".join(_array(path, row) for row in rows.values()) + "}"
