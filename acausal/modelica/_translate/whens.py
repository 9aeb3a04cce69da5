"""When-clauses as equations.

A variable x that a when-clause sets obeys x = if active then value else pre(x), where `active` is true at the instant
at which the condition becomes true (Modelica 3.6, section 8.3.5 and appendix B).
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation, FlatModelica, FlatVariable, equality, sides
from .._syntax.visits import mapped
from .statements import (
    Targets,
    Values,
    all_of,
    any_of,
    assertions,
    before,
    branches_of,
    chosen,
    targets_of,
    together,
    without_assertions,
)

INITIAL = e.Builtin("Initial", ())


@dataclasses.dataclass(frozen=True)
class SampleClock:
    """A clock: the discrete variable that counts its ticks, the time of the first one and the interval."""

    ticks: str
    start: Any
    interval: Any


@dataclasses.dataclass(frozen=True)
class Reset:
    """A reinit: while `active`, the state gets the value."""

    active: str
    state: str
    value: Any


@dataclasses.dataclass(frozen=True)
class Assertion:
    """A condition that must hold, always or while `active`."""

    name: str
    active: str | None
    condition: Any
    message: Any


@dataclasses.dataclass
class Lowered:
    """A flat model without when-clauses: additional variables and equations, and events."""

    variables: dict[str, FlatVariable]
    equations: list[FlatEquation]
    algorithms: list[Algorithm]
    samples: list[SampleClock]
    resets: list[Reset]
    demands: list[Assertion]
    initial: dict[str, Any]  # values of discrete variables and parameters at the start
    initial_equations: list[FlatEquation]
    discrete: set[str]


class Lowering:
    """Replaces when-clauses, samples and initial equations of discrete variables."""

    def __init__(self, flat: FlatModelica) -> None:
        self.flat = flat
        self.numbers = itertools.count(1)
        self._elements: dict[str, list[tuple[str, e.Reinit]]] = {}  # by state: elements that become new, while `active`
        self.out = Lowered({}, [], [], [], [], [], {}, [], set())

    def lower(self) -> Lowered:
        out, flat = self.out, self.flat
        out.discrete |= {v.name for v in flat.variables.values() if v.variability == "discrete" or v.type != "Real"}
        sections = [(algorithm, self._algorithm(algorithm)) for algorithm in flat.algorithms]
        bodies = [self._when_equations(when) for when in flat.whens]
        self._reset_elements()
        self._initial_values()
        initial = dict(out.initial)
        for assigned in bodies:
            self._assigned(assigned, initial)
        for _, algorithm in sections:
            out.algorithms.append(algorithm)
        for demand in flat.asserts:
            if not demand.is_warning:
                out.demands.append(Assertion(demand.name, None, self._sampled(demand.condition), demand.message))
        at_start = (*flat.initial_asserts, *(s for algorithm in flat.initial_algorithms for s in algorithm.body))
        for demand in assertions(at_start):
            condition = any_of([self._sampled(demand.condition), e.Unary("Not", INITIAL)])
            out.demands.append(Assertion(demand.name, None, condition, demand.message))
        for equation in flat.equations:
            out.equations.append(dataclasses.replace(equation, residual=self._sampled(equation.residual)))
        self._previous_values()
        return out

    # Samples

    def _sampled(self, x: Any) -> Any:
        """An expression in which a call of `sample` compares the count of a clock with its previous value."""
        match x:
            case e.Builtin("Sample", args) if len(args) == 2:
                ticks = self._variable("ticks", "Integer")
                self.out.samples.append(SampleClock(ticks, *args))
                return e.Binary("Gt", e.Ref(ticks), e.Builtin("Pre", (e.Ref(ticks),)))
        return mapped(x, self._sampled)

    def _variable(self, name: str, type_name: str) -> str:
        full = f"{name}_{next(self.numbers)}"
        self.out.discrete.add(full)
        self.out.variables[full] = FlatVariable(full, type_name, "discrete")
        return full

    # When-clauses among equations

    def _edges(self, condition: Any, assign: list[e.Statement] | None = None) -> Any:
        """Whether a condition, or one of several, becomes true now. Conditions become variables of their own, set by an
        equation, or by a statement of an algorithm.
        """
        parts = []
        for item in self._conditions(condition):
            if item == INITIAL:
                parts.append(INITIAL)
                continue
            if isinstance(item, e.Builtin) and item.name == "Sample":
                parts.append(self._sampled(item))
                continue
            if isinstance(item, e.Builtin) and item.name in ("Clock", "EventClock"):
                raise ModelError("clocked when-clauses are not supported.")
            name = self._variable("condition", "Boolean")
            if assign is None:
                self._state(name, item, "")
            else:
                assign.append(e.Assign((e.Target(name),), self._sampled(item)))
            now = e.Ref(name)
            # A condition that is true from the start on has not become true.
            parts.append(all_of([now, e.Unary("Not", e.Builtin("Pre", (now,))), e.Unary("Not", INITIAL)]))
        return any_of(parts)

    def _conditions(self, condition: Any) -> tuple[Any, ...]:
        """The conditions in one that may be a vector."""
        if isinstance(condition, e.ArrayOf):
            return tuple(inner for item in condition.elements for inner in self._conditions(item))
        variable = self.flat.variables.get(condition.name) if isinstance(condition, e.Ref) else None
        if variable is not None and variable.dims and not condition.subs:
            places = itertools.product(*(range(1, size + 1) for size in variable.dims))
            return tuple(e.Ref(condition.name, tuple(map(e.Const, place))) for place in places)
        return (condition,)

    def _state(self, name: str, value: Any, component: str) -> None:
        self.out.equations.append(equality(e.Ref(name), self._sampled(value), "when", component))

    def _when_equations(self, when: e.WhenClause) -> dict[Targets, list[tuple[str, Any]]]:
        """The variables that a when-clause sets: for each, the names of the active conditions with the values."""
        earlier: list[Any] = []
        found: dict[Targets, list[tuple[str, Any]]] = {}
        for condition, body in when.blocks:
            edge = self._edges(condition)
            active = self._variable("active", "Boolean")
            none = [e.Unary("Not", e.Ref(name)) for name in earlier]
            self._state(active, all_of([edge, *none]), "")
            earlier.append(active)
            for targets, value in self._values(body, active).items():
                found.setdefault(targets, []).append((active, value))
        self.out.discrete.update(target.name for targets in found for target in targets if target is not None)
        return found

    def _taken(self, body: e.Body, active: str, given: Sequence[Any]) -> str:
        """The name of the Boolean that is true if a branch of an active when-clause is taken: that of the clause, if
        the branch has no events.
        """
        if all(isinstance(s, e.Assign) for s in body):
            return active
        name = self._variable("active", "Boolean")
        self._state(name, all_of([e.Ref(active), e.Builtin("NoEvent", (all_of(given),))]), "")
        return name

    def _values(self, body: e.Body, active: str) -> Values:
        found: Values = {}
        for s in body:
            match s:
                case e.Assign((), e.FunctionCall() as call):
                    self._effects(call, active)
                case e.Assign():
                    found[s.targets] = s.value
                case e.Reinit() if s.index:
                    self._elements.setdefault(s.state, []).append((active, s))
                case e.Reinit():
                    self.out.resets.append(Reset(active, s.state, s.value))
                case e.Assert():
                    if not s.is_warning:
                        self.out.demands.append(Assertion(s.name, active, s.condition, s.message))
                case e.IfStatement():
                    values = [self._values(b, self._taken(b, active, given)) for given, b in branches_of(s)]
                    found |= chosen(s, values, before("Pre"))
                case _:
                    raise ModelError(f"a {type(s).__name__.lower()} in a when-clause is not supported.")
        return found

    def _reset_elements(self) -> None:
        """Resets of arrays of which elements become new: at one instant, those of all clauses together."""
        for state, resets in self._elements.items():
            dims = self.flat.variables[state].dims
            items: list[e.Expression] = []
            for index in itertools.product(*(range(1, size + 1) for size in dims)):
                branches = [(e.Ref(active), reset.value) for active, reset in resets if reset.index == index]
                old = e.Ref(state, tuple(map(e.Const, index)))
                items.append(e.If(tuple(branches), old) if branches else old)
            for size in reversed(dims[1:]):
                items = [e.ArrayOf(tuple(items[i : i + size])) for i in range(0, len(items), size)]
            for active in dict.fromkeys(active for active, _ in resets):
                self.out.resets.append(Reset(active, state, e.ArrayOf(tuple(items))))

    def _effects(self, call: e.FunctionCall, active: str) -> None:
        """A call whose results nobody takes: the assertions of its function must hold. External ones only print."""
        function = self.flat.functions[call.name]
        given = dict(zip((formal.name for formal in function.inputs), call.args, strict=False))

        def of_arguments(x: Any) -> Any:
            return given[x.name] if isinstance(x, e.Ref) and x.name in given and not x.subs else mapped(x, of_arguments)

        for s in map(of_arguments, function.body):
            match s:
                case e.Assert():
                    self.out.demands += [] if s.is_warning else [Assertion(s.name, active, s.condition, s.message)]
                case e.Assign((), e.FunctionCall() as inner):
                    self._effects(inner, active)
                case _:
                    raise ModelError(f"a call of {call.name} without its results in a when-clause is not supported.")

    def _assigned(self, assigned: dict[Targets, list[tuple[str, Any]]], initial: Mapping[str, Any]) -> None:
        for targets, values in assigned.items():
            branches: list[tuple[Any, Any]] = [(e.Ref(active), self._sampled(value)) for active, value in values]
            first = targets[0]
            if len(targets) == 1 and first is not None and first.name in initial:
                start = initial[first.name]
                self.out.initial.pop(first.name, None)
                branches.insert(0, (INITIAL, e.Subscript(start, first.subs) if first.subs else start))
            right = e.If(tuple(branches), before("Pre")(targets))
            # Relations in a when-clause cause no events of their own.
            right = e.Builtin("NoEvent", (right,))
            self.out.equations.append(equality(together(targets), right, "when"))

    # When-clauses in algorithms

    def _algorithm(self, algorithm: Algorithm) -> Algorithm:
        added: list[str] = []
        body = self._body(algorithm.body, added)
        # Assertions hold for the values at the end of the algorithm.
        self.out.demands += [Assertion(s.name, None, s.condition, s.message) for s in assertions(body)]
        body = without_assertions(body)
        return dataclasses.replace(algorithm, body=body, outputs=(*algorithm.outputs, *added))

    def _body(self, body: e.Body, added: list[str]) -> e.Body:
        found: list[e.Statement] = []
        for s in body:
            match s:
                case e.WhenClause():
                    found += self._when_statement(s, added)
                case e.IfStatement():
                    blocks = tuple((self._sampled(c), self._body(b, added)) for c, b in s.blocks)
                    found.append(e.IfStatement(blocks, self._body(s.otherwise, added)))
                case e.For():
                    found.append(e.For(s.indices, self._body(s.body, added)))
                case _:
                    found.append(self._sampled(s))
        return tuple(found)

    def _when_statement(self, when: e.WhenClause, added: list[str]) -> list[e.Statement]:
        before: list[e.Statement] = []
        blocks = []
        for condition, body in when.blocks:
            edge = self._edges(condition, before)
            inner = self._body(body, added)
            self.out.discrete.update(targets_of(inner))
            blocks.append((edge, inner))
        added += [t.name for s in before if isinstance(s, e.Assign) for t in s.targets if t is not None]
        return [*before, e.IfStatement(tuple(blocks), ())]

    # Initial equations of discrete variables and of parameters

    def _initial_values(self) -> None:
        for equation in self.flat.initial_equations:
            x = equation.residual
            if statement := self._as_statement(x):
                outputs = tuple(targets_of((statement,)))
                self._initial_algorithm(Algorithm((statement,), outputs, equation.component, equation.place))
                continue
            for left, right in sides(x) if _previous_at_start(x) is None else ():
                name = self._held(left)
                if name is not None and name not in self.out.initial:
                    self.out.initial[name] = right
                    break
            else:
                self.out.initial_equations.append(equation)
        for algorithm in self.flat.initial_algorithms:
            self._initial_algorithm(algorithm)

    def _as_statement(self, x: Any) -> e.Assign | None:
        """An initial equation that determines discrete variables and parameters by all results of a function."""
        match x:
            case e.Binary("Sub", e.TupleOf(elements), value):
                names = ["" if item is None else self._held(item) for item in elements]
                if None not in names:
                    return e.Assign(tuple(e.Target(name) if name else None for name in names), value)
        return None

    def _held(self, x: Any) -> str | None:
        """The discrete variable, or the parameter without a value, that an initial equation determines."""
        if isinstance(x, e.Builtin) and x.name == "Pre":
            x = x.args[0]
        if not isinstance(x, e.Ref) or x.subs or x.name not in self.flat.variables:
            return None
        variable = self.flat.variables[x.name]
        is_open = variable.variability == "parameter" and not all(variable.fixed or (True,))
        is_discrete = x.name in self.out.discrete and variable.variability not in ("parameter", "constant")
        return x.name if is_open or is_discrete else None

    def _previous_values(self) -> None:
        """The values of initial equations such as pre(x) = y > 0, which take the place of `pre(x)` at the start,
        wherever it is read. A constant is a start value instead.
        """
        values: dict[e.Ref, Any] = {}
        others: list[FlatEquation] = []
        for equation in self.out.initial_equations:
            found = _previous_at_start(equation.residual)
            if found is None or found[0] in values:
                others.append(equation)
            else:
                values[found[0]] = found[1]

        def change(x: Any) -> Any:
            match x:
                case e.Builtin("Pre", (e.Ref() as ref,)) if ref in values:
                    # Relations in the value are those at the start and cause no events.
                    return e.If(((INITIAL, e.Builtin("NoEvent", (values[ref],))),), x)
            return mapped(x, change)

        if values:
            self.out.initial_equations = others
            self.out.equations = list(map(change, self.out.equations))
            self.out.algorithms = [dataclasses.replace(a, body=change(a.body)) for a in self.out.algorithms]

    def _initial_algorithm(self, algorithm: Algorithm) -> None:
        """Values that an initial algorithm computes, as variables of their own, which count at the start only. They are
        the initial values of discrete variables and of parameters; continuous variables equal them at the start.
        """
        names = {name: f"start_of_{name}" for name in targets_of(algorithm.body) if name in self.flat.variables}
        if not names:
            return
        for name, start in names.items():
            self.out.variables[start] = dataclasses.replace(
                self.flat.variables[name], name=start, variability="continuous", binding=None, fixed=()
            )
            if self._held(e.Ref(name)) is None or name in self.out.initial:
                at = algorithm.component, algorithm.place
                self.out.initial_equations.append(equality(e.Ref(name), e.Ref(start), "component", *at))
            else:
                self.out.initial[name] = e.Ref(start)
        body = tuple(_renamed(s, names) for s in without_assertions(algorithm.body))
        self.out.algorithms.append(Algorithm(body, tuple(names.values()), algorithm.component, algorithm.place))


def _renamed(x: Any, names: dict[str, str]) -> Any:
    x = mapped(x, lambda part: _renamed(part, names))
    return dataclasses.replace(x, name=names[x.name]) if isinstance(x, e.Ref | e.Target) and x.name in names else x


def _previous_at_start(x: Any) -> tuple[e.Ref, Any] | None:
    """The variable x and the value of an initial equation pre(x) = value. None for other equations."""
    for left, value in sides(x):
        if isinstance(left, e.Builtin) and left.name == "Pre" and not isinstance(value, e.Const):
            ref = left.args[0]
            if isinstance(ref, e.Ref) and all(isinstance(sub, e.Const) for sub in ref.subs):
                return ref, value
    return None
