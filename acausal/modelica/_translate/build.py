"""From a flat model to a component."""

import dataclasses
import functools as ft
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.component import At, EquationGroup, Events, Follow, Started, When, at, refuse, when
from ..._declare.node import leaves_of
from ..._errors import ModelError
from ..._tracing import is_traced
from .._errors import ModelicaError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation, FlatModelica, FlatVariable, SourcePlace
from .clocks import without_clocks
from .discrete_starts import with_starts
from .evaluate import NotKnown, Scope, evaluate
from .forms import AlgorithmForm, Form, Residual, form_class
from .guesses import propagate
from .known import KnownValues, is_external, shaped
from .leaves import ModelLeaf, kind_of, known_unit
from .model import ModelicaModel
from .resolve import Previous, Resolver, Slots, with_parts
from .semilinear import without_chains
from .statement_terms import loop_names, targets_of
from .tree import attribute_path, tree
from .values import Value, is_known, number
from .whens import Lowered, Lowering

# "Never" is a wish here too: where the equations leave no other choice, such a variable becomes a state.
_SELECT = {"Never": -1, "Avoid": -1, "Prefer": 1, "Always": 2}
INITIAL = "initial_"


def component(flat: FlatModelica) -> ModelicaModel:
    """The component of a flat model.

    Raises `ModelError` for what is not supported, with its place in the model.
    """
    return _Build(flat).component()


