"""What each kind of class may contain (Modelica 3.6, sections 4.6, 4.9, 7.1.3, 12.2, 12.9.7 and chapter 14)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from . import tree as t
from .source import Source

if TYPE_CHECKING:
    from .classes import ComponentElement, Instance

_PREDEFINED = ("Real", "Integer", "Boolean", "String")
_RESERVED = ("quantity", "min", "max", "start", "fixed")  # attributes of enumerations
_WITH_EQUATIONS = ("model", "block", "class")
_FUNCTIONS = ("function", "operator function")
_CONNECTORS = ("connector", "expandable connector")
_RECORDS = ("record", "operator record")
_LANGUAGES = ("C", "FORTRAN 77", "builtin")
# Kinds of base classes for each kind that has other ones than itself and "class".
_BASES = {
    "block": ("record",), "model": ("block", "record"), "operator function": ("function",),
    "operator record": ("record",), "connector": ("record", "type"), "expandable connector": ("connector", "record"),
    "package": ("operator",), "operator": ("package",),
}  # fmt: skip


def check(tree: t.Class, source: Source) -> None:
    """Raises `TextError` for a class with something that its kind may not contain."""
    for at, message in _wrong(tree):
        raise source.error(at, message)


def check_base(tree: t.Class, base: "Instance", source: Source, at: int) -> None:
    """Raises `TextError` for a base class whose kind does not fit."""
    kind, other = tree.kind, base.kind
    if other == "operator record":
        raise source.error(at, f"{base.name} is an operator record, which only a short class definition can extend.")
    if kind in ("class", other) or other in ("class", *_BASES.get(kind, ())) or base.tree.name == "ExternalObject":
        return
    if other == "type" and kind in ("type", "connector"):
        return
    raise source.error(at, f"{tree.name} is a {kind}, and cannot extend {base.name}, which is a {other}.")


def has_time(scope: "Instance") -> bool:
    """Whether the variable `time` is known in a class (section 3.6.7)."""
    return not scope.whole.is_function and scope.kind not in (*_CONNECTORS, *_RECORDS)


def check_declaration(one: "ComponentElement") -> None:
    """Raises `TextError` for a component whose class contradicts its prefixes (sections 4.4.2.2, 9.3, 9.2 and 15.1)."""
    kind, class_name = one.prototype.kind, one.prototype.name
    for name in ("variability", "causality", "connection"):
        prefix = one.prefix(name)
        is_forbidden = kind in _CONNECTORS and name == "variability" and prefix != "discrete"
        if prefix and (is_forbidden or (kind in _WITH_EQUATIONS and one.value_type.name == "component")):
            raise one.error(f"{one.name} is of the {kind} {class_name}, and cannot have the prefix `{prefix}`.")
    if one.prefix("connection") == "stream" and one.holder.kind not in _CONNECTORS:
        raise one.error(f"{one.name} is a stream variable, which is allowed in connectors only.")
    if one.prefix("connection") == "flow" and kind == "operator record":
        for operator in ("'0'", "'+'", "'-'"):
            if operator not in one.prototype.elements:
                raise one.error(
                    f"{one.name} is a flow variable, and {class_name} does not have the operator {operator}."
                )


def _wrong(tree: t.Class) -> Iterator[tuple[int, str]]:
    body = tree.body
    if tree.name in _PREDEFINED:
        yield tree.at, f"{tree.name} is the name of a predefined type, and cannot be declared."
    if isinstance(body, t.Enumeration):
        for name in body.literals or ():
            if name in _RESERVED:
                yield tree.at, f"{name} is an attribute of enumerations, and no name of a literal."
    if not isinstance(body, t.Long):
        return
    for element in body.elements:
        if isinstance(element, t.Component):
            yield from _component(tree, element)
        elif isinstance(element, t.Class):
            yield from _class(tree, element)
    for section in body.sections:
        if tree.kind not in _WITH_EQUATIONS and (tree.kind not in _FUNCTIONS or not section.is_algorithm):
            what = "algorithms" if section.is_algorithm else "equations"
            yield section.at, f"{tree.name} is a {tree.kind}, and cannot have {what}."
        if tree.kind in _FUNCTIONS and section.is_initial:
            yield section.at, f"{tree.name} is a {tree.kind}, and cannot have an initial algorithm."
    yield from _external(tree, body)


def _component(tree: t.Class, one: t.Component) -> Iterator[tuple[int, str]]:
    kind = tree.kind
    prefixes = ["inner" * one.is_inner, "outer" * one.is_outer]
    if kind in _RECORDS:
        prefixes += [one.connection, one.causality]
    if one.name in _PREDEFINED:
        yield one.at, f"{one.name} is the name of a predefined type, and cannot be declared."
    if kind == "package" and one.variability != "constant":
        yield one.at, f"{tree.name} is a package, and can have constants only: {one.name} is none."
    if kind == "operator":
        yield one.at, f"{tree.name} is an operator, and can have functions only: {one.name} is a component."
    if kind in (*_CONNECTORS, *_RECORDS) and one.is_protected:
        yield one.at, f"{tree.name} is a {kind}, and cannot have protected elements such as {one.name}."
    if kind == "expandable connector" and one.connection == "flow":
        yield one.at, f"{tree.name} is an expandable connector, and cannot have the flow variable {one.name}."
    if kind in (*_FUNCTIONS, *_RECORDS, "connector"):
        for prefix in filter(None, prefixes):
            yield one.at, f"{tree.name} is a {kind}, and {one.name} cannot have the prefix `{prefix}`."
    if kind in _FUNCTIONS:
        if not (one.causality or one.is_protected or one.variability == "constant"):
            yield one.at, f"{one.name} of a function must be an input, an output or protected."
        if one.causality and one.is_protected:
            yield one.at, f"{one.name} is an {one.causality} of a function, and cannot be protected."
    if one.is_redeclare and one.condition is not None:
        yield one.at, f"the redeclaration of {one.name} cannot have a condition."


def _class(tree: t.Class, one: t.Class) -> Iterator[tuple[int, str]]:
    if tree.kind == "operator" and one.kind not in _FUNCTIONS:
        yield one.at, f"{tree.name} is an operator, and can have functions only: {one.name} is a {one.kind}."
    if one.kind in ("operator", "operator function"):
        if tree.kind not in ("operator record", "operator", "package"):
            yield one.at, f"{one.name} is an {one.kind}, which is allowed in operator records only."
        if not one.is_encapsulated and tree.kind == "operator record" and isinstance(one.body, t.Long):
            yield one.at, f"{one.name} is an {one.kind} of a record, and must be encapsulated."


def _external(tree: t.Class, body: t.Long) -> Iterator[tuple[int, str]]:
    found = body.external
    if found is not None:
        if tree.kind not in _FUNCTIONS:
            yield found.at, f"{tree.name} is a {tree.kind}: only a function can be external."
        if found.language not in _LANGUAGES:
            yield found.at, f"the language {found.language} of the external function is unknown: it must be C, " \
                "FORTRAN 77 or builtin."  # fmt: skip
        for arg in found.args:
            yield from _external_argument(arg)
    if any(isinstance(one, t.Extends) and str(one.type) == "ExternalObject" for one in body.elements):
        yield from _external_object(tree, body)


def _external_argument(arg: t.Expression) -> Iterator[tuple[int, str]]:
    match arg:
        case t.Array() | t.Matrix():
            yield arg.at, "an argument of an external function must be a variable, a scalar or `size` of a variable."
        case t.Call(args=(_, axis)) if str(arg.function) == "size" and isinstance(axis, t.Reference):
            yield axis.at, "the dimension in `size` as an argument of an external function must be a number."


def _external_object(tree: t.Class, body: t.Long) -> Iterator[tuple[int, str]]:
    own = {one.name: one for one in body.elements if isinstance(one, t.Class | t.Component)}
    for name in ("constructor", "destructor"):
        if name not in own:
            yield tree.at, f"the external object {tree.name} has no {name}."
    for name, one in own.items():
        if name not in ("constructor", "destructor") or not isinstance(one, t.Class) or one.kind not in _FUNCTIONS:
            yield one.at, f"an external object has the functions constructor and destructor only, not {name}."
        elif one.is_replaceable:
            yield one.at, f"the function {name} of an external object cannot be replaceable."
