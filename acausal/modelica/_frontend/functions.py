"""Functions of the flat model (Modelica 3.6, chapter 12)."""

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from .._syntax import expressions as e
from .._syntax.flat import FlatFunction, Formal
from . import tree as t
from .calls import bound_inputs, in_order, reads_component
from .classes import ComponentElement, Instance
from .modifiers import bindings
from .typed import CONSTANT, Typed

if TYPE_CHECKING:
    from .structure import Context


class Functions(Mapping[str, FlatFunction]):
    """The functions that a model calls, by name. They are made when something asks for them."""

    def __init__(self, context: "Context") -> None:
        self._context = context
        self._requested: dict[str, Callable[[], FlatFunction]] = {}
        self._made: dict[str, FlatFunction] = {}

    def request(self, instance: Instance, functions: Mapping[str, Typed]) -> str:
        """The name of a function. `functions` are its arguments that are functions, for which it gets a copy."""
        name = instance.path
        if functions:
            arguments = ", ".join(f"{key}={_function_name(arg)}" for key, arg in functions.items())
            name = f"{name}({arguments})"
        return self._request(name, lambda: self._function(name, instance, functions))

    def request_record(self, instance: Instance) -> str:
        """The name of the constructor of a record."""
        found = instance.origin().element.target()
        # Without the modifiers of a component.
        return self._request(found.path, lambda: self._constructor(found.path, found.instance))

    def request_object(self, instance: Instance, constructor: Instance) -> str:
        """The name of the constructor of an external object."""
        name = instance.element.target().path
        return self._request(name, lambda: self._object(name, instance, constructor))

    def _request(self, name: str, make: Callable[[], FlatFunction]) -> str:
        self._requested.setdefault(name, make)
        return name

    def __getitem__(self, name: str) -> FlatFunction:
        if name not in self._made:
            self._made[name] = self._requested[name]()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        while waiting := [name for name in self._requested if name not in self._made]:
            for name in waiting:
                _ = self[name]  # may request further ones
        return iter(list(self._requested))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def _function(self, name: str, instance: Instance, functions: Mapping[str, Typed]) -> FlatFunction:
        from .algorithms import Statements
        from .expressions import Expressions

        known, extra = _bound(functions)
        outputs: list[Formal] = []
        own: list[Formal] = []
        check_annotations(instance)
        components = [one for one in instance.components() if one.name not in functions]
        inputs = [self._formal(one, known) for one in components if one.causality == "input"]
        for component in in_order([one for one in components if one.causality != "input"]):
            if component.causality == "output":
                outputs.append(self._formal(component, known))
            else:
                own.append(self._formal(component, known))
        sections = [one for base in instance.lineage() for one in _bodies(base)]
        if len(sections) > 1:
            raise instance.error(
                instance.tree.at, f"the function {instance.name} has {len(sections)} algorithms or external functions."
            )
        body: list[e.Statement] = []
        external: t.External | None = None
        for base in instance.lineage():
            if not isinstance(base.tree.body, t.Long):
                continue
            external = base.tree.body.external or external
            for section in base.tree.body.sections:
                body += Statements(Expressions(self._context, base, known)).whole(section.clauses)
        c_name = None if external is None else external.name or instance.name
        return FlatFunction(
            name,
            (*extra, *inputs),  # inputs at the end may be left out
            tuple(outputs),
            tuple(own),
            tuple(body),
            False,
            c_name,
            instance.source.place(instance.tree.at),
        )

    def _formal(self, component: ComponentElement, known: Mapping[str, Typed] | None = None) -> Formal:
        from .expressions import Expressions

        default = None if reads_component(component) else self._default(component, known or {})
        dims: list[e.Expression] = []
        sizes = self._context.formal_sizes(component)
        for (scope, size), number in zip(component.stated_sizes(), sizes, strict=True):
            if number is not None:
                dims.append(e.Const(number))
            elif isinstance(size, t.Whole):
                dims.append(e.Colon())
            else:
                dims.append(Expressions(self._context, scope, known or {}).single(size).x)
        return Formal(component.name, self.type_name(component), default.x if default else None, tuple(dims))

    def _default(self, component: ComponentElement, known: Mapping[str, Typed]) -> Typed | None:
        """The value of a variable of a function before it gets another one; None if it has none."""
        is_record = component.binding is None and component.value_type.name == "record"
        if is_record and any(bindings(component.modifier)) and component.stated_sizes():
            raise component.error(f"{component.name} is an array of records with modifiers, which is not supported.")
        if is_record and component.causality != "input" and not component.stated_sizes():
            return self._context.record_of(component, known, is_open=True)
        return self._context.default(component, known)

    def type_name(self, component: ComponentElement) -> str:
        """The type of a variable by its name, as the flat model has it."""
        kind = component.value_type
        if kind.name == "record":
            return self.request_record(component.prototype)
        if kind.name == "enumeration":
            return "Integer"  # literals are their numbers
        if kind.name == "object":
            return component.prototype.origin().element.target().path
        if kind.name == "component":
            raise component.error(f"a {component.prototype.kind} is not allowed here.")
        return kind.name

    def _constructor(self, name: str, instance: Instance) -> FlatFunction:
        fields = list(instance.element.target().instance.components())
        known = {one.name: Typed(e.Ref(one.name), one.value_type, self._context.formal_sizes(one)) for one in fields}
        for one in in_order(fields):
            value = self._context.default(one, known) if one.variability == "constant" else None
            if value is not None and value.variability == CONSTANT:
                known[one.name] = value
        inputs = tuple(self._formal(one, known) for one in fields)
        return FlatFunction(name, inputs, (), (), (), True, None, instance.source.place(instance.tree.at))

    def _object(self, name: str, instance: Instance, constructor: Instance) -> FlatFunction:
        inputs = [self._formal(one) for one in constructor.inputs()]
        bodies = [base.tree.body for base in constructor.lineage()]
        external = next((one.external for one in bodies if isinstance(one, t.Long) and one.external), None)
        c_name = external.name if external is not None and external.name else constructor.name
        place = instance.source.place(instance.tree.at)
        return FlatFunction(name, tuple(inputs), (), (), (), False, c_name, place)


