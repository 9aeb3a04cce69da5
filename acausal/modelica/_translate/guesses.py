"""Guesses of variables for which the model states none, from those that it states.

An iteration that starts from zero may divide by zero. An equation x = f(y, ...) carries guesses on from y to x, and
x = y in both directions, where the start value of the modifier closest to the top counts for both (section 8.6.2).
Where all of y are known at the start, x is too, and the start value of x, which is often that
of its type, does not count: a density of 995 kg/m3 by an equation, of a type with `start=1`.
"""

import functools as ft
import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ..._errors import AcausalError
from .._syntax import expressions as e
from .._syntax.visits import nodes
from .equation_groups import FormGroup
from .evaluate import evaluate
from .forms import Residual
from .leaves import ModelLeaf
from .scope import NotKnown, Scope
from .terms import SlotValue
from .values import Value, number

SWEEPS = 8


def propagate(groups: Collection[FormGroup], leaves: Mapping[str, ModelLeaf], functions: Any) -> None:
    """Sets the guesses of scalar real variables without one, and of those known at the start, in a few sweeps over all
    equations.
    """
    exact = {leaf.path for leaf in leaves.values() if leaf.role == "param" or _is_given(leaf)}
    for _ in range(SWEEPS):
        found = 0
        for group in groups:
            form = group.form
            if not isinstance(form, Residual) or not isinstance(form.term, e.Binary) or form.term.op != "Sub":
                continue
            for row in group.rows:
                own = [leaves.get(path) for path in row]
                if all(leaf is not None for leaf in own):
                    found += _carried(form.term.left, form.term.right, own, functions, exact)
                    found += _carried(form.term.right, form.term.left, own, functions, exact)
        if not found:
            return


def _carried(left: Any, right: Any, leaves: list[Any], functions: Any, exact: set[str]) -> bool:
    """Takes the value of one side as the guess of the variable on the other side."""
    if isinstance(left, e.Unary) and left.op == "Minus":
        left, right = left.arg, e.Unary("Minus", right)
    if not isinstance(left, SlotValue):
        return False
    leaf: ModelLeaf = leaves[left.number]
    if leaf.role != "var" or leaf.kind != "real" or leaf.dims or leaf.path in exact:
        return False
    reads = slots_in(right)
    is_exact = all(leaves[place].path in exact for place in reads)
    if leaf.has_guess and not is_exact and not (_is_sign_of(right) and _level(leaves, reads) < leaf.start_level):
        return False
    if left.number in reads or not all(_is_known(leaves[place]) for place in reads):
        return False
    values = [_number(other) if place in reads else None for place, other in enumerate(leaves)]
    try:
        with np.errstate(all="ignore"):
            value = number(evaluate(right, Scope(functions, values)))
    except (NotKnown, AcausalError, TypeError, ValueError, IndexError, ZeroDivisionError, OverflowError):
        return False
    if not isinstance(value, int | float) or not np.isfinite(value) or (value == 0.0 and not is_exact):
        return False
    leaf.guess, leaf.has_guess, leaf.start_level = float(value), True, _level(leaves, reads)
    if is_exact:
        exact.add(leaf.path)
    return True


def _is_sign_of(x: Any) -> bool:
    """Whether a term is a variable or its negative."""
    return isinstance(x.arg if isinstance(x, e.Unary) else x, SlotValue)


def _level(leaves: Sequence[ModelLeaf], reads: Collection[int]) -> float:
    return max((leaves[place].start_level for place in reads), default=math.inf)


def _is_known(leaf: ModelLeaf) -> bool:
    return leaf.role == "param" or leaf.has_guess or leaf.value is not None


def _is_given(leaf: ModelLeaf) -> bool:
    """Whether the model fixes the start value. That of a discrete variable may change at the start."""
    return leaf.role == "var" and not leaf.is_discrete and leaf.value is not None


@ft.lru_cache(maxsize=4096)
def slots_in(x: Any) -> frozenset[int]:
    """The slots that a term reads."""
    return frozenset(one.number for one in nodes(x) if isinstance(one, SlotValue))


def _number(leaf: ModelLeaf) -> Value:
    value = np.asarray(leaf.guess if leaf.value is None else leaf.value, float)
    return float(value) if value.ndim == 0 else value
