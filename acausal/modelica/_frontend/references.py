"""Component references (Modelica 3.6, sections 5.3 and 10.5): from names with subscripts to names of the flat model."""

import dataclasses
import functools as ft
import itertools
import re
from typing import TYPE_CHECKING

from ..._errors import suggestion
from .._syntax import expressions as e
from . import tree as t
from .classes import ClassElement, ComponentElement, Instance
from .modifiers import Index
from .typed import (
    CONSTANT,
    CONTINUOUS,
    DISCRETE,
    VARIABILITY,
    Dims,
    Type,
    Typed,
    element,
    limited,
    nested,
)

if TYPE_CHECKING:
    from .expressions import Expressions


@dataclasses.dataclass(frozen=True, slots=True)
class Chain:
    """The components that a reference names, each with the subscripts of its part of the name."""

    components: tuple[ComponentElement, ...]
    parts: tuple[t.Part, ...]

    @property
    def last(self) -> ComponentElement:
        return self.components[-1]


def find(here: "Expressions", ref: t.Reference, *, is_call: bool = False) -> Chain | ClassElement | Typed:
    """What a reference names: components, a class, or an enumeration literal. Only the name of a function that is
    called can be that of a class in a component (section 5.3.2). Raises `TextError`.
    """
    scope = here.scope
    first = ref.parts[0]
    found = scope.top.find(first.name) if ref.is_global else scope.find(first.name)
    if found is None:
        raise _unknown(here, ref)
    if isinstance(found, ComponentElement):
        _check_constant(here, ref, found)
    i = 0
    while isinstance(found, ClassElement):
        if first.subs or ref.parts[i].subs:
            raise here.error(ref.at, f"{found.name} is a class, which has no subscripts.")
        if found.tree.is_outer:
            found = scope.inner_class(found)
        i += 1
        if i == len(ref.parts):
            return found
        literal = _literal(here, found, ref.parts[i].name)
        if literal is not None:
            if len(ref.parts) > i + 1 or ref.parts[i].subs:
                raise here.error(ref.parts[i].at, f"the literal {ref.parts[i].name} has no elements.")
            return literal
        found = _element(here, found, ref, i)
    components = [found]
    for part in ref.parts[i + 1 :]:
        i += 1
        holder = here.context.inner(found).prototype
        inner = holder.elements.get(part.name)
        stated = holder if holder.is_expandable else found.prototype  # an outer one may have fewer (section 5.4)
        if inner is None or part.name not in stated.elements:
            raise here.error(
                part.at, f"{found.name} has no element {part.name}.{suggestion(part.name, list(stated.elements))}"
            )
        if inner.is_protected and (isinstance(inner, ClassElement) or not inner.is_local):
            raise here.error(part.at, f"{part.name} is protected in {holder.name}, and not accessible from outside.")
        if isinstance(inner, ClassElement):
            if not is_call:
                raise here.error(part.at, f"{part.name} is a class in the component {found.name}, and no component.")
            if any(one.tree.dims for one in components):
                raise here.error(
                    part.at, f"{found.name} is an array, through which the function {part.name} cannot be called."
                )
            for one in components:
                _check_unconditional(here, one, ref.at)
            return _in_class(here, inner, ref, i)
        found = inner
        components.append(found)
    return Chain(tuple(components), ref.parts[len(ref.parts) - len(components) :])


def _in_class(here: "Expressions", found: ClassElement, ref: t.Reference, i: int) -> "Chain | ClassElement | Typed":
    """What the rest of a reference names in a class inside a component."""
    rest = t.Reference(ref.parts[i:], False, at=ref.parts[i].at)
    if len(rest.parts) == 1:
        return found
    return find(dataclasses.replace(here, scope=found.instance.encloser or here.scope), rest, is_call=True)


def _element(here: "Expressions", found: ClassElement, ref: t.Reference, i: int) -> ClassElement | ComponentElement:
    part = ref.parts[i]
    found.check_inside(here.scope, here.scope.source, ref.at)
    inner = found.member(part.name, ft.partial(here.error, part.at))
    if isinstance(inner, ComponentElement) and inner.variability != "constant" and not inner.is_outer:
        raise here.error(part.at, f"{found.name}.{part.name} is not a constant, and {found.name} is no component.")
    return inner


