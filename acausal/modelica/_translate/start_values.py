"""Start values of variables: those that the model states, and those that follow parameters."""

from typing import Any

import numpy as np

from .._errors import ModelicaError
from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable, equality, sides
from .known import shaped
from .leaves import ModelLeaf
from .scope import NotKnown
from .translation import Translation, as_leaf
from .values import Value, number


class StartValues:
    """States the start values of leaves."""

    def __init__(self, model: Translation) -> None:
        self._model = model
        self._late: list[ModelLeaf] = []  # with a start value that depends on parameters
        self._partly: list[FlatVariable] = []  # arrays with fixed and free elements
        self._late_previous: dict[str, tuple[Any, list[ModelLeaf]]] = {}

    def state(self, leaf: ModelLeaf) -> None:
        """The start value of a variable: a guess, unless it is fixed."""
        if leaf.variable is None or leaf.variable.start is None:
            return
        if any(leaf.variable.fixed) and not all(leaf.variable.fixed) and not leaf.is_discrete:
            self._partly.append(leaf.variable)
        try:
            self._set(leaf, number(self._model.known.value(leaf.variable.start)))
        except NotKnown:
            self._late.append(leaf)

    def _fix_elements(self, variable: FlatVariable) -> None:
        """The start values of the fixed elements of an array are initial equations, if others are free."""
        assert variable.start is not None
        is_array = bool(self._model.shape(variable.start))
        for index, is_fixed in zip(np.ndindex(variable.dims), variable.fixed, strict=True):
            if is_fixed:
                place = tuple(e.Const(i + 1) for i in index)
                value = e.Subscript(variable.start, place) if is_array else variable.start
                equation = equality(e.Ref(variable.name, place), value, "start", place=variable.source)
                self._model.lowered.initial_equations.append(equation)

    def _set(self, leaf: ModelLeaf, value: Value) -> None:
        variable = leaf.variable
        assert variable is not None
        value = as_leaf(shaped(value, variable))
        leaf.guess, leaf.has_guess = _nested(np.asarray(value)), bool(np.any(np.asarray(value) != 0.0))
        leaf.start_level = variable.start_level
        # The start value of a discrete variable is that of its `pre`.
        if variable.fixed and all(variable.fixed) and not leaf.is_discrete:
            leaf.value = value

    def state_late(self) -> None:
        """The start values that depend on parameters, which follow them, and those of elements."""
        for variable in self._partly:
            self._fix_elements(variable)
        for leaf in self._late:
            assert leaf.variable is not None
            term, reads = self._model.term(leaf.variable.start)
            if any(other.role != "param" for other in reads):
                self._equate(leaf)
                continue
            self._set(leaf, self._model.value(term, reads))
            if leaf.value is not None or leaf.variable.name in self._model.clocked.stored:
                self._model.determined.add_start(leaf, term, reads)
            elif leaf.is_discrete:
                self._late_previous[leaf.path] = (term, reads)

    def _equate(self, leaf: ModelLeaf) -> None:
        """A fixed start value that reads a parameter which initial equations determine is an initial equation."""
        variable = leaf.variable
        if variable is None or variable.start is None or not variable.fixed or not all(variable.fixed):
            return
        if leaf.is_discrete:
            raise ModelicaError(
                f"{variable.source}: the start value of the discrete variable {variable.name} reads a parameter that "
                f"initial equations determine. Remedy: state pre({variable.name}) by an initial equation."
            )
        equation = equality(e.Ref(variable.name), variable.start, "start", place=variable.source)
        self._model.lowered.initial_equations.append(equation)

    def state_previous(self) -> None:
        """Previous values at the start that depend on parameters follow them, too."""
        for path, leaf in self._model.previous.of.items():
            if path in self._late_previous:
                self._model.determined.add_start(leaf, *self._late_previous[path])

    def takes(self, equation: FlatEquation) -> bool:
        """Takes an initial equation between a variable and parameters as its start value, if it has none."""
        return any(self._takes(left, right) for left, right in sides(equation.residual))

    def _takes(self, left: Any, right: Any) -> bool:
        leaf = self._model.leaves.get(left.name) if isinstance(left, e.Ref) and not left.subs else None
        if leaf is None or leaf.role != "var" or leaf.kind != "real" or leaf.value is not None:
            return False
        term, reads = self._model.term(right)
        if any(other.role != "param" for other in reads):
            return False
        value = self._model.value(term, reads)
        if isinstance(value, dict) or np.shape(value) not in ((), leaf.dims):
            return False
        assert leaf.variable is not None
        leaf.value = as_leaf(shaped(value, leaf.variable))
        if reads:
            self._model.determined.add_start(leaf, term, reads)
        return True


def _nested(values: np.ndarray) -> Any:
    """Nested tuples of numbers; one number if all are equal."""
    if values.size and np.all(values == values.flat[0]):
        return float(values.flat[0])
    return _rows(values.tolist())


def _rows(row: Any) -> Any:
    return tuple(_rows(item) for item in row) if isinstance(row, list) else float(row)