def _bodies(base: Instance) -> list[t.Section | t.External]:
    body = base.tree.body
    if not isinstance(body, t.Long):
        return []
    return [*(one for one in body.sections if one.clauses), *([body.external] if body.external else [])]


def check_annotations(instance: Instance) -> None:
    """Checks the names in the annotations `derivative` and `inverse` of a function (sections 12.7.1 and 12.8)."""
    found = instance.tree.annotation
    inputs = {one.name for one in instance.inputs()}
    for argument in found.arguments if found else ():
        if not isinstance(argument, t.ElementModification) or argument.name[0] not in ("derivative", "inverse"):
            continue
        kind = argument.name[0]
        if kind == "inverse" and len(instance.outputs()) != 1:
            raise instance.error(argument.at, f"{instance.name} has an inverse, and must have one output.")
        for one in argument.modification.arguments:
            if not isinstance(one, t.ElementModification):
                continue
            value = one.modification.value
            if one.name == ("order",) and not (isinstance(value, t.Literal) and type(value.value) is int):
                raise instance.error(one.at, f"the order of a derivative of {instance.name} must be an Integer.")
            wanted = one.name[0] if kind == "inverse" else str(value) if isinstance(value, t.Reference) else ""
            if one.name != ("order",) and wanted not in inputs:
                raise instance.error(one.at, f"{instance.name} has no input {wanted}, which its {kind} names.")


def _function_name(arg: Typed) -> str:
    assert isinstance(arg.x, e.Ref)
    return arg.x.name


def _bound(functions: Mapping[str, Typed]) -> tuple[dict[str, Typed], list[Formal]]:
    """Arguments that are functions as names in the body, and further inputs for the values bound in them."""
    known: dict[str, Typed] = {}
    extra: list[Formal] = []
    for key, arg in functions.items():
        values: list[Typed] = []
        for inner, value in zip(bound_inputs(arg), arg.results, strict=True):
            name = f"{key}__{inner}"
            extra.append(Formal(name, value.type.name, None, tuple(e.Colon() for _ in value.dims)))
            values.append(value._replace(x=e.Ref(name), variability=3))
        known[key] = arg._replace(results=tuple(values))
    return known, extra
