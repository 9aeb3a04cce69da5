"""Flattening (Modelica 3.6, section 5.6): from the instance of a model to the flat model."""

import functools as ft
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatFunction, FlatModelica, FlatVariable, SourcePlace, equality
from .._syntax.visits import targets
from .._translate.scope import NotKnown
from . import restrictions
from . import tree as t
from .algorithms import Statements
from .annotations import experiment
from .classes import BUILTIN, ComponentElement, Instance, Top, check_subtype, join
from .connections import Connections, Flow, equations
from .equations import Equations, Found
from .expressions import Expressions
from .library import Libraries, given
from .modifiers import Index, Modifier
from .overconstrained import Graph
from .parse import parse_modification
from .references import assigned_in_when, without_indices
from .source import Problems, Source, TextError
from .streams import Streams
from .structure import Context
from .typed import (
    BOOLEAN,
    CONTINUOUS,
    DISCRETE,
    REAL,
    STRING,
    VARIABILITY,
    Type,
    Typed,
    accepts,
    indices,
    limited,
    same_dims,
    written_dims,
)
from .versions import version_warnings

ATTRIBUTE_TYPES = {
    "fixed": BOOLEAN, "unbounded": BOOLEAN, "unit": STRING, "quantity": STRING, "displayUnit": STRING,
    "stateSelect": Type("enumeration"),
}  # fmt: skip
_SELECT = {1: "Never", 2: "Avoid", 3: "Default", 4: "Prefer", 5: "Always"}


def flat_model(source: str | Path, model: str, roots: Sequence[str | Path] = ()) -> FlatModelica:
    """The flat model of a Modelica model.

    `source` is a text, a file, or the folder of a package. `model` is the full name of a class, possibly with
    modifiers, as in "Plant.Pump(k=2)". `roots` are folders with libraries. Raises `ModelicaError` with all errors of
    the model: those of its classes and connections, or if there are none, those of its equations and values.
    """
    texts, folders = given(source, roots)
    name, bracket, rest = model.partition("(")
    modification = None
    request = Source(f"the modifiers of {name.strip()}", bracket + rest)
    if bracket:
        modification = parse_modification(request)
    top = Top(Libraries(texts, folders))
    root = top.model(name.strip(), modification, request)
    return _Flattening(root, name.strip()).flat()


