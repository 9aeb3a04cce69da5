"""Detection of jumps: equations with a plain `jnp.where`, whose jump is not located by an event."""

import warnings
from collections.abc import Sequence
from typing import NamedTuple

from .._jax_private import ClosedJaxpr, JaxprEqn, Literal
from .class_equations import templates
from .flat_model import FlatModel
from .jaxpr import JOINS, LOGIC, MOVES, called, interpreted, is_floating
from .template import Template

_RELATIONS = ("lt", "le", "gt", "ge")
_OF_TRUTHS = LOGIC | MOVES | JOINS.keys() | {"select_n"}


class JumpWarning(UserWarning):
    """An equation jumps without an event, or a result jumps with the parameters that are differentiated."""


class _Value(NamedTuple):
    """Whether a value depends on a variable, and whether it is the truth of a relation between such values."""

    moves: bool
    is_truth: bool


def warn_of_jumps(flat: FlatModel) -> None:
    """Warn of component classes whose equations jump without an event: derivatives of results are then wrong."""
    for instances in flat.instances:
        names = [template.name for template in templates(instances.kind) if jumps(template)]
        if names:
            warnings.warn(
                f"{instances.kind.cls.__name__}.equations: {', '.join(names)} may jump when a relation of a plain "
                "jnp.where changes, or in Modelica one in noEvent, smooth or a function. Without an event, steps cross "
                "the jump, and its time has no derivative. Remedy: ifelse(...), or in Modelica a plain `if`.",
                JumpWarning,
                stacklevel=2,
            )


def jumps(template: Template) -> bool:
    """Whether an equation selects between two numbers by a relation that reads a variable."""
    found: list[JaxprEqn] = []
    inputs = [_Value(item.source == "var", False) for item in template.inputs]
    _walk(template.jaxpr, inputs, found)
    return bool(found)


def _walk(closed: ClosedJaxpr, inputs: Sequence[_Value], found: list[JaxprEqn]) -> list[_Value]:
    def outputs(eqn: JaxprEqn, args: list[_Value]) -> Sequence[_Value]:
        inner = called(eqn)
        if inner is not None:
            return _walk(inner, args, found)
        name, moves = eqn.primitive.name, any(arg.moves for arg in args)
        if name in _RELATIONS and is_floating(eqn.invars[0]):
            return [_Value(moves, moves)]
        if name == "select_n" and args[0].is_truth and is_floating(eqn.outvars[0]) and _differ(eqn, args[1:]):
            found.append(eqn)
        is_truth = name in _OF_TRUTHS and not is_floating(eqn.outvars[0]) and any(arg.is_truth for arg in args)
        return [_Value(moves, is_truth)] * len(eqn.outvars)

    return interpreted(closed, inputs, outputs, lambda value: _Value(False, False))


def _differ(eqn: JaxprEqn, cases: Sequence[_Value]) -> bool:
    """Whether the cases are different constants."""
    if any(case.moves for case in cases):
        return False
    atoms = [atom.val if isinstance(atom, Literal) else id(atom) for atom in eqn.invars[1:]]
    return len(set(map(str, atoms))) > 1
