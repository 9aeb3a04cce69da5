"""Values that decide the structure of a model: sizes, conditions, ranges (Modelica 3.6, sections 4.4 to 4.6, 5.4)."""

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .._syntax import expressions as e
from .._syntax.flat import SourcePlace
from .._translate.evaluate import evaluate
from .._translate.functions import Library
from .._translate.scope import NotKnown, Scope
from .._translate.values import ZEROS, Value, by_field, plain, shape_of
from . import tree as t
from .annotations import missing_inner
from .calls import in_order
from .classes import ClassElement, ComponentElement, Instance, Top, inner_element
from .expressions import Expressions
from .functions import Functions
from .modifiers import Binding, Index, Modifier
from .operators import written
from .typed import (
    VARIABILITY,
    Dims,
    Typed,
    accepts,
    constant,
    element,
    field,
    indices,
    limited,
    nested,
    same_dims,
    written_dims,
)

if TYPE_CHECKING:
    from .connections import Connections
    from .overconstrained import Graph
    from .streams import Streams

_ZEROS: Mapping[str, Value] = {**ZEROS, "enumeration": 0}
_Fields: TypeAlias = Mapping[Instance, Mapping[str, Typed]]
_SMALL = 16  # elements of constant arrays that are written where they are used


class Context:
    """What is known of a model while it is flattened."""

    def __init__(self, top: Top) -> None:
        self.top = top
        self.functions = Functions(self)
        self.enumerations: dict[str, int] = {}
        self.selecting: dict[e.Expression, None] = {}
        self.connections: Connections | None = None
        self.graph: Graph | None = None
        self.streams: Streams | None = None
        self.added: dict[str, ComponentElement] = {}  # inner components that the model lacks
        self.warnings: list[str] = []
        self.constants: dict[str, ComponentElement] = {}  # of packages, by path
        self.discrete: set[str] = set()  # paths without indices of Reals that when-clauses assign
        self._known: dict[str, tuple[ComponentElement, Index]] = {}
        self._library = Library(self.functions, _Names(self))
        self._bindings: dict[ComponentElement, Typed | None] = {}
        self._unchecked: dict[ComponentElement, Typed | None] = {}  # bindings before their checks
        self._values: dict[str, Value] = {}
        self._pending: set[tuple[str, str, int | None]] = set()

    def value(self, x: e.Expression) -> Value:
        """The value of an expression. Raises `NotKnown`, or `ModelError` if it has none."""
        if isinstance(x, e.Const):
            return x.value
        found = evaluate(x, Scope(self._library, locals=_Names(self)))
        return plain(found[0] if isinstance(found, tuple) else found)

    def known(self, x: e.Expression) -> Value | None:
        """The value of an expression, if it is known. Raises `ModelError` if it has none."""
        try:
            return self.value(x)
        except NotKnown:
            return None

    def select(self, x: e.Expression) -> None:
        """Notes that the structure of the model depends on a value."""
        if not isinstance(x, e.Const):
            self.selecting[x] = None

    # Components

    def register(self, component: ComponentElement, *, is_written: bool = False) -> None:
        """Makes the value of a component known by its path. A constant of a package becomes a variable, unless its
        value `is_written` where it is used.
        """
        path = component.path
        self._known.setdefault(path, (component, ()))
        if component.holder.whole.is_class and not is_written:
            self.constants[path] = component

    def sizes(self, component: ComponentElement) -> Dims:
        """The size of a component: None for sizes of a function that depend on its inputs."""
        if component.dims is None:
            with self._once(component, "size"):
                component.dims = self.sizes_for(component, {})
        return component.dims

    def size(self, component: ComponentElement, i: int) -> int | None:
        """One size of a component, on which another one may depend."""
        if component.dims is not None or i >= len(component.tree.dims) or component.replaced is not None:
            return self.sizes(component)[i]
        with self._once(component, "size", i):
            return self._size(component, i, component.scope, component.tree.dims[i], {})

    @contextlib.contextmanager
    def _once(self, component: ComponentElement, what: str, i: int | None = None) -> Iterator[None]:
        """Raises `TextError` for a property of a component that depends on itself."""
        key = (component.path, what, i)
        if key in self._pending:
            raise component.error(f"the {what} of {component.name} depends on itself.")
        self._pending.add(key)
        try:
            yield
        finally:
            self._pending.discard(key)

    def sizes_for(self, component: ComponentElement, names: Mapping[str, Typed]) -> Dims:
        """The size of a component, or of an output of a function for some inputs."""
        stated = enumerate(component.stated_sizes())
        return tuple(self._size(component, i, scope, size, names) for i, (scope, size) in stated)

    def index_range(self, component: ComponentElement, i: int) -> tuple[Typed, list[Typed]] | None:
        """The values of a subscript of a component whose size is an enumeration or Boolean; None for a number."""
        sizes = component.tree.dims
        if i < len(sizes) and isinstance(size := sizes[i], t.Reference):
            return Expressions(self, component.scope).range_of_type(size)
        return None

    def _size(
        self, component: ComponentElement, i: int, scope: Instance, size: t.Expression, names: Mapping[str, Typed]
    ) -> int | None:
        if isinstance(size, t.Whole):
            return self._implied(component, i)
        here = Expressions(self, scope, names)
        if isinstance(size, t.Reference) and (counted := here.range_of_type(size)) is not None:
            return counted[0].dims[0]
        value = here.single(size)
        if value.type.name != "Integer" or value.dims:
            raise here.error(size.at, f"a size must be a scalar Integer, not {written(value)}.")
        if value.variability > 1 and not component.is_local:
            raise here.error(size.at, f"the size of {component.name} is not a constant or parameter.")
        if not component.is_local:
            number = here.needed(value, size.at, f"the size of {component.name}")
        elif value.variability > 1 or (number := self.known(value.x)) is None:
            return None
        if number < 0:
            raise here.error(size.at, f"the size of {component.name} is {number}.")
        self.select(value.x)
        return int(number)

    def _implied(self, component: ComponentElement, i: int) -> int | None:
        """A size `:`, from the value of the component."""
        if component.is_local:
            value = None if component.causality == "input" else self._own_binding(component)
            return None if value is None or i >= len(value.dims) else value.dims[i]
        value = self._own_binding(component)
        if value is None:
            value = self._sized_attribute(component)
        if value is None:
            raise component.error(f"the size `:` of {component.name} needs a value that gives it.")
        if i >= len(value.dims):
            raise component.error(f"the value of {component.name} has {len(value.dims)} dimensions only.")
        size = value.dims[i]
        if size is None:
            try:
                size = np.shape(self.value(value.x))[i]
            except NotKnown as missing:
                raise component.error(f"the size `:` of {component.name} is not known, because {missing}.") from None
        return size

    def _sized_attribute(self, component: ComponentElement) -> Typed | None:
        """An attribute with the values of all elements, from which a size follows, too."""
        for name in component.prototype.attributes():
            found = self.attribute(component, name)
            if found is not None and found.dims:
                return found
        return None

    def is_present(self, component: ComponentElement) -> bool:
        """Whether the condition of a component holds, and those of the components around it."""
        if component.is_present is None:
            component.is_present = self._condition(component)
        return component.is_present

    def _condition(self, component: ComponentElement) -> bool:
        condition = component.condition
        if condition is None:
            return True
        here = Expressions(self, component.condition_scope)
        value = here.boolean(condition, f"the condition of {component.name}")
        if value.variability > 1:
            raise here.error(condition.at, f"the condition of {component.name} is not a constant or parameter.")
        truth = here.needed(value, condition.at, f"the condition of {component.name}")
        self.select(value.x)
        return bool(truth)

    def inner(self, component: ComponentElement) -> ComponentElement:
        """The inner component of an outer one (section 5.4), other components themselves. Without an inner one, the
        model gets a default one.
        """
        if not component.is_outer:
            return component
        if component.inner is not None:
            return component.inner
        found = inner_element(component.name, component.parent)
        if isinstance(found, ClassElement):
            raise component.error(f"{component.name} is an outer component, but the inner element is a class.")
        if found is None:
            found = self._default_inner(component)
        component.inner = found if found.is_inner else self.inner(found)
        return component.inner

    def _default_inner(self, component: ComponentElement) -> ComponentElement:
        root = self.top.root
        assert root is not None
        known = root.elements.get(component.name)
        if isinstance(known, ComponentElement) and known.is_inner:
            return known
        if known is not None and (known is not component or component.value_type.name != "component"):
            raise component.error(
                f"the outer component {component.path} has no inner component {component.name} around it."
            )
        if component.name not in self.added:
            if component.prototype.tree.is_partial:
                raise component.error(
                    f"the outer component {component.path} has no inner component {component.name} around it, and its "
                    "class is partial."
                )
            tree = dataclasses.replace(component.tree, is_inner=True, is_outer=False, condition=None)
            self.added[component.name] = ComponentElement(tree, component.scope, None, root)
            self.warnings.append(missing_inner(Expressions(self, component.prototype), component))
        return self.added[component.name]

    # Values of components

    def constant(self, component: ComponentElement) -> e.Expression | None:
        """The value of a constant as literals; None for other components, and for large arrays."""
        if component.variability != "constant":
            return None
        kind, here = component.value_type, Expressions(self, component.scope)
        if not kind.is_plain:
            return None
        dims = self.sizes(component)
        if None in dims or int(np.prod([n or 0 for n in dims])) > _SMALL:
            return None
        try:
            value = self.value_of(component)
        except NotKnown:
            return None
        if not dims:
            return here.value_as(kind, value).x
        items = np.broadcast_to(np.asarray(value), [n or 0 for n in dims]).reshape(-1)
        return nested([here.value_as(kind, plain(item)).x for item in items], dims)

    def binding(self, component: ComponentElement) -> Typed | None:
        """The value of a component in its declaration or a modifier, of the type and size of the component."""
        if component not in self._bindings:
            with self._once(component, "value"):
                self._bindings[component] = self._checked_binding(component)
        return self._bindings[component]

    def _checked_binding(self, component: ComponentElement) -> Typed | None:
        value = self._own_binding(component)
        if value is None:
            return None
        kind = component.value_type
        if kind.name == "component":
            raise component.error(f"{component.name} is a {component.prototype.kind}, which has no value.")
        error = (component.binding or component).error
        if not accepts(kind, value.type):
            raise error(f"{component.name} is of type {kind}, but its value is of type {value.type}.")
        dims = self.sizes(component)
        if not same_dims(value.dims, dims):
            raise error(
                f"{component.name} has size {written_dims(dims)}, but its value has size {written_dims(value.dims)}."
            )
        return value

    def repeated(self, value: Typed, dims: Dims) -> Typed:
        """A value for all elements of an array, of which the value has the last dimensions."""
        sizes = [n or 0 for n in dims[: len(dims) - len(value.dims)]]
        return value._replace(x=nested([value.x] * int(np.prod(sizes)), sizes), dims=dims)

    def _own_binding(self, component: ComponentElement) -> Typed | None:
        if component not in self._unchecked:
            self._unchecked[component] = self._found_binding(component)
        return self._unchecked[component]

    def _found_binding(self, component: ComponentElement) -> Typed | None:
        own = component.binding
        if own is None or not self._has_own(component):
            found = self._from_record(component)
            if found is not None:
                return found
        if own is None or isinstance(own.expression, t.NoValue):
            return None
        return self.bound(own, at_start=component.variability == "parameter")

    def stated(self, component: ComponentElement) -> SourcePlace:
        """Where the value of a component is stated that has one."""
        own = component.binding
        record = component.parent
        if record is not None and (own is None or (not self._has_own(component) and self._from_record(component))):
            return self.stated(record)
        assert own is not None
        return own.place

    def _has_own(self, component: ComponentElement) -> bool:
        """Whether a modifier gives the value of a field, with priority over the outermost record with a value."""
        found = False
        names = [component.name]
        record = component.parent
        while record is not None and record.value_type.name == "record":
            inner: Modifier | None = record.modifier
            if inner is not None and inner.binding is not None:
                is_below = False
                for name in reversed(names):
                    inner = None if inner is None else inner.get(name)
                    is_below = is_below or (inner is not None and inner.is_below)
                found = inner is not None and inner.binding is not None and not is_below
            names.append(record.name)
            record = record.parent
        return found

    def bound(self, binding: Binding, *, at_start: bool = False) -> Typed:
        """The value of a modifier, for the element of the arrays that the modifier has passed."""
        here = Expressions(self, binding.scope, binding.names or {}, at_start=at_start)
        value = here.single(binding.expression)
        index = binding.indices
        if not index:
            return value
        if len(value.dims) < len(index):
            raise here.error(
                binding.at, "the modifier of an array of components needs `each`, or a value for each of them."
            )
        sizes = [(size, array) for array in binding.arrays for size in self.sizes(array)]
        for (wanted, array), size in zip(sizes, value.dims, strict=False):
            if wanted is not None and size is not None and size != wanted:
                raise here.error(binding.at, f"the modifier has {size} values, but {array.name} has {wanted} members.")
        x = element(value.x, [e.Const(i) for i in index])
        return value._replace(x=x, dims=value.dims[len(index) :])

    def _from_record(self, component: ComponentElement) -> Typed | None:
        """The value of a field from that of the record around it."""
        record = component.parent
        if record is None or record.value_type.name != "record":
            return None
        whole = self.binding(record)
        if whole is None:
            return None
        index = _index(component.holder.path)
        if whole.dims and index:
            x = element(whole.x, [e.Const(i) for i in index])
            whole = whole._replace(x=x, dims=whole.dims[len(index) :])
        return self.field(whole, component.name)

    def field(self, record: Typed, name: str) -> Typed | None:
        """A field of a record; None if its class has none of this name."""
        instance = record.type.instance
        assert instance is not None
        inner = instance.elements.get(name)
        if not isinstance(inner, ComponentElement):
            return None
        names = [one.name for one in instance.components()]
        if isinstance(record.x, e.FunctionCall) and record.x.is_constructor and record.results:
            return record.results[names.index(name)]
        is_local = instance.component is not None and instance.component.is_local
        if isinstance(record.x, e.Ref) and not record.dims and not is_local:
            index = ",".join(str(sub.value) for sub in record.x.subs if isinstance(sub, e.Const))
            path = record.x.name + (f"[{index}]" if index else "")
            found = self._field_of(path, name)
            if found is not None:
                inner = found
                self.register(inner)
                record = record._replace(x=e.Ref(path))
        x = field(record.x, name, names)
        sizes = self.formal_sizes(inner) if record.x != e.Ref(inner.holder.path) else self.sizes(inner)
        if None in sizes and record.variability <= 1 and (value := self.known(x)) is not None:
            sizes = shape_of(value)[len(record.dims) :][: len(sizes)]
        kind = inner.value_type
        variability = limited(min(record.variability, VARIABILITY[inner.variability]), kind)
        return Typed(x, kind, (*record.dims, *sizes), variability)

    def _field_of(self, path: str, name: str) -> ComponentElement | None:
        """The field of a record at a path of the model."""
        base, index = path, ()
        if base not in self._known and path.endswith("]"):
            base, index = path[: path.rindex("[")], _index(path)
        if base not in self._known:
            return None
        inner = self._known[base][0].member(index).elements.get(name)
        return inner if isinstance(inner, ComponentElement) else None

    def formal_sizes(self, component: ComponentElement) -> Dims:
        """The size of an input of a function, or of a field of a record, as far as it is the same for all values."""
        if component.is_local:
            return self.sizes(component)
        stated = component.stated_sizes()
        return tuple(int(size.value) if isinstance(size, t.Literal) else None for _, size in stated)

    def attribute(self, component: ComponentElement, name: str) -> Typed | None:
        """The value of an attribute, such as `start`."""
        modifier = component.prototype.attributes().get(name)
        if modifier is None or modifier.binding is None or isinstance(modifier.binding.expression, t.NoValue):
            return None
        return self.bound(modifier.binding)

    def default(
        self, formal: ComponentElement, names: Mapping[str, Typed], around: _Fields | None = None
    ) -> Typed | None:
        """The default of an input of a function or constructor, for some other inputs. `around` are the fields of the
        records around it.
        """
        binding = formal.binding
        if binding is not None:
            known = (around or {}).get(binding.scope.whole, names)
            return Expressions(self, binding.scope, known).single(binding.expression)
        if formal.value_type.name == "record" and not self.sizes(formal):
            return self.record_of(formal, names, around)
        return None

    def record_of(
        self,
        formal: ComponentElement,
        names: Mapping[str, Typed],
        around: _Fields | None = None,
        *,
        is_open: bool = False,
    ) -> Typed | None:
        """A record from the values of its fields in the modifiers of a component. Without one of them, it is None, or
        if it `is_open`, the field is zero.
        """
        instance = formal.prototype
        fields: dict[str, Typed] = {}
        around = {**(around or {}), instance.whole: fields}
        for one in in_order(list(instance.components())):
            value = self.default(one, names, around)
            if value is None and is_open:
                value = self._zero(one, names, around)
            if value is None:
                return None
            fields[one.name] = value
        values = [fields[one.name] for one in instance.components()]
        name = self.functions.request_record(instance)
        variability = max((value.variability for value in values), default=0)
        return Typed(e.FunctionCall(name, tuple(v.x for v in values), True), instance.value_type, (), variability)

    def _zero(self, field: ComponentElement, names: Mapping[str, Typed], around: _Fields) -> Typed | None:
        """The value of a field of a record in a function before it gets one; None if its size is not known."""
        kind = field.value_type
        value = constant(_ZEROS[kind.name])._replace(type=kind) if kind.name in _ZEROS else None
        if kind.name == "record":
            value = self.record_of(field, names, around, is_open=True)
        sizes = field.stated_sizes()
        if value is None or not sizes:
            return value
        if any(isinstance(size, t.Whole) for _, size in sizes):
            return None
        dims = tuple(Expressions(self, scope, around.get(scope.whole, names)).single(size).x for scope, size in sizes)
        return value._replace(x=e.Builtin("Fill", (value.x, *dims)), dims=self.formal_sizes(field))

    def value_of(self, component: ComponentElement) -> Value:
        """The value of a constant or parameter. Raises `NotKnown`."""
        path = component.path
        if path in self._values:
            return self._values[path]
        if component.variability not in ("constant", "parameter"):
            raise NotKnown(f"{path} is a variable")
        with self._once(component, "value", 0):
            self._values[path] = self._value(component)
        return self._values[path]

    def _value(self, component: ComponentElement) -> Value:
        kind = component.value_type
        bound = self.binding(component)
        if bound is not None:
            return self._as_type(kind.name, self.value(bound.x))
        if kind.name == "record":
            return self._record_value(component)
        fixed = self.attribute(component, "fixed")
        if fixed is not None and self.value(fixed.x) is False:
            raise NotKnown(f"{component.path} is not fixed")
        start = self.attribute(component, "start")
        if start is None or component.variability == "constant":
            raise NotKnown(f"{component.path} has no value")
        value = self._as_type(kind.name, self.value(start.x))
        dims = [n or 0 for n in self.sizes(component)]
        return np.broadcast_to(np.asarray(value), dims) if dims else value

    def _as_type(self, name: str, value: Value) -> Value:
        if name == "Real" and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        return value

    def _record_value(self, component: ComponentElement) -> Value:
        sizes = [n or 0 for n in self.sizes(component)]
        values: list[dict[str, Value]] = []
        for index in indices(sizes):
            member = component.member(index)
            values.append({one.name: self.value_of(one) for one in member.components()})
        if not sizes:
            return values[0]
        names = [one.name for one in component.prototype.components()]
        return {
            name: np.array([one[name] for one in values]).reshape(*sizes, *np.shape(values[0][name])) for name in names
        }

    def find(self, path: str) -> ComponentElement | None:
        found = self._known.get(path)
        return found[0] if found else None

    def known_value(self, path: str) -> Value:
        """The value at a path. Raises `KeyError`."""
        if path in self.enumerations:
            return self.enumerations[path]
        found = self._known.get(path)
        if found is None:
            base, bracket, index = path.rpartition("[")
            if not bracket or not path.endswith("]") or base not in self._known:
                raise KeyError(path)
            component = self._known[base][0]
            numbers = [int(i) for i in index[:-1].split(",")]
            whole = self._record_value(component) if self.binding(component) is None else self.value_of(component)
            return by_field(whole, lambda value: plain(value[tuple(i - 1 for i in numbers)]))
        return self.value_of(found[0])


def _index(path: str) -> Index:
    """The index at the end of a path."""
    if not path.endswith("]"):
        return ()
    return tuple(int(i) for i in path[path.rindex("[") + 1 : -1].split(","))


class _Names(Mapping[str, Value]):
    """The known values by name, for `evaluate`."""

    def __init__(self, context: Context) -> None:
        self._context = context

    def __getitem__(self, name: str) -> Value:
        try:
            return self._context.known_value(name)
        except NotKnown as missing:
            raise KeyError(name) from missing

    def __contains__(self, name: object) -> bool:
        try:
            self._context.known_value(str(name))
        except KeyError:
            return False
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0
