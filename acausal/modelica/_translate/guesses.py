"""Guesses of variables for which the model states none, from those that it states.

An iteration that starts from zero may divide by zero. An equation x = f(y, ...) carries guesses on from y to x, and
x = y in both directions.
"""

import functools as ft
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ..._errors import AcausalError
from .._syntax import expressions as e
from .._syntax.visits import parts_of
from .equation_groups import FormGroup
from .evaluate import evaluate
from .forms import Residual
from .leaves import ModelLeaf
from .scope import NotKnown, Scope
from .terms import SlotValue
from .values import Value, number

SWEEPS = 8


def propagate(groups: Collection[FormGroup], leaves: Mapping[str, ModelLeaf], functions: Any) -> None:
    """Sets the guesses of scalar real variables without one, in a few sweeps over all equations."""
    for _ in range(SWEEPS):
        found = 0
        for group in groups:
            form = group.form
            if not isinstance(form, Residual) or not isinstance(form.term, e.Binary) or form.term.op != "Sub":
                continue
            for row in group.rows:
                own = [leaves.get(path) for path in row]
                if all(leaf is not None for leaf in own):
                    found += _carried(form.term.left, form.term.right, own, functions)
                    found += _carried(form.term.right, form.term.left, own, functions)
        if not found:
            return


def _carried(left: Any, right: Any, leaves: list[Any], functions: Any) -> bool:
    """Takes the value of one side as the guess of the variable on the other side."""
    if not isinstance(left, SlotValue):
        return False
    leaf: ModelLeaf = leaves[left.number]
    if leaf.role != "var" or leaf.kind != "real" or leaf.dims or leaf.has_guess or leaf.value is not None:
        return False
    reads = slots_in(right)
    if left.number in reads or not all(_is_known(leaves[place]) for place in reads):
        return False
    values = [_number(other) if place in reads else None for place, other in enumerate(leaves)]
    try:
        with np.errstate(all="ignore"):
            value = number(evaluate(right, Scope(functions, values)))
    except (NotKnown, AcausalError, TypeError, ValueError, IndexError, ZeroDivisionError, OverflowError):
        return False
    if not isinstance(value, int | float) or not np.isfinite(value) or value == 0.0:
        return False
    leaf.guess, leaf.has_guess = float(value), True
    return True


def _is_known(leaf: ModelLeaf) -> bool:
    return leaf.role == "param" or leaf.has_guess or leaf.value is not None


@ft.lru_cache(maxsize=4096)
def slots_in(x: Any) -> frozenset[int]:
    """The slots that a term reads."""
    own = {x.number} if isinstance(x, SlotValue) else set()
    return frozenset(own.union(*(slots_in(part) for part in parts_of(x))))


def _number(leaf: ModelLeaf) -> Value:
    value = np.asarray(leaf.guess if leaf.value is None else leaf.value, float)
    return float(value) if value.ndim == 0 else value