class _Group:
    """Places at which equations of one form hold."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, ...]] = []
        self.paths: list[str] = []


class _Build:
    def __init__(self, flat: FlatModelica) -> None:
        self.original = flat
        flat, self.clocked = without_clocks(flat)
        lowered = Lowering(flat).lower()
        variables = {**flat.variables, **lowered.variables}
        self.flat = dataclasses.replace(flat, variables=with_starts(variables, lowered.initial, lowered.equations))
        self.lowered: Lowered = lowered
        self.known = KnownValues(self.flat)
        self.leaves: dict[str, ModelLeaf] = {}
        self.previous = Previous(self.leaves)
        self.resolver = Resolver(self.known, self.leaves, self.previous)
        self.groups: dict[Any, _Group] = {}
        self.slots_of: dict[Any, list[ModelLeaf]] = {}
        self._late: list[tuple[ModelLeaf, FlatVariable]] = []  # start values that depend on parameters
        self._late_previous: dict[str, tuple[Any, list[str]]] = {}  # those of discrete variables
        self.determined: list[tuple[str, Any, list[str]]] = []  # path, term, paths of its slots
        self.equations: list[FlatEquation] = without_chains(lowered.equations, self.flat.variables)

    def component(self) -> ModelicaModel:
        self._make_leaves()
        for equation in self.equations:
            self._equation(equation, is_initial=False)
        for equation in self.lowered.initial_equations:
            if not self._is_start(equation):
                self._equation(equation, is_initial=True)
        for algorithm in self.lowered.algorithms:
            self._section(algorithm)
        events = self._events()
        for path, leaf in self.previous.of.items():
            if path in self._late_previous:
                self._follows(leaf, *self._late_previous[path])
        self._drop_unused()
        propagate(self.groups, self.leaves, self.known.library)
        root = tree(
            [*self.leaves.values(), *self.previous.of.values()], ModelicaModel, _class_name(self.flat.name), events
        )
        places = {leaf.path: i for i, leaf in enumerate(leaves_of(root))}
        cls = type(root)
        cls.equation_groups = tuple(self._equation_groups(places))
        cls.determined = self._determining(places)
        followed = {leaf.path for leaf in (*self.leaves.values(), *self.previous.of.values()) if leaf.is_followed}
        cls.determined_names = frozenset(attribute_path(p) for p, _, _ in self.determined if p not in followed)
        cls.flat = self.original
        return root

    def _drop_unused(self) -> None:
        """Members of expandable connectors that nothing uses do not exist."""
        used = {leaf.path for leaves in self.slots_of.values() for leaf in leaves}
        used.update(path for group in self.groups.values() for row in group.rows for path in row)
        for variable in self.flat.variables.values():
            if variable.is_expandable and variable.name in self.leaves and variable.name not in used:
                del self.leaves[variable.name]

    # Leaves

    def _make_leaves(self) -> None:
        self.leaves["time"] = ModelLeaf("time", "time", unit="s")
        self.leaves[INITIAL] = ModelLeaf(INITIAL, "discrete", "boolean", is_discrete=True, value=1.0)
        for sample in self.lowered.samples:
            self.leaves[sample.ticks] = ModelLeaf(sample.ticks, "discrete", "integer", is_discrete=True, value=0.0)
        waiting = []
        for variable in self.flat.variables.values():
            if variable.name in self.leaves or self.known.has(variable) or 0 in variable.dims:
                continue
            if is_external(variable, self.flat) or variable.type == "String":
                continue
            if variable.variability == "parameter":
                waiting.append(variable)
            else:
                self.leaves[variable.name] = self._variable(variable)
        self._parameters(waiting)
        self._late_starts()
        for name in self.clocked.stored:
            leaf = self.leaves[name]
            leaf.role = "discrete"
            leaf.value = jnp.broadcast_to(jnp.asarray(leaf.guess, float), leaf.dims)
        for variable in list(self.flat.variables.values()):
            leaf = self.leaves.get(variable.name)
            if leaf is not None and leaf.role == "var" and variable.binding is not None:
                sides = e.Binary("Sub", e.Ref(variable.name), variable.binding)
                self.equations.append(FlatEquation(sides, variable.name.rpartition(".")[0], "binding", variable.place))

    def _parameters(self, waiting: list[FlatVariable]) -> None:
        """The leaves of real parameters: first those with a value, then those that others determine."""
        for variable in waiting:
            if not all(variable.fixed or (True,)):
                self._open_parameter(variable)
                continue
            leaf = self._leaf(variable, "param")
            self.leaves[variable.name] = leaf
        for variable in waiting:
            leaf = self.leaves[variable.name]
            if leaf.role == "param":
                self._parameter_value(variable, leaf, [])

    def _open_parameter(self, variable: FlatVariable) -> None:
        """A parameter that initial equations determine: a variable that keeps its value."""
        name = variable.name
        leaf = self._leaf(variable, "var")
        kept = e.Builtin("Pre", (e.Ref(name),))
        if name in self.lowered.initial:
            leaf.is_discrete = True
            value = e.If(((e.Builtin("Initial", ()), self.lowered.initial.pop(name)),), kept)
            self.equations.append(FlatEquation(e.Binary("Sub", e.Ref(name), value), "", "initial", variable.place))
        else:
            rest = e.Builtin("Der", (e.Ref(name),))
            self.equations.append(FlatEquation(e.Binary("Sub", rest, e.Const(0.0)), "", "initial", variable.place))
        self.leaves[name] = leaf

    def _parameter_value(self, variable: FlatVariable, leaf: ModelLeaf, path: list[str]) -> Value:
        """The value of a parameter; one with a binding that reads others is determined by them."""
        if leaf.value is not None:
            return leaf.value
        if variable.name in path:
            raise ModelError(f"{variable.name} is determined by itself.")
        stated = variable.start if variable.binding is None else variable.binding
        if stated is None:
            value: Value = np.zeros(variable.dims) if variable.dims else 0.0
        else:
            slots = Slots()
            term = self.resolver.term(stated, slots)
            if any(item.role != "param" for item in slots.leaves):
                self._becomes_variable(variable)
                return None
            others = [(item.variable, item) for item in slots.leaves if item.variable is not None]
            values = [self._parameter_value(other, item, [*path, variable.name]) for other, item in others]
            if any(value is None for value in values):
                self._becomes_variable(variable)
                return None
            value = number(evaluate(term, Scope(self.known.library, values)))
            if slots.leaves:
                self.determined.append((leaf.path, term, [item.path for item in slots.leaves]))
        leaf.value = _as_leaf(shaped(value, variable))
        low = self._number(variable.min)
        leaf.is_positive = low is not None and low >= 0 and bool(np.all(np.asarray(leaf.value) > 0))
        return leaf.value

    def _becomes_variable(self, variable: FlatVariable) -> None:
        """A parameter whose binding reads one that initial equations determine."""
        self.leaves[variable.name] = dataclasses.replace(self._leaf(variable, "var"), is_discrete=False)

    def _leaf(self, variable: FlatVariable, role: Any) -> ModelLeaf:
        return ModelLeaf(
            variable.name,
            role,
            kind_of(variable.type),
            variable.dims,
            known_unit(variable.unit) if variable.type == "Real" else "1",
            variable.name in self.lowered.discrete,
            select=_SELECT.get(variable.select, 0),
            nominal=self._nominal(variable),
            variable=variable,
        )

    def _nominal(self, variable: FlatVariable) -> float | None:
        if variable.type != "Real":
            return 1.0
        found = self._number(variable.nominal)
        return abs(found) if found else None

    def _number(self, x: Any) -> float | None:
        if x is None:
            return None
        try:
            value = self.known.value(x)
        except NotKnown:
            return None
        return float(np.max(value)) if np.size(value) else None

    def _variable(self, variable: FlatVariable) -> ModelLeaf:
        leaf = self._leaf(variable, "var")
        if variable.start is not None:
            try:
                self._start(leaf, variable, number(self.known.value(variable.start)))
            except NotKnown:
                self._late.append((leaf, variable))
        return leaf

    def _start(self, leaf: ModelLeaf, variable: FlatVariable, value: Value) -> None:
        """The start value of a variable: a guess, unless it is fixed."""
        value = _as_leaf(shaped(value, variable))
        leaf.guess, leaf.has_guess = _nested(np.asarray(value).tolist()), bool(np.any(np.asarray(value) != 0.0))
        # The start value of a discrete variable is that of its `pre`.
        if variable.fixed and all(variable.fixed) and not leaf.is_discrete:
            leaf.value = value

    def _late_starts(self) -> None:
        """Start values that depend on parameters."""
        for leaf, variable in self._late:
            slots = Slots()
            term = self.resolver.term(variable.start, slots)
            if any(item.role != "param" for item in slots.leaves):
                continue
            values = [item.value for item in slots.leaves]
            self._start(leaf, variable, number(evaluate(term, Scope(self.known.library, values))))
            reads = [item.path for item in slots.leaves]
            if leaf.value is not None or leaf.path in self.clocked.stored:
                self._follows(leaf, term, reads)
            elif leaf.is_discrete:
                self._late_previous[leaf.path] = (term, reads)

    def _follows(self, leaf: ModelLeaf, term: Any, reads: list[str]) -> None:
        """Makes a start value follow parameters; one that is given to the model counts instead."""
        leaf.is_followed = True
        self.determined.append((leaf.path, term, reads))

    def _is_start(self, equation: FlatEquation) -> bool:
        """Takes an initial equation between a variable and parameters as its start value, if it has none."""
        x = equation.residual
        if not isinstance(x, e.Binary) or x.op != "Sub":
            return False
        for left, right in ((x.left, x.right), (x.right, x.left)):
            leaf = self.leaves.get(left.name) if isinstance(left, e.Ref) and not left.subs else None
            if leaf is None or leaf.role != "var" or leaf.kind != "real" or leaf.value is not None:
                continue
            slots = Slots()
            term = self.resolver.term(right, slots)
            if any(item.role != "param" for item in slots.leaves):
                continue
            value = evaluate(term, Scope(self.known.library, [item.value for item in slots.leaves]))
            if isinstance(value, dict) or np.shape(value) not in ((), leaf.dims):
                continue
            assert leaf.variable is not None
            leaf.value = _as_leaf(shaped(number(value), leaf.variable))
            if slots.leaves:
                self._follows(leaf, term, [item.path for item in slots.leaves])
            return True
        return False

    # Equations

    def _equation(self, equation: FlatEquation, *, is_initial: bool) -> None:
        if self._is_text(equation.residual):
            return
        slots = Slots()
        try:
            term = self.resolver.term(equation.residual, slots)
        except ModelError as error:
            place = f"{equation.place}, " if equation.place else ""
            raise ModelicaError(f"{place}{equation.component or self.flat.name}: {error}") from error
        if not slots.leaves:
            return
        self._add(Residual(term), slots, equation.component, is_initial, _said(equation))

    def _is_text(self, x: Any) -> bool:
        left = x.left if isinstance(x, e.Binary) else x
        variable = self.flat.variables.get(left.name) if isinstance(left, e.Ref) else None
        return variable is not None and (variable.type == "String" or 0 in variable.dims)

    def _add(self, form: Form, slots: Slots, path: str, is_initial: bool, name: str) -> None:
        key = (
            form,
            is_initial,
            name,
            tuple((s.role, s.dims, s.kind, s.is_discrete, s.is_positive) for s in slots.leaves),
        )
        group = self.groups.get(key)
        if group is None:
            group = self.groups[key] = _Group()
            self.slots_of[key] = slots.leaves
        group.rows.append(tuple(leaf.path for leaf in slots.leaves))
        group.paths.append(attribute_path(path) if path else "")

    def _section(self, algorithm: Algorithm) -> None:
        names = [*dict.fromkeys([*algorithm.outputs, *targets_of(algorithm.body)])]
        names = [name for name in names if name in self.leaves]
        slots = Slots()
        local = frozenset(names) | loop_names(algorithm.body)
        body = self.resolver.body(algorithm.body, slots, local)
        outputs = []
        for name in names:
            slot = self.resolver.term(e.Ref(name), slots)
            leaf = self.leaves[name]
            before: Any = e.Const(0.0)
            if leaf.is_discrete:
                before = self.resolver.term(e.Builtin("Pre", (e.Ref(name),)), slots)
            elif leaf.dims:
                before = e.Builtin("Zeros", tuple(e.Const(n) for n in leaf.dims))
            outputs.append((name, slot, before))
        if outputs:
            self._add(
                AlgorithmForm(body, tuple(outputs)),
                slots,
                algorithm.component,
                False,
                _where(algorithm.place, "algorithm"),
            )

    def _equation_groups(self, places: dict[str, int]) -> list[EquationGroup]:
        found = []
        for key, group in self.groups.items():
            form, is_initial, name, _ = key
            made = form_class(form, self.slots_of[key], self.known.library, is_initial=is_initial, name=name)
            rows = tuple(tuple(places[attribute_path(path)] for path in row) for row in group.rows)
            found.append(EquationGroup(made, rows, tuple(group.paths)))
        return found

    # Parameters and start values that others determine

    def _determining(self, places: dict[str, int]) -> Any:
        if not self.determined:
            return None
        library = self.known.library
        all_leaves = (*self.leaves.values(), *self.previous.of.values())
        starts = {places[attribute_path(leaf.path)] for leaf in all_leaves if leaf.is_followed}
        steps = [(places[attribute_path(p)], t, [places[attribute_path(q)] for q in r]) for p, t, r in self.determined]

        def determine(leaves: Sequence[Any]) -> Sequence[Any]:
            new = list(leaves)
            for place, term, reads in steps:
                if place in starts and new[place] is not None:
                    continue  # given
                new[place] = _as_leaf(number(evaluate(term, Scope(library, [_scalar(new[i]) for i in reads]))))
            return new

        return staticmethod(determine)

    # Events

    def _events(self) -> dict[str, Any]:
        """The method `events`, if there are any."""
        library, found = self.known.library, []

        def stated(*terms: Any) -> tuple[list[Any], list[str]]:
            slots = Slots()
            made = [self.resolver.term(term, slots) for term in terms]
            return made, [attribute_path(leaf.path) for leaf in slots.leaves]

        for sample in self.lowered.samples:
            (start, interval), paths = stated(self._before(sample.start), self._before(sample.interval))
            found.append(("sample", sample.ticks, (start, interval), paths))
        for tick in self.clocked.ticks:
            terms, paths = stated(*(() if tick.of is None else (tick.of,)), *tick.changes.values())
            found.append((tick.kind, tuple(tick.changes), terms, paths))
        for reset in self.lowered.resets:
            terms, paths = stated(e.Ref(reset.active), reset.value)
            found.append(("reset", reset.state, terms, paths))
        for demand in self.lowered.demands:
            try:
                truth = self.known.value(demand.condition)
            except (NotKnown, ModelError):  # an error occurs again where the value is needed
                truth = None
            if truth is not None and np.all(truth):
                continue
            if truth is not None and demand.active is None:
                raise ModelError(f"assertion failed: {self._message(demand.message)}")
            terms, paths = stated(e.Ref(demand.active) if demand.active else e.Const(True), demand.condition)
            found.append(("assert", self._message(demand.message), terms, paths))
        previous, names = self.previous.of, list(self.previous.of)

        def events(self: Any) -> Events:
            made: dict[str, Any] = {}
            for number_of, (kind, target, terms, paths) in enumerate(found):
                values = Scope(library, [value_at(self, path) for path in paths], in_condition=True)
                found_values = [evaluate(term, values) for term in terms]
                if kind in ("at", "when", "started"):
                    made[f"_{kind}_{number_of}"] = _tick_event(kind, target, found_values)
                    continue
                first, second = found_values
                if kind == "sample":
                    ticks = attribute_path(target)
                    made[f"_{target}"] = at(first, every=second, **{ticks: value_at(self, ticks) + 1.0})
                elif kind == "reset":
                    made[f"reinit_{number_of}"] = when(
                        jnp.asarray(first), **{attribute_path(target): jnp.asarray(second, float)}
                    )
                else:
                    broken = _all_of([item for item in (first, _negation(second)) if item is not True])
                    if is_traced(broken):
                        made[f"assert_{number_of}"] = refuse(broken, target)
            follow = {
                attribute_path(previous[name].path): _followed(value_at(self, attribute_path(name)), previous[name])
                for name in names
            }
            # While the initial equations hold, `pre` keeps its start value.
            holds = jnp.asarray(value_at(self, INITIAL)) > 0.5
            if names:
                made["_follow"] = Follow(
                    {path: jnp.where(holds, value_at(self, path), value) for path, value in follow.items()}
                )
            made["_started"] = Started({INITIAL: 0.0, **follow})
            return made

        is_needed = (
            bool(found)
            or bool(names)
            or any(leaf.path == INITIAL for leaves in self.slots_of.values() for leaf in leaves)
        )
        if not is_needed:
            del self.leaves[INITIAL]
            return {}
        return {"events": events}

    def _before(self, x: Any) -> Any:
        """An expression of the values before the instant of the variables in it."""
        if isinstance(x, e.Ref):
            leaf = self.leaves.get(x.name)
            return e.Builtin("Pre", (x,)) if leaf is not None and leaf.role == "var" else x
        return with_parts(x, self._before)

    def _message(self, x: Any) -> str:
        try:
            return str(self.known.value(x))
        except NotKnown:
            return "an assertion of the model is violated"


def _negation(truth: Value) -> Value:
    return not np.all(truth) if is_known(truth) else jnp.any(jnp.logical_not(truth))


def _all_of(truths: Sequence[Value]) -> Value:
    return ft.reduce(jnp.logical_and, truths) if truths else True


def _followed(value: Any, leaf: ModelLeaf) -> Any:
    """A value that `pre` follows. Truths and integers have no derivatives."""
    value = jnp.asarray(value, float)
    return value if leaf.kind == "real" else jax.lax.stop_gradient(value)


def _said(equation: FlatEquation) -> str:
    """How messages name an equation in a component: by file and line."""
    return _where(equation.place, "equation") if equation.origin == "component" else equation.origin


def _where(place: SourcePlace | None, otherwise: str) -> str:
    return f"{Path(place.file).name}:{place.line}" if place else otherwise


def _nested(values: Any) -> Any:
    """Nested tuples of numbers; one number if all are equal."""
    flat = np.ravel(values)
    if flat.size and np.all(flat == flat[0]):
        return float(flat[0])
    return tuple(_nested_row(row) for row in values)


def _nested_row(row: Any) -> Any:
    return tuple(_nested_row(item) for item in row) if isinstance(row, list) else float(row)


def _tick_event(kind: str, names: Sequence[str], values: Sequence[Value]) -> At | When | Started:
    """The event at the ticks of clocks: the values are the time or condition, if any, and those of the variables."""
    new = (jnp.asarray(number(value), float) for value in values[-len(names) :])
    changes: dict[str, Any] = dict(zip((attribute_path(name) for name in names), new, strict=True))
    if kind == "started":
        return Started(changes)
    return at(values[0], **changes) if kind == "at" else when(values[0], **changes)


def value_at(node: Any, path: str) -> Any:
    """The leaf at a path."""
    for part in path.split("."):
        name, *indices = part.replace("]", "").split("[")
        node = getattr(node, name)
        for index in indices:
            node = node[int(index)]
    return node


def _as_leaf(value: Value) -> Any:
    return jnp.asarray(value, float)


def _scalar(value: Any) -> Any:
    """A known scalar as a Python number, with which expressions evaluate fast."""
    if is_traced(value) or np.ndim(value):
        return value
    return float(value)


def _class_name(name: str) -> str:
    last = name.partition("(")[0].strip().rpartition(".")[2]
    return last if last.isidentifier() else "Model"
