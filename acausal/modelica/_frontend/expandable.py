"""Expandable connectors (Modelica 3.6, section 9.1.3): elements that connections add to them."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

from . import references
from . import tree as t
from .classes import ComponentElement, Instance
from .expressions import Expressions

if TYPE_CHECKING:
    from .connections import Connections, Connector
    from .structure import Context


class Expansion:
    """The elements that connections add to expandable connectors."""

    def __init__(self, context: "Context", connections: "Connections") -> None:
        self._context = context
        self._connections = connections
        self.added: list[ComponentElement] = []

    def declare(self, here: Expressions, x: t.Expression, other: t.Expression) -> None:
        """Adds the element of an expandable connector that one end of a connection names, if it has none, by the
        example of the other end.
        """
        if not isinstance(x, t.Reference) or not isinstance(other, t.Reference):
            return
        for n in range(1, len(x.parts)):
            prefix = t.Reference(x.parts[:n], x.is_global, at=x.at)
            found = references.find(here, prefix)
            if not isinstance(found, references.Chain):
                return
            component = self._context.inner(found.last)
            if not component.prototype.is_expandable:
                continue
            part = x.parts[n]
            known = component.prototype.elements.get(part.name)
            if known is None or (isinstance(known, ComponentElement) and known.is_added and part.subs):
                self._add(here, prefix, x.parts[n:], other)

    def _add(self, here: Expressions, prefix: t.Reference, rest: Sequence[t.Part], other: t.Reference) -> None:
        from .connections import Connector

        ends = self._connections.ends(here, prefix)
        if ends is None:
            return
        example = self._example(here, other)
        if len(rest) > 1:
            raise here.error(
                rest[0].at, f"{prefix} has no element {rest[0].name}; only whole elements can be added to it."
            )
        part = rest[0]
        sizes: tuple[int, ...] = example[1]
        if part.subs:
            known = [here.known(sub, "the subscript of an element that is added") for sub in part.subs]
            sizes = (*(max(int(i) for i in (value if hasattr(value, "__len__") else [value])) for value in known),)
        for one in ends[0]:
            assert isinstance(one, Connector)
            for instance in {id(i): i for i in (one.instance, one.component.prototype)}.values():
                self._element(instance, part.name, example[0], sizes)

    def _example(self, here: Expressions, other: t.Reference) -> tuple[ComponentElement, tuple[int, ...]]:
        found = references.find(here, other)
        if not isinstance(found, references.Chain):
            raise here.error(other.at, f"{other} is no connector.")
        ends = self._connections.ends(here, other)
        return found.last, ends[1] if ends is not None else ()

    def _element(self, instance: Instance, name: str, example: ComponentElement, sizes: tuple[int, ...]) -> None:
        known = instance.elements.get(name)
        if isinstance(known, ComponentElement):
            before = known.dims or ()
            known.dims = tuple(max(a or 0, b) for a, b in zip(before, sizes, strict=False))
            return
        rank = len(list(example.prototype.type_dims()))
        own = sizes[: len(sizes) - rank] if rank else sizes
        tree = dataclasses.replace(
            example.tree,
            name=name,
            dims=tuple(t.Literal(size, at=example.tree.at) for size in own),
            modification=None,
            condition=None,
            causality="",
            is_inner=False,
            is_outer=False,
            is_protected=False,
        )
        new = ComponentElement(tree, example.scope, None, instance)
        new.is_added = True
        new.is_present = True
        new.dims = sizes
        instance.elements[name] = new
        instance.whole.elements[name] = new
        self.added.append(new)

    def complete(self, pairs: Sequence[tuple["Connector", "Connector"]]) -> None:
        """Gives expandable connectors that are connected the same elements."""
        changed = True
        while changed:
            changed = False
            for pair in pairs:
                for a, b in (pair, pair[::-1]):
                    changed |= self._copy(a, b)

    def _copy(self, a: "Connector", b: "Connector") -> bool:
        """Adds the elements of one connector to another. Returns whether there were new ones."""
        changed = False
        own = a.instance.elements
        for one in list(b.instance.components()):
            if not self._context.is_present(one):
                continue
            sizes = tuple(n or 0 for n in self._context.sizes(one))
            found = own.get(one.name)
            if found is None:
                for instance in {id(i): i for i in (a.instance, a.component.prototype)}.values():
                    self._element(instance, one.name, one, sizes)
                changed = True
            elif isinstance(found, ComponentElement) and _are_expandable(found, one) and not sizes:
                from .connections import Connector

                changed |= self._copy(Connector(found, (), a.is_outside), Connector(one, (), b.is_outside))
        return changed


def _are_expandable(*components: ComponentElement) -> bool:
    return all(one.prototype.is_expandable for one in components)
