"""Conditions that compare real numbers for equality."""

from collections.abc import Sequence
from typing import NamedTuple

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import JOINS, LOGIC, MOVES, called, interpreted, is_floating

_STAIRS = ("floor", "ceil", "round", "sign")


class _Seen(NamedTuple):
    """Whether a value is a real number that changes in a run, or a truth value computed from equalities of such
    numbers.
    """

    moves: bool = False
    is_equality: bool = False


def are_equalities(closed: ClosedJaxpr, moving: Sequence[bool]) -> list[bool]:
    """For each output of a program, whether it tests real numbers that depend on `moving` inputs for equality.

    Values from a discrete set, such as rounded numbers, may be compared.
    """
    inputs = [_Seen(moves) for moves in moving]
    return [value.is_equality for value in _walk(closed, inputs)]


def _walk(closed: ClosedJaxpr, inputs: Sequence[_Seen]) -> list[_Seen]:
    return interpreted(closed, inputs, _outputs, lambda value: _Seen())


def _outputs(eqn: JaxprEqn, args: list[_Seen]) -> list[_Seen]:
    inner, name = called(eqn), eqn.primitive.name
    if inner is not None:
        return _walk(inner, args)
    is_equality = False
    if name in ("eq", "ne") and is_floating(eqn.invars[0]):
        is_equality = any(arg.moves for arg in args)
    elif name in LOGIC or name in MOVES or name in JOINS:
        is_equality = any(arg.is_equality for arg in args)
    real = [arg.moves for atom, arg in zip(eqn.invars, args, strict=True) if is_floating(atom)]
    moves = any(real) and name not in _STAIRS
    return [_Seen(moves and is_floating(var), is_equality) for var in eqn.outvars]
