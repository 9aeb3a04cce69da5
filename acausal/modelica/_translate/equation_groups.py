"""Equations of a model, grouped by their forms."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._declare.component import EquationGroup
from ..._errors import ModelError
from .._errors import ModelicaError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation, SourcePlace
from .forms import AlgorithmForm, Form, Residual, form_class
from .leaves import ModelLeaf
from .scope import Scope, located
from .slots import Slots
from .statements import loop_names, targets_of
from .terms import zeros
from .translation import Translation
from .tree import attribute_path

ROUNDING = 1e-8  # by which known sides of an equation may differ, relative to its largest number


@dataclasses.dataclass
class FormGroup:
    """Places at which equations of one form hold: the paths of the leaves of its slots, and of the component."""

    form: Form
    slots: Sequence[ModelLeaf]
    name: str
    is_initial: bool
    place: SourcePlace | None  # of the first of them
    rows: list[tuple[str, ...]] = dataclasses.field(default_factory=list)
    paths: list[str] = dataclasses.field(default_factory=list)


class EquationGroups:
    """The equations and algorithms of a model by form."""

    def __init__(self, model: Translation) -> None:
        self._model = model
        self.groups: dict[Any, FormGroup] = {}

    def add(self, equation: FlatEquation, *, is_initial: bool) -> None:
        if self._is_text(equation.residual):
            return
        try:
            term, leaves = self._model.term(equation.residual)
        except ModelError as error:
            place = f"{equation.place}, " if equation.place else ""
            raise ModelicaError(f"{place}{equation.component or self._model.flat.name}: {error}") from error
        if leaves:
            name = _where(equation.place, "equation") if equation.origin == "component" else equation.origin
            self._add(Residual(term), leaves, equation.component, name, equation.place, is_initial=is_initial)
        else:
            self._check(equation, term)

    def _check(self, equation: FlatEquation, term: Any) -> None:
        """Raises `ModelicaError` for an equation of known values that does not hold, up to rounding."""
        place, form, scope = equation.place or equation.origin, Residual(term), Scope(self._model.known.library)
        with located(place):
            found, size = form.residuals(scope), form.size(scope)
        if not all(np.allclose(item, 0.0, atol=ROUNDING * (1.0 + size)) for item in found):
            raise ModelicaError(f"{place}: the sides of this equation are known, and differ.")

    def add_algorithm(self, algorithm: Algorithm) -> None:
        model, slots = self._model, Slots()
        names = [*dict.fromkeys([*algorithm.outputs, *targets_of(algorithm.body)])]
        local = loop_names(algorithm.body).union(name for name in names if name not in model.flat.variables)
        names = [name for name in names if name in model.leaves]
        local = frozenset(names) | local
        body = model.resolver.body(algorithm.body, slots, local)
        outputs = []
        for name in names:
            slot = model.resolver.term(e.Ref(name), slots)
            outputs.append((name, slot, model.resolver.term(_before(model, name), slots)))
        if outputs:
            form = AlgorithmForm(body, tuple(outputs))
            name = _where(algorithm.place, "algorithm")
            self._add(form, slots.leaves, algorithm.component, name, algorithm.place, is_initial=False)

    def _is_text(self, x: Any) -> bool:
        left = x.left if isinstance(x, e.Binary) else x
        variable = self._model.flat.variables.get(left.name) if isinstance(left, e.Ref) else None
        return variable is not None and (variable.type == "String" or 0 in variable.dims)

    def _add(
        self,
        form: Form,
        leaves: Sequence[ModelLeaf],
        path: str,
        name: str,
        place: SourcePlace | None,
        *,
        is_initial: bool,
    ) -> None:
        slots = tuple((leaf.role, leaf.dims, leaf.kind, leaf.is_discrete, leaf.is_positive) for leaf in leaves)
        key = (form, is_initial, name, slots)
        group = self.groups.setdefault(key, FormGroup(form, leaves, name, is_initial, place))
        group.rows.append(tuple(leaf.path for leaf in leaves))
        group.paths.append(attribute_path(path) if path else "")

    def used(self) -> set[str]:
        """The paths of the leaves that equations read."""
        return {path for group in self.groups.values() for row in group.rows for path in row}

    def stated(self, places: Mapping[str, int]) -> tuple[EquationGroup, ...]:
        """The groups, with the leaves of the model by their places."""
        return tuple(self._stated(group, places) for group in self.groups.values())

    def _stated(self, group: FormGroup, places: Mapping[str, int]) -> EquationGroup:
        functions = self._model.known.library
        place = str(group.place or group.name)
        form = form_class(group.form, group.slots, functions, is_initial=group.is_initial, name=group.name, place=place)
        rows = tuple(tuple(places[attribute_path(path)] for path in row) for row in group.rows)
        return EquationGroup(form, rows, tuple(group.paths))


def _before(model: Translation, name: str) -> Any:
    """The value of an output before its algorithm (section 11.1.2): a continuous one has its start value. At the start,
    initial equations give that of a discrete one.
    """
    leaf, previous = model.leaves[name], e.Builtin("Pre", (e.Ref(name),))
    if name in model.lowered.initial:
        return e.If(((e.Builtin("Initial", ()), model.lowered.initial[name]),), previous)
    if leaf.is_discrete:
        return previous
    start = None if leaf.variable is None else leaf.variable.start
    if start is None:
        return zeros(leaf.dims)
    return start if model.shape(start) == leaf.dims else e.Builtin("Fill", (start, *map(e.Const, leaf.dims)))


def _where(place: SourcePlace | None, otherwise: str) -> str:
    """The name of an equation in messages: its file and line."""
    return f"{Path(place.file).name}:{place.line}" if place else otherwise
