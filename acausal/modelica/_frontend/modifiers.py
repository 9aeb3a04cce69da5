"""Modification and redeclaration (Modelica 3.6, chapter 7): modifiers with the scopes of their expressions, merged."""

import dataclasses
from collections.abc import Iterable, Iterator
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
    """A declaration that replaces another one, and the class instance in which its names are looked up. `below` is
    the redeclaration that a class which extends itself replaces and extends.
    """

    element: t.Component | t.Class
    scope: "Instance"
    below: "Redeclaration | None" = None
    modifier: "Modifier | None" = None  # of the declaration that this one extends

    @property
    def extends_itself(self) -> bool:
        body = self.element.body if isinstance(self.element, t.Class) else None
        return isinstance(body, t.Long) and body.is_class_extends


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Modifier:
    """A modifier of an element. `at` is its place in the text of `scope`."""

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
        changed = {
            name: inner if inner.is_each else inner._of_element(array, index) for name, inner in self.elements.items()
        }
        binding = self.binding.indexed(array, index) if self.binding and not self.binding.is_each else self.binding
        return dataclasses.replace(self, elements=changed, binding=binding)

    def _of_element(self, array: "ComponentElement", index: Index) -> "Modifier":
        if self.is_each:
            return self
        binding = self.binding.indexed(array, index) if self.binding and not self.binding.is_each else self.binding
        elements = {name: inner._of_element(array, index) for name, inner in self.elements.items()}
        return dataclasses.replace(self, binding=binding, elements=elements)

    def without_binding(self) -> "Modifier":
        return dataclasses.replace(self, binding=None) if self.binding else self

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
    elements = dict(inner.elements)
    if outer.binding is not None:
        elements = {name: dataclasses.replace(one, is_below=True) for name, one in elements.items()}
    for name, modifier in outer.elements.items():
        found = merged(modifier, elements.get(name))
        assert found is not None
        elements[name] = found
    redeclaration = outer.redeclaration or inner.redeclaration
    if outer.redeclaration and inner.redeclaration and outer.redeclaration.extends_itself:
        redeclaration = _on_top(outer.redeclaration, inner.redeclaration)
    replaces = outer.redeclaration is not None and _is_replaced(inner, outer.redeclaration)
    if replaces:
        elements = dict(outer.elements)
    return dataclasses.replace(
        outer,
        binding=outer.binding or (None if replaces else inner.binding),
        elements=elements,
        redeclaration=redeclaration,
        breaks=outer.breaks | inner.breaks,
        is_final=outer.is_final or inner.is_final,
    )


def _is_replaced(inner: Modifier, by: Redeclaration) -> bool:
    """Whether a redeclaration replaces a modifier further inside. A component keeps the modifiers of the one that it
    replaces; a redeclaration replaces another one with its modifiers.
    """
    return not by.extends_itself and (inner.redeclaration is not None or isinstance(by.element, t.Class))


def _on_top(outer: Redeclaration, inner: Redeclaration) -> Redeclaration:
    below = inner if outer.below is None else _on_top(outer.below, inner)
    return dataclasses.replace(outer, below=below)


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
        element = argument.element
        modification = element.modification if isinstance(element, t.Component) else None
        inner = modifier_of(modification, scope, names) or Modifier(scope, argument.at)
        found = dataclasses.replace(
            inner,
            at=argument.at,
            redeclaration=Redeclaration(element, scope) if argument.is_redeclare else None,
            is_final=argument.is_final,
            is_each=argument.is_each,
        )
        if found.binding and argument.is_each:
            found = dataclasses.replace(found, binding=dataclasses.replace(found.binding, is_each=True))
        return element.name, found
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


def _both(first: Modifier, second: Modifier) -> Modifier | None:
    """Two modifiers of an element that give values to different parts of it, as in `a.b = 1, a.c = 2`."""
    if first.redeclaration or second.redeclaration or (first.binding and second.binding):
        return None
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
