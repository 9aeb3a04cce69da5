"""Conditions on the parameters of a component: declared ranges, and relations that its class states."""

import functools as ft
import re
from collections.abc import Container, Iterable, Iterator
from typing import Any, NamedTuple, TypeAlias

import jax
import numpy as np

from .._errors import ModelError
from .._numbers import Truth
from .._tracing import are_traced, is_traced
from .annotations import Declaration
from .fields import copied, dynamic_fields


class Requirement(NamedTuple):
    """A condition on parameters, and its sentence for messages."""

    holds: Truth
    text: str


Requirements: TypeAlias = tuple[Requirement, ...]


def require(holds: Truth, text: str) -> Requirement:
    """State a condition on parameters, as in `require(self.s_min < self.s_max, "s_max must be above s_min")`.

    `holds` is a truth value, or an array of them that must all be true, computed from parameters alone. `text` begins
    with the name of a parameter; messages give the values of all parameters that it names.
    """
    return Requirement(holds, text)


@ft.cache
def parameters_of(cls: Any) -> dict[str, Declaration]:
    """The parameters of a class by name, without those of its parts."""
    return {name: leaf for name, leaf in dynamic_fields(cls) if leaf is not None and leaf.role == "param"}


@ft.cache
def variables_of(cls: Any) -> dict[str, Declaration]:
    """The leaves of a class that have start values, by name."""
    return {name: leaf for name, leaf in dynamic_fields(cls) if leaf is not None and leaf.role != "param"}


def stated(node: Any) -> Iterator[Requirement]:
    """The requirements of a node, without its parts: those of its declarations, then those of its class."""
    for name, declaration in parameters_of(type(node)).items():
        yield _declared(name, declaration, getattr(node, name))
    yield from node.requirements()


def _declared(name: str, declaration: Declaration, value: Any) -> Requirement:
    return Requirement(declaration.admits(value), f"{name} must be {declaration.range}")


def _required(node: Any, fields: dict[str, Declaration]) -> Requirements:
    """The requirements of a class, or a complaint about shapes of arrays if these cannot be computed."""
    try:
        return node.requirements()
    except ModelError:
        raise
    except (TypeError, ValueError, IndexError) as error:
        arrays = [name for name, declaration in fields.items() if declaration.sizes is None]
        if not arrays:
            raise
        return (Requirement(False, f"{', '.join(arrays)} must have the documented shapes ({error})"),)


def broken(node: Any) -> Iterator[str]:
    """The violated requirements of a node itself, with the values, as far as its parameters are known."""
    yield from out_of_range(node)
    cls, checks = type(node), []
    # With traced parameters, the run reports a violation as its result: a value tried under grad must not raise.
    if not (cls._states_requirements() or cls._states_start_requirements()) or are_traced(node):
        return
    fields = parameters_of(cls)
    # Known numbers are compared immediately, even while another function is traced. A requirement may divide by an
    # inadmissible number.
    with jax.ensure_compile_time_eval(), np.errstate(all="ignore"):
        known = {name: np.asarray(vars(node)[name]) for name in fields}
        if cls._states_requirements():
            checks += _required(copied(node, known), fields)
        if cls._states_start_requirements():
            starts = {name: _start(vars(node)[name], declaration) for name, declaration in variables_of(cls).items()}
            checks += copied(node, known | starts).start_requirements()
    yield from _violations(node, checks)


def _start(value: Any, declaration: Declaration) -> Any:
    return np.asarray(declaration.guess if value is None else value)


def out_of_range(node: Any) -> Iterator[str]:
    """The violated ranges of the parameters and start values of a node itself, with the values, if these are known."""
    declared, values = parameters_of(type(node)) | variables_of(type(node)), vars(node)
    known = {name: values[name] for name in declared if values[name] is not None and not is_traced(values[name])}
    yield from _violations(node, [_declared(name, declared[name], np.asarray(value)) for name, value in known.items()])


def _violations(node: Any, checks: Iterable[Requirement]) -> Iterator[str]:
    """The sentences of the violated requirements of a node, with the values."""
    declared, values = parameters_of(type(node)) | variables_of(type(node)), vars(node)
    for holds, text in checks:
        if not is_traced(holds) and not np.all(holds):
            yield violation(text, [(name, values[name], declared[name].unit) for name in named(text, declared)])


def named(text: str, known: Container[str]) -> list[str]:
    """The known names in a sentence, in order."""
    words = (word.rstrip(".") for word in re.findall(r"[^\W\d][\w.\[\]]*", text))
    return [word for word in dict.fromkeys(words) if word in known]


def violation(text: str, values: Iterable[tuple[str, Any, str]]) -> str:
    """A sentence with the parameters that it names: the value of a single one, several by name."""
    found = [(name, f"{value} {'' if unit == '1' else unit}".rstrip()) for name, value, unit in values]
    if not found:
        return f"{text}."
    return f"{text}, got {found[0][1] if len(found) == 1 else ', '.join(f'{name} = {value}' for name, value in found)}."