def _check_constant(here: "Expressions", ref: t.Reference, found: ComponentElement) -> None:
    """A component of a class around the class of the reference must be a constant (section 5.3.1)."""
    own = here.scope.elements.get(found.name)
    if own is not found and found.variability != "constant" and not found.is_outer:
        for around in list(here.scope.enclosers())[1:]:
            if around.elements.get(found.name) is found:
                raise here.error(
                    ref.at, f"{found.name} belongs to {around.name}, around {here.scope.name}, and is not a constant."
                )


def _literal(here: "Expressions", found: ClassElement, name: str) -> Typed | None:
    literals = found.instance.literals
    if literals is None:
        return None
    if name not in literals:
        raise here.error(here.at, f"{found.name} has no literal {name}.{suggestion(name, list(literals))}")
    return literal(here, found.instance, literals.index(name) + 1)


def literal(here: "Expressions", instance: Instance, ordinal: int) -> Typed:
    """A literal of an enumeration by its number."""
    origin = instance.origin()
    assert origin.literals is not None
    name = f"{origin.element.path}.{origin.literals[ordinal - 1]}"
    here.context.enumerations[name] = ordinal
    return Typed(e.Ref(name), Type("enumeration", origin), (), CONSTANT)


def _unknown(here: "Expressions", ref: t.Reference) -> Exception:
    message = f"there is no variable or class {ref.parts[0].name}"
    return here.scope.top.unknown(ref.names, here.scope, ref.at, message, here.scope.source)


def typed(here: "Expressions", chain: Chain, at: int) -> Typed:
    """The value of the components."""
    first = chain.components[0]
    if first.is_local:
        return _local(here, chain, at)
    return _Global(here, chain, at).typed()


def variability(here: "Expressions", chain: Chain) -> int:
    found = limited(VARIABILITY[chain.last.variability], chain.last.value_type)
    if found == CONTINUOUS and here.context.discrete and without_indices(chain.last.path) in here.context.discrete:
        return DISCRETE
    return found


def without_indices(path: str) -> str:
    return re.sub(r"\[[^]]*\]", "", path)


def assigned_in_when(section: t.Section) -> set[tuple[str, ...]]:
    """The names of the variables that a section assigns, all of them in when-clauses (section 3.8.3)."""
    found: dict[bool, set[tuple[str, ...]]] = {False: set(), True: set()}

    def visit(x: object, *, in_when: bool) -> None:
        match x:
            case tuple():
                for one in x:
                    visit(one, in_when=in_when)
            case t.Equality(t.Reference() | t.Tuple() as left) | t.Assignment(left):
                for one in left.elements if isinstance(left, t.Tuple) else (left,):
                    if isinstance(one, t.Reference) and (in_when or section.is_algorithm):
                        found[in_when].add(one.names)
            case t.WhenClause(branches):
                visit(tuple(body for _, body in branches), in_when=True)
            case t.IfClause(branches, otherwise):
                visit((*(body for _, body in branches), otherwise), in_when=in_when)
            case t.ForClause() | t.WhileClause():
                visit(x.body, in_when=in_when)

    visit(section.clauses, in_when=False)
    return found[True] - found[False]


def _local(here: "Expressions", chain: Chain, at: int) -> Typed:
    """A variable of a function, or a field of one."""
    name = ".".join(component.name for component in chain.components)
    dims: list[int | None] = []
    x: e.Expression = e.Ref(name)
    base: e.Expression | None = None
    for i, (component, part) in enumerate(zip(chain.components, chain.parts, strict=True)):
        own = here.context.sizes(component)
        is_last = i == len(chain.components) - 1
        if base is not None:
            base = e.FieldOf(base, component.name)
        subs, rest = here.subscripts(part, own, _partial(chain, i, base), component)
        dims += rest
        if subs and is_last and base is None:
            x = e.Ref(name, subs)
        elif subs or (rest and not is_last):
            before = ".".join(one.name for one in chain.components[: i + 1])
            base = e.Subscript(base, subs) if base is not None else e.Ref(before, subs)
    kind = chain.last.value_type
    whole = here.context.constant(chain.last) if len(chain.components) == 1 and not dims else None
    if whole is not None and not chain.parts[0].subs:
        return Typed(whole, kind, (), CONSTANT)
    return Typed(x if base is None else base, kind, tuple(dims))


