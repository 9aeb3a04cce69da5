"""Modification and redeclaration (Modelica 3.6, chapter 7): modifiers with the scopes of their expressions, merged."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from .._syntax.flat import SourcePlace
from . import tree as t

if TYPE_CHECKING:
    from .classes import ComponentElement, Instance
    from .source import TextError

Index = tuple[int, ...]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """The expression of a modifier and the class instance in which its names are looked up. `arrays` are the arrays of
    components that the modifier has passed, and `indices` the members: the value is this element of the expression.
    `names` are the values of iterators around the expression.
    """

    expression: t.Expression
    scope: "Instance"
    indices: Index = ()
    arrays: "tuple[ComponentElement, ...]" = ()
    is_each: bool = False
    names: Any = None

    @property
    def at(self) -> int:
        return self.expression.at

    def indexed(self, array: "ComponentElement", index: Index) -> "Binding":
        """The value for one element of an array of components."""
        return dataclasses.replace(self, indices=(*self.indices, *index), arrays=(*self.arrays, array))

    @property
    def place(self) -> SourcePlace:
        return self.scope.source.place(self.at)

    def error(self, message: str) -> "TextError":
        return self.scope.source.error(self.at, message)


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Redeclaration:
    """A declaration that replaces another one, and the class instance in which its names are looked up. `own` is the
    modifier that a component declaration states, `below` the modifier of the element that it replaces.
    """

    element: t.Component | t.Class
    scope: "Instance"
    own: "Modifier | None" = None
    below: "Modifier | None" = None

    @property
    def extends_itself(self) -> bool:
        body = self.element.body if isinstance(self.element, t.Class) else None
        return isinstance(body, t.Long) and body.is_class_extends


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Modifier:
    """A modifier of an element. `at` is its place in the text of `scope`. A redeclaration replaces the element before
    the rest modifies it.
    """

    scope: "Instance"
    at: int
    binding: Binding | None = None
    elements: "dict[str, Modifier]" = dataclasses.field(default_factory=dict)
    redeclaration: Redeclaration | None = None
    breaks: frozenset[str] = frozenset()
    is_final: bool = False
    is_each: bool = False
    is_below: bool = False  # a modifier further outside gives the value of the record of the element

    def error(self, message: str) -> "TextError":
        return self.scope.source.error(self.at, message)

    def get(self, name: str) -> "Modifier | None":
        return self.elements.get(name)

    def indexed(self, array: "ComponentElement", index: Index) -> "Modifier":
        """The modifier for one element of an array of components: of the modifiers inside, those without `each`."""
        return self._changed(lambda one: one if one.is_each else one.indexed(array, index))

    def _changed(self, change: Callable[[Any], Any]) -> "Modifier":
        """The modifier with its value, and the modifiers directly inside, changed."""
        redeclaration = self.redeclaration
        if redeclaration is not None:
            own, below = (one and change(one) for one in (redeclaration.own, redeclaration.below))
            redeclaration = dataclasses.replace(redeclaration, own=own, below=below)
        return dataclasses.replace(
            self,
            binding=self.binding and change(self.binding),
            elements={name: change(one) for name, one in self.elements.items()},
            redeclaration=redeclaration,
        )

    def without_binding(self) -> "Modifier":
        return dataclasses.replace(self, binding=None) if self.binding else self

    def with_each_inside(self) -> "Modifier":
        """The same modifier, with `each` at all that is inside instead of its own."""
        if not self.is_each:
            return self
        return dataclasses.replace(self._changed(lambda one: dataclasses.replace(one, is_each=True)), is_each=False)

    def without_redeclaration(self) -> "Modifier | None":
        """The rest of the modifier, if there is any."""
        if self.redeclaration is None:
            return self
        return dataclasses.replace(self, redeclaration=None) if self.binding or self.elements else None

    def only(self, names: Iterable[str]) -> "Modifier":
        """The modifiers of some elements."""
        return dataclasses.replace(self, elements={name: self.elements[name] for name in names})


def merged(outer: Modifier | None, inner: Modifier | None) -> Modifier | None:
    """The modifier of an element from the outer one, which has priority, and the one of its declaration. Raises
    `TextError` if the outer one changes what the inner one declares final.
    """
    if outer is None or inner is None:
        return outer or inner
    if inner.is_final and (outer.binding or outer.redeclaration or outer.elements):
        raise outer.error("the modifier changes an element that is final.")
    if outer.is_each != inner.is_each:
        outer, inner = outer.with_each_inside(), inner.with_each_inside()
    if outer.redeclaration is not None:
        below = merged(outer.redeclaration.below, inner)
        return dataclasses.replace(outer, redeclaration=dataclasses.replace(outer.redeclaration, below=below))
    elements = dict(inner.elements)
    if outer.binding is not None:
        elements = {name: dataclasses.replace(one, is_below=True) for name, one in elements.items()}
    for name, modifier in outer.elements.items():
        found = merged(modifier, elements.get(name))
        assert found is not None
        elements[name] = found
    return dataclasses.replace(
        outer,
        binding=outer.binding or inner.binding,
        elements=elements,
        redeclaration=inner.redeclaration,
        breaks=outer.breaks | inner.breaks,
        is_final=outer.is_final or inner.is_final,
    )


def modifier_of(modification: t.Modification | None, scope: "Instance", names: Any = None) -> Modifier | None:
    """The modifier that a modification in a text means. Raises `TextError` for two of one element."""
    if modification is None:
        return None
    elements, breaks = _elements(modification.arguments, scope, names)
    binding = None if modification.value is None else Binding(modification.value, scope, names=names)
    return Modifier(scope, modification.at, binding, elements, None, breaks)


def _elements(
    arguments: tuple[t.Argument, ...], scope: "Instance", names: Any
) -> tuple[dict[str, Modifier], frozenset[str]]:
    found: dict[str, Modifier] = {}
    breaks: set[str] = set()
    for argument in arguments:
        if isinstance(argument, t.BreakModification):
            if argument.connect is None:
                breaks.add(argument.name)
            else:
                breaks.add(connection_text(argument.connect))
            continue
        name, modifier = _element(argument, scope, names)
        if name in found:
            both = _both(found[name], modifier)
            if both is None:
                raise modifier.error(f"the modification modifies {name} twice.")
            found[name] = both
        else:
            found[name] = modifier
    return found, frozenset(breaks)


def _element(argument: t.Argument, scope: "Instance", names: Any) -> tuple[str, Modifier]:
    if isinstance(argument, t.ElementReplacement):
        redeclaration = redeclaration_of(argument.element, scope, names)
        is_final, is_each = argument.is_final, argument.is_each
        return argument.element.name, Modifier(
            scope, argument.at, redeclaration=redeclaration, is_final=is_final, is_each=is_each
        )
    assert isinstance(argument, t.ElementModification)
    inner = modifier_of(argument.modification, scope, names)
    assert inner is not None
    binding = dataclasses.replace(inner.binding, is_each=True) if argument.is_each and inner.binding else inner.binding
    inner = dataclasses.replace(
        inner, at=argument.at, binding=binding, is_final=argument.is_final, is_each=argument.is_each
    )
    for name in reversed(argument.name[1:]):
        # `a.b = 1` means `a(b = 1)`.
        inner = Modifier(scope, argument.at, elements={name: inner})
    return argument.name[0], inner


def redeclaration_of(element: t.Component | t.Class, scope: "Instance", names: Any = None) -> Redeclaration:
    own = modifier_of(element.modification, scope, names) if isinstance(element, t.Component) else None
    return Redeclaration(element, scope, own)


def _both(first: Modifier, second: Modifier) -> Modifier | None:
    """Two modifiers of an element that give values to different parts of it, as in `a.b = 1, a.c = 2`."""
    if first.redeclaration or second.redeclaration or (first.binding and second.binding):
        return None
    if first.is_each != second.is_each:
        first, second = first.with_each_inside(), second.with_each_inside()
    elements = dict(first.elements)
    for name, modifier in second.elements.items():
        both = _both(elements[name], modifier) if name in elements else modifier
        if both is None:
            return None
        elements[name] = both
    return dataclasses.replace(first, binding=first.binding or second.binding, elements=elements)


def connection_text(connect: t.Connect) -> str:
    """A connection as a text, by which `break connect(a, b)` finds it."""
    return f"connect({connect.left}, {connect.right})"


def bindings(modifier: Modifier | None) -> Iterator[Binding]:
    """All values in a modifier."""
    if modifier is not None:
        if modifier.binding is not None:
            yield modifier.binding
        for inner in modifier.elements.values():
            yield from bindings(inner)