class _Flattening:
    def __init__(self, root: Instance, name: str) -> None:
        self.root = root
        self.name = name
        self.problems = Problems()
        self.context = Context(root.top)
        self.connections = Connections(self.context)
        self.context.connections = self.connections
        self.variables: dict[str, FlatVariable] = {}
        self.functions: dict[str, FlatFunction] = {}
        self.instances: list[Instance] = []
        self.classes: dict[str, str] = {}
        self.components: list[ComponentElement] = []  # variables and records
        self.flows: list[Flow] = []
        self.found, self.initial = Found(), Found()
        self.algorithms: list[Algorithm] = []
        self.initial_algorithms: list[Algorithm] = []

    def flat(self) -> FlatModelica:
        """The flat model. Raises `ModelicaError` with all errors of the first step that has some."""
        for step in (self._instantiate, self._connect, self._state):
            with self.problems.of(self._error):
                step()
            self.problems.check()
        connectors = [
            one.name for one in self.root.components() if one.prototype.is_connector and self.context.is_present(one)
        ]
        return FlatModelica(
            name=self.name,
            variables=self.variables,
            equations=(*self.found.equations, *self.found.calls),
            initial_equations=(*self.initial.equations, *self.initial.calls),
            asserts=tuple(self.found.asserts),
            initial_asserts=tuple(self.initial.asserts),
            algorithms=tuple(self.algorithms),
            initial_algorithms=tuple(self.initial_algorithms),
            whens=tuple(self.found.whens),
            functions=self.functions,
            enumerations=dict(self.context.enumerations),
            connectors=tuple(connectors),
            selecting=tuple(self.context.selecting),
            classes=self.classes,
            experiment=experiment(Expressions(self.context, self.root)),
            warnings=(*version_warnings(self.root.top.libraries), *dict.fromkeys(self.context.warnings)),
        )

    def _error(self, message: str) -> TextError:
        return self.root.error(self.root.tree.at, message)

    def _instantiate(self) -> None:
        """Finds the components and connections."""
        self._check_model()
        self._collect(self.root)
        done = 0
        while done < len(added := list(self.context.added.values())):
            for component in added[done:]:
                self._collect_component(component)
            done = len(added)
        for base, section in self._sections():
            if not section.is_algorithm and not section.is_initial:
                here = Expressions(self.context, base)
                for clause in section.clauses:
                    with self.problems.of(ft.partial(here.error, clause.at)):
                        self.connections.visit(here, (clause,))

    def _connect(self) -> None:
        """Completes the sets of connected variables."""
        self.connections.complete()
        for component in self.connections.expansion.added:
            if component.holder.path and component is not component.holder.elements.get(component.name):
                continue
            self._collect_component(component)
        self.context.graph = Graph(self.context, self.connections)
        self.context.streams = Streams(self.context, self.connections)

    def _state(self) -> None:
        """Makes the variables, equations and algorithms."""
        for base, section in self._sections():
            if not section.is_initial:
                around = without_indices(base.path)
                self.context.discrete |= {join(around, ".".join(one)) for one in assigned_in_when(section)}
        for component in self.components:
            with self.problems.of(component.error):
                self._declaration(component)
        for base, section in self._sections():
            self._section(base, section)
        graph, streams = self.context.graph, self.context.streams
        assert graph is not None
        assert streams is not None
        self.found.equations += equations(self.connections, self.flows, graph.is_broken)
        self.found.asserts += self.connections.asserts()
        self.found.equations += graph.equations()
        self.found.equations += streams.equations()
        self.functions = dict(self.context.functions)  # without those that only constants need
        self._constants()

    def _constants(self) -> None:
        """Adds the constants of packages that the model reads, which may read others."""
        done: set[str] = set()
        while len(done) < len(self.context.constants):
            for path, component in list(self.context.constants.items()):
                if path not in done:
                    done.add(path)
                    self.components = []
                    self._collect_component(component)
                    for one in self.components:
                        self._declaration(one)

    def _check_model(self) -> None:
        root = self.root
        if not root.is_connector and root.kind not in ("model", "block", "class", "record", "operator record"):
            raise root.error(root.tree.at, f"{self.name} is a {root.kind}, not a model.")
        if root.tree.is_partial:
            raise root.error(root.tree.at, f"the model {self.name} is partial.")

    def _sections(self) -> Iterator[tuple[Instance, t.Section]]:
        """The sections of equations and algorithms, each with its class instance."""
        for instance in self.instances:
            for base in instance.lineage():
                for section in base.tree.body.sections if isinstance(base.tree.body, t.Long) else ():
                    yield base, section

    # Variables

    def _collect(self, instance: Instance) -> None:
        self.instances.append(instance)
        for component in instance.components():
            with self.problems.of(component.error):
                self._collect_component(component)

    def _collect_component(self, component: ComponentElement) -> None:
        if not self.context.is_present(component):
            return
        if component.is_outer and component.is_inner:
            self.context.inner(component)
        elif component.is_outer:
            self._outer(component)
            return
        kind = component.value_type
        sizes = [n or 0 for n in self.context.sizes(component)]
        self._check_class(component)
        if kind.name in ("record", "component"):
            self.classes[without_indices(component.path)] = component.prototype.name
            if kind.name == "component":
                self.context.binding(component)  # refused if there is one
            if kind.name == "record":
                self.components.append(component)
            for index in indices(sizes):
                self._collect(component.member(index))
            if not sizes or 0 in sizes:
                return
        else:
            self.components.append(component)
            if component.connection == "flow" and component.parent is not None and _in_connector(component):
                # One in an expandable connector may be open on both sides (section 9.2).
                sides = (False, True) if _in_connector(component, ("expandable connector",)) else (False,)
                self.flows.append((component.path, tuple(sizes), component.place, sides))

    def _outer(self, component: ComponentElement) -> None:
        """Checks an outer component against its inner one, which the model gets if it lacks it (section 5.4)."""
        if component.tree.modification is not None:
            raise component.error(f"{component.name} is outer, and its declaration cannot have a modification.")
        inner = self.context.inner(component)
        if component.value_type.name != inner.value_type.name:
            raise component.error(f"{inner.path} is no {component.prototype.name}, as the outer component needs.")
        check_subtype(inner.prototype, component.prototype, component.error, "the class of the outer component")
        allowed, found = (limited(VARIABILITY[one.variability], one.value_type) for one in (component, inner))
        if found > allowed:
            raise component.error(f"{component.name} is a {component.variability}, but {inner.path} varies.")
        stated, given = component.tree.dims, self.context.sizes(inner)
        if len(stated) != len(given) or not (
            any(isinstance(size, t.Whole) for size in stated) or same_dims(self.context.sizes(component), given)
        ):
            raise component.error(f"{inner.path} has size {written_dims(given)}, and the outer component another one.")

    def _declaration(self, component: ComponentElement) -> None:
        """Adds a variable, or the equation of a record."""
        if component.value_type.name == "record":
            self._record(component)
        else:
            self._variable(component, tuple(n or 0 for n in self.context.sizes(component)))

    def _check_class(self, component: ComponentElement) -> None:
        instance = component.prototype
        restrictions.check_declaration(component)
        if instance.element.is_partial:
            raise component.error(f"{component.name} is of the partial class {instance.name}.")
        is_empty = instance.kind == "type" and instance.value_type.name == "component"
        if is_empty or instance.is_function or instance.kind in ("package", "operator"):
            raise component.error(f"{component.name} is of the {instance.kind} {instance.name}.")

    def _record(self, component: ComponentElement) -> None:
        """The equation of a record that a call of a function gives; its fields have no values of their own then.

        Fields that are parameters need values of their own.
        """
        self.context.register(component)
        value = self.context.binding(component)
        if value is None or component.variability or value.dims or _has_parameters(component.prototype):
            return
        if isinstance(value.x, e.FunctionCall) and not value.x.is_constructor:
            own = equality(e.Ref(component.path), value.x, "component", component.holder.path, component.place)
            self.found.equations.append(own)
            component.has_equation = True

    def _variable(self, component: ComponentElement, dims: Index) -> None:
        context = self.context
        context.register(component)
        kind = component.value_type
        if kind.name != "object" and (other := next(component.prototype.components(), None)) is not None:
            raise other.error(f"{component.prototype.name} is a {kind}, which cannot have the element {other.name}.")
        has_equation = any(one.has_equation for one in component.around())
        binding = None if has_equation else context.binding(component)
        variability = component.variability
        if variability == "constant" and binding is None and kind.name != "object" and not has_equation:
            raise component.error(f"the constant {component.name} has no value.")
        limit = VARIABILITY[variability] if kind == REAL else min(VARIABILITY[variability], DISCRETE)
        if binding is not None and binding.variability > limit and kind.name != "object":
            at = component.binding or component
            raise at.error(f"{component.name} is a {variability or 'discrete variable'}, but its value varies.")
        attributes = (
            {name: self._attribute(component, name) for name in component.prototype.attributes()}
            if kind.name != "object"
            else {}
        )
        connection = component.connection
        self._check_prefixes(component)
        if connection and variability in ("constant", "parameter"):
            raise component.error(f"{component.name} is a {connection} variable, and cannot be a {variability}.")
        if kind.name == "enumeration" and not component.prototype.literals:
            raise component.error(f"{component.name} is of an enumeration without literals, which must be redeclared.")
        if connection and kind != REAL:
            raise component.error(
                f"{component.name} is a {connection} variable, and must be a Real, not of type {kind}."
            )
        self._check_block(component)
        if variability == "constant" and binding is not None and kind == REAL:
            self._check_finite(component)

        def value(name: str) -> e.Expression | None:
            found = attributes.get(name)
            return None if found is None else found.x

        self.variables[component.path] = FlatVariable(
            name=component.path,
            type=kind.name if kind.name in BUILTIN else component.prototype.origin().element.target().path,
            variability=variability or ("parameter" if kind.name == "object" else "continuous"),
            causality=component.causality,
            dims=dims,
            binding=None if binding is None else binding.x,
            start=value("start"),
            start_level=_level(component.prototype.attributes().get("start")),
            fixed=self._fixed(component, attributes.get("fixed"), dims),
            min=value("min"),
            max=value("max"),
            nominal=value("nominal"),
            unit=self._unit(attributes.get("unit")),
            select=self._select(component, attributes.get("stateSelect")),
            is_flow=connection == "flow",
            is_stream=connection == "stream",
            is_overconstrained=self._is_overconstrained(component),
            evaluate=self._evaluates(component),
            is_expandable=_in_connector(component, ("expandable connector",)),
            place=component.place,
            stated=self._stated(component, binding) or component.place,
        )

    def _stated(self, component: ComponentElement, binding: Typed | None) -> SourcePlace | None:
        """Where the value of a variable, or if it has none its start value, is stated."""
        if binding is not None:
            return self.context.stated(component)
        start = component.prototype.attributes().get("start")
        return start.binding.place if start is not None and start.binding is not None else None

    def _check_prefixes(self, component: ComponentElement) -> None:
        """Raises `TextError` for prefixes that contradict those of the type or around (section 4.4.2)."""
        own = component.causalities
        around = component.parent
        if len(set(own)) > 1:
            raise component.error(f"{component.name} has the prefix `{own[0]}`, but its type has `{own[1]}`.")
        if around is not None and own and around.causality:
            raise component.error(
                f"{component.name} has the prefix `{own[0]}`, and {around.name} around it has `{around.causality}`."
            )
        if around is not None and component.prefix("connection") and around.connection:
            raise component.error(f"{component.name} and {around.name} around it are both flows or streams.")

    def _check_block(self, component: ComponentElement) -> None:
        """Raises `TextError` for a variable without a direction in a connector of a block (section 4.7)."""
        if component.causality or component.variability in ("constant", "parameter"):
            return
        around = component
        while around.prototype.kind != "connector" or _in_connector(around):
            if around.parent is None:
                return
            around = around.parent
        if around.holder.kind == "block" and not around.is_protected:
            raise component.error(
                f"{component.path} in a connector of the block {around.holder.name} is no input or output."
            )

    def _check_finite(self, component: ComponentElement) -> None:
        """Raises `TextError` for a constant whose value is not a number, as `log(-1)` is not."""
        try:
            value = np.asarray(self.context.value_of(component), float)
        except (NotKnown, TypeError):
            return
        if not np.isfinite(value).all():
            raise component.error(f"the value of the constant {component.name} is not a number.")

    def _attribute(self, component: ComponentElement, name: str) -> Typed | None:
        modifier = component.prototype.attributes()[name]
        if modifier.elements:
            raise modifier.error(f"the attribute {name} has no elements.")
        found = self.context.attribute(component, name)
        if found is not None and found.variability == CONTINUOUS and name != "value":
            raise component.error(f"the attribute {name} of {component.name} varies.")
        if found is None:
            return None
        self._check_attribute(component, name, found)
        dims = self.context.sizes(component)
        return self.context.repeated(found, dims) if found.dims and len(found.dims) < len(dims) else found

    def _check_attribute(self, component: ComponentElement, name: str, found: Typed) -> None:
        """Raises `TextError` for an attribute of another type or size than the component has."""
        wanted = ATTRIBUTE_TYPES.get(name) or component.value_type
        modifier = component.prototype.attributes()[name]
        if not accepts(wanted, found.type) and found.type.name != "enumeration":
            raise modifier.error(f"the attribute {name} of {component.name} is of type {wanted}, not {found.type}.")
        dims = self.context.sizes(component)
        own = component.modifier.get(name) if component.modifier else None
        is_whole = own is not None and own.binding is not None and not own.binding.is_each
        if not same_dims(found.dims, dims if is_whole else dims[len(dims) - len(found.dims) :]):
            remedy = ": it needs `each`." if is_whole and not found.dims else "."
            raise modifier.error(
                f"{component.name} has size {written_dims(dims)}, but its attribute {name} has "
                f"{'size ' * bool(found.dims)}{written_dims(found.dims)}{remedy}"
            )

    def _fixed(self, component: ComponentElement, found: Typed | None, dims: Index) -> tuple[bool, ...]:
        if found is None:
            return ()
        value = self.context.known(found.x)
        if value is None:
            raise component.error(f"the attribute fixed of {component.name} is not known.")
        self.context.select(found.x)
        if component.variability == "constant" and not np.all(value):
            raise component.error(f"{component.name} is a constant, which cannot have fixed = false.")
        flat = np.asarray(value).reshape(-1)
        return (bool(flat[0]),) if len(set(flat.tolist())) == 1 else tuple(bool(one) for one in flat)

    def _unit(self, found: Typed | None) -> str | None:
        """The unit of all elements; None if it is not known or they have several."""
        value = None if found is None else self.context.known(found.x)
        units = set() if value is None else set(np.ravel(value).tolist())
        unit = str(units.pop()) if len(units) == 1 else None
        return unit[1:-1] if unit and re.fullmatch(r"\([^()]*\)", unit) else unit  # section 19.1 allows parentheses

    def _select(self, component: ComponentElement, found: Typed | None) -> str:
        if found is None:
            return "Default"
        self.context.select(found.x)
        values = set(np.asarray(self.context.value(found.x), int).reshape(-1).tolist())
        if len(values) > 1:
            raise component.error(f"the elements of {component.name} have different values of stateSelect.")
        return _SELECT[values.pop()] if values else "Default"

    def _evaluates(self, component: ComponentElement) -> bool:
        found = component.annotation("Evaluate")
        return isinstance(found, t.Literal) and found.value is True

    def _is_overconstrained(self, component: ComponentElement) -> bool:
        if "equalityConstraint" in component.prototype.elements:
            return True
        parent = component.parent
        return parent is not None and parent.value_type.name == "record" and self._is_overconstrained(parent)

    # Equations

    def _section(self, base: Instance, section: t.Section) -> None:
        here = Expressions(self.context, base, at_start=section.is_initial)
        if not section.is_algorithm:
            found = self.initial if section.is_initial else self.found
            equations = Equations(here, found, is_initial=section.is_initial)
            for clause in section.clauses:
                with self.problems.of(ft.partial(here.error, clause.at)):
                    if section.is_initial and isinstance(clause, t.Connect | t.WhenClause):
                        raise here.error(
                            clause.at, "`connect` and `when` are not allowed in an initial equation section."
                        )
                    equations.one(clause)
            return
        if not section.clauses:
            return
        body: e.Body = ()
        for clause in section.clauses:
            with self.problems.of(ft.partial(here.error, clause.at)):
                body += Statements(here, is_initial=section.is_initial).whole((clause,))
        place = base.source.place(section.at)
        outputs = tuple(dict.fromkeys(target.name for target in targets(body)))
        found = self.initial_algorithms if section.is_initial else self.algorithms
        found.append(Algorithm(body, outputs, base.path, place))


def _has_parameters(record: Instance) -> bool:
    """Whether a record has a field that is a parameter or a constant."""
    for one in record.components():
        is_record = one.value_type.name == "record"
        if one.variability in ("constant", "parameter") or (is_record and _has_parameters(one.prototype)):
            return True
    return False


def _level(start: Modifier | None) -> float:
    """How many components deep the modifier of a start value is (section 8.6.2); infinite in a type."""
    binding = start.binding if start is not None else None
    if binding is None or binding.scope.whole.is_class:
        return math.inf
    return binding.scope.path.count(".") + bool(binding.scope.path)


def _in_connector(component: ComponentElement, kinds: Sequence[str] = ("connector", "expandable connector")) -> bool:
    return any(one.prototype.kind in kinds for one in component.around())