def _partial(chain: Chain, i: int, base: e.Expression | None) -> e.Expression:
    return base if base is not None else e.Ref(".".join(one.name for one in chain.components[: i + 1]))


@dataclasses.dataclass
class _Global:
    """The value of components of the model, or of constants of packages."""

    here: "Expressions"
    chain: Chain
    at: int

    def typed(self) -> Typed:
        dims: list[int | None] = []
        x = self._from(0, self.chain.components[0], dims)
        return Typed(x, self.chain.last.value_type, tuple(dims), variability(self.here, self.chain))

    def _from(self, i: int, component: ComponentElement, dims: list[int | None]) -> e.Expression:
        """The value of the components from one on, which is a member of the one before."""
        context = self.here.context
        component = context.inner(component)
        _check_unconditional(self.here, component, self.at)
        if not context.is_present(component):
            raise self.here.error(self.at, f"{component.path} is not in the model, because its condition is false.")
        sizes = context.sizes(component)
        part = self.chain.parts[i]
        if i + 1 == len(self.chain.components):
            kind = component.value_type
            if kind.name in ("record", "component", "object") and sizes:
                return self._array(i, component, sizes, dims)
            whole = None if kind.name in ("record", "component") else context.constant(component)
            subs, rest = self.here.subscripts(part, sizes, e.Ref(component.path), component)
            is_written = whole is not None and all(isinstance(sub, e.Const) for sub in subs)
            context.register(component, is_written=is_written)
            dims += rest
            return element(whole, subs) if whole is not None and is_written else e.Ref(component.path, subs)
        if not sizes:
            if part.subs:
                raise self.here.error(part.at, f"{component.name} is not an array, and has no subscripts.")
            return self._member(i, component, (), dims)
        return self._array(i, component, sizes, dims)

    def _member(self, i: int, component: ComponentElement, index: Index, dims: list[int | None]) -> e.Expression:
        """The value of the rest of the reference in a member of an array of components."""
        if i + 1 == len(self.chain.components):
            self.here.context.register(component)
            return e.Ref(component.member(index).path)
        name = self.chain.components[i + 1].name
        inner = component.member(index).elements[name]
        assert isinstance(inner, ComponentElement)
        return self._from(i + 1, inner, dims)

    def _array(self, i: int, component: ComponentElement, sizes: Dims, dims: list[int | None]) -> e.Expression:
        """A part of an array of components: written out, and with a subscript where an index varies."""
        known = tuple(size for size in sizes if size is not None)
        if len(known) < len(sizes):
            raise component.error(f"the size of {component.name} is not known.")
        subs, rest = self.here.subscripts(self.chain.parts[i], sizes, e.Ref(component.path), component)
        every = (*subs, *[e.Colon()] * (len(sizes) - len(subs)))
        members = self.here.members(every, known)
        chosen = [range(1, size + 1) if one is None else one for one, size in zip(members, known, strict=True)]
        # The subscripts of the array that is written out.
        outer = [sub if one is None else e.Colon() for sub, one in zip(every, members, strict=True)
                 if not isinstance(sub, e.Const)]  # fmt: skip
        inner_dims: list[int | None] = []
        items: list[e.Expression] = []
        sizes_found: set[Dims] = set()
        for index in itertools.product(*chosen):
            inner_dims = []
            items.append(self._member(i, component, index, inner_dims))
            sizes_found.add(tuple(inner_dims))
        if len(sizes_found) > 1:
            raise self.here.error(self.at, f"the elements of {component.name} have different sizes here.")
        if not items:  # an empty array: its elements have the sizes of the prototype
            self._member(i, component, (), inner_dims)
        written = [len(one) for one, sub in zip(chosen, every, strict=True) if not isinstance(sub, e.Const)]
        dims += [*rest, *inner_dims]
        x = nested(items, written)
        return x if all(isinstance(sub, e.Colon) for sub in outer) else e.Subscript(x, tuple(outer))


def _check_unconditional(here: "Expressions", component: ComponentElement, at: int) -> None:
    if component.condition is not None:
        raise here.error(at, f"{component.name} has a condition, and can be modified and connected only.")
