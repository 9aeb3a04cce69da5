"""Classes, inheritance and the elements of class instances (Modelica 3.6, chapters 4, 5.6 and 7).

An `Instance` is a class at one place: with the class instance that encloses it, in which its names are looked up, and
with the modifier that it has there. Its elements, and the instances of its base classes, are made when something asks
for them, so that instances cost nothing before they are needed.
"""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from ..._errors import suggestion
from .._errors import ModelicaError
from .._syntax.flat import SourcePlace
from . import restrictions
from . import tree as t
from .library import Definition, Libraries
from .modifiers import Binding, Index, Modifier, connection_text, merged, modifier_of, redeclaration_of
from .parse import parse
from .source import Source, TextError
from .typed import Type
from .versions import version_wanted

_PREDEFINED = Source(
    "<predefined>",
    "type Real end Real; type Integer end Integer; type Boolean end Boolean; type String end String;"
    "type Clock end Clock; partial class ExternalObject end ExternalObject;"
    "type StateSelect = enumeration(never, avoid, default, prefer, always);"
    "type AssertionLevel = enumeration(warning, error);",
)
BUILTIN = frozenset(("Real", "Integer", "Boolean", "String", "Clock"))
_COMMON = frozenset(("value", "quantity", "start", "fixed"))
ATTRIBUTES = {
    "Real": _COMMON | {"unit", "displayUnit", "min", "max", "nominal", "unbounded", "stateSelect"},
    "Integer": _COMMON | {"min", "max"},
    "Boolean": _COMMON,
    "String": _COMMON,
    "Clock": frozenset[str](),
    "enumeration": _COMMON | {"min", "max"},
}
_VARIABILITIES = {"constant": 0, "parameter": 1, "discrete": 2, "": 3}
_DEPTH = 200  # of components in components, and of base classes


def join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


@dataclasses.dataclass(eq=False)
class ClassElement:
    """A class as an element of a class instance. `scope` encloses its text; None at the top. `extended` is the class
    that a class which extends itself replaces. `modifier` has priority over the modification of a short class, and this
    one over `kept`, the modifiers of the constraint.
    """

    name: str
    scope: "Instance | None"
    holder: "Instance | None"
    top: "Top"
    load: Callable[[], Definition]
    modifier: Modifier | None = None
    kept: Modifier | None = None
    extended: "ClassElement | None" = None
    is_protected: bool = False
    replaced: "ClassElement | None" = None  # by a redeclaration
    _definition: Definition | None = None
    _instance: "Instance | None" = None
    _pending: bool = False

    @property
    def definition(self) -> Definition:
        if self._definition is None:
            self._definition = self.load()
        return self._definition

    @property
    def tree(self) -> t.Class:
        return self.definition.tree

    @property
    def path(self) -> str:
        return join(self.holder.path if self.holder else "", self.name)

    @property
    def instance(self) -> "Instance":
        """The class itself, as a package or a function is used."""
        if self._instance is None:
            found = self.target()
            if found is not self:
                self._instance = found.instance
            else:
                self._instance = Instance(self, self.modifier, self.path, None)
                self._instance.is_class = True
            _check_constraint(self, self._instance, lambda text: self.definition.source.error(self.tree.at, text))
        return self._instance

    def target(self) -> "ClassElement":
        """The class that this one is another name for; itself if it is none."""
        body = self.tree.body
        if (
            not isinstance(body, t.Short)
            or body.dims
            or body.causality
            or body.modification
            or self.modifier
            or self.kept
        ):
            return self
        if self._pending or self.tree.is_encapsulated:
            return self
        self._pending = True
        try:
            found = self.definition_scope.find_class(body.type, self.definition.source).target()
        finally:
            self._pending = False
        return found if found.tree.kind == self.tree.kind and not self.extended else self

    @property
    def constraint(self) -> "ClassElement":
        """The constraining type of redeclarations (section 7.3.2)."""
        stated = self.tree.constraint
        if stated is not None:
            return self.definition_scope.find_class(stated.type, self.definition.source)
        return self.replaced.constraint if self.replaced is not None else self

    def keep(self, modifier: Modifier | None) -> None:
        """Adds the modifiers of the constraint."""
        if isinstance(self.tree.body, t.Short):
            self.kept = modifier
        else:
            self.modifier = merged(self.modifier, modifier)

    def member(self, name: str, error: Callable[[str], Exception]) -> "Element":
        """An element by its name, from outside of the class. Raises `error`."""
        elements = self.instance.elements
        found = elements.get(name)
        if found is None:
            raise error(f"{self.path} has no element {name}.{suggestion(name, list(elements))}")
        if found.is_protected:
            raise error(f"{name} is protected in {self.path}, and not accessible from outside.")
        return found

    @property
    def is_partial(self) -> bool:
        found = self.target()
        is_short = isinstance(found.tree.body, t.Short)
        return found.tree.is_partial or (is_short and found.instance.bases[0].element.is_partial)

    def check_inside(self, user: "Instance | Top", source: Source, at: int) -> None:
        """Raises `TextError` for a name in a partial class from outside of it in a model (section 5.3.2)."""
        if not self.is_partial:
            return
        if not isinstance(user, Instance) or (user.whole.is_class and not user.is_function):
            return  # a class that is no part of the model, such as a constraint
        if any(base.tree is self.tree for here in user.enclosers() for base in here.lineage()):
            return
        raise source.error(at, f"{self.name} is partial, and names in it cannot be used from outside.")

    @property
    def definition_scope(self) -> "Instance | Top":
        return self.scope or self.top

    def instantiate(self, modifier: Modifier | None, path: str, component: "ComponentElement | None") -> "Instance":
        """An instance with a further modifier, as the type of a component."""
        if self.replaced is not None:
            _ = self.instance  # which is checked
        return Instance(self, merged(modifier, self.modifier), path, component)


class Instance:
    """A class at one place. `path` is its place in the flat model, or the name of a package or function. `component`
    is the component around it, `derived` the class instance that has it as a base class.
    """

    def __init__(
        self,
        element: ClassElement,
        modifier: Modifier | None,
        path: str,
        component: "ComponentElement | None",
        derived: "Instance | None" = None,
    ) -> None:
        self.element = element
        self.top = element.top
        self.definition = element.definition
        self.tree = element.definition.tree
        self.source = element.definition.source
        self.encloser = element.scope
        self.modifier = modifier
        self.path = path
        self.component = component
        self.derived = derived
        self.level: int = derived.level + 1 if derived else 0
        self._own: dict[str, Element] | None = None
        self._elements: dict[str, Element] | None = None
        self._bases: list[Instance] = []
        self._base_at: list[int] = []
        self._pending = False
        self._imported: dict[str, Element | None] = {}
        self._classes: dict[str, ClassElement] = {}
        self.is_class = False  # a package or function, not the type of a component
        self.is_hidden = False  # a protected base class, or base class of one

    # The names of a class

    def error(self, at: int, message: str) -> TextError:
        return self.source.error(at, message)

    @property
    def name(self) -> str:
        return self.tree.name

    @property
    def whole(self) -> "Instance":
        """The class instance that has this one as a base class, or base class of it."""
        return self if self.derived is None else self.derived.whole

    def derivations(self) -> "Iterator[Instance]":
        """The class instance itself, and those that have it as a base class, or base class of it."""
        found: Instance | None = self
        while found is not None:
            yield found
            found = found.derived

    def enclosers(self) -> "Iterator[Instance]":
        """The class instance itself, and those that enclose it, the innermost first."""
        found: Instance | None = self
        while found is not None:
            yield found
            found = found.encloser

    @property
    def is_function(self) -> bool:
        return self.kind in ("function", "operator function")

    @property
    def is_connector(self) -> bool:
        return self.kind in ("connector", "expandable connector")

    @property
    def is_expandable(self) -> bool:
        return self.kind == "expandable connector"

    @property
    def is_local(self) -> bool:
        """Whether it is no part of the model: a class itself, or the type of a variable of a function."""
        return self.is_class or (self.component is not None and self.component.is_local)

    @property
    def kind(self) -> str:
        """The specialised class; that of the base class for a short definition as a class or type."""
        found = self.tree.kind
        if found in ("class", "type") and isinstance(self.tree.body, t.Short):
            return self.bases[0].kind
        return found

    @property
    def is_external_object(self) -> bool:
        return any(base.path == "ExternalObject" or base.tree.name == "ExternalObject" for base in self.lineage())

    @ft.cached_property
    def value_type(self) -> Type:
        """The type of components of the class."""
        if self.builtin:
            return Type(self.builtin)
        if self.literals is not None:
            return Type("enumeration", self.origin())
        if self.origin().kind in ("record", "operator record"):
            return Type("record", self)
        if self.is_external_object:
            return Type("object", self)
        return Type("function" if self.is_function else "component", self)

    @property
    def own(self) -> "dict[str, Element]":
        """The elements that the text of the class declares, without those of its base classes."""
        if self._own is None:
            self._own = {}
            try:
                self._declare()
            except BaseException:
                self._own = None
                raise
        return self._own

    @property
    def elements(self) -> "dict[str, Element]":
        """All elements by name. While base classes are looked up, only those that are known already."""
        if self._elements is None:
            if self._pending:
                return self.own
            self._pending = True
            try:
                self._elements = self._expanded()
            except BaseException:
                self._bases, self._base_at = [], []
                raise
            finally:
                self._pending = False
        return self._elements

    @property
    def bases(self) -> "list[Instance]":
        """Instances of the base classes."""
        _ = self.elements
        return self._bases

    def _declare(self) -> None:
        assert self._own is not None
        body = self.tree.body
        for name in self.definition.stored:
            self._own[name] = self._class(name, lambda name=name: self._stored(name), None)
        if not isinstance(body, t.Long):
            return
        for element in body.elements:
            if isinstance(element, t.Import | t.Extends) or element.is_redeclare or _extends_itself(element):
                continue
            if element.name in self._own:
                raise self.error(element.at, f"{self.name} declares {element.name} twice.")
            if isinstance(element, t.Class):
                definition = Definition(element, self.source, None)
                self._own[element.name] = self._class(element.name, lambda d=definition: d, element)
            else:
                self._own[element.name] = self._component(element)
        for name, outer in self.modifier.elements.items() if self.modifier else ():
            if (found := self._own.get(name)) is not None:
                self._own[name] = self._modified(found, found.tree, outer)

    def _stored(self, name: str) -> Definition:
        found = self.definition.load(name)
        assert found is not None
        return found

    def _class(self, name: str, load: Callable[[], Definition], tree: t.Class | None) -> ClassElement:
        found = ClassElement(name, self, self, self.top, load, is_protected=tree.is_protected if tree else False)
        if tree is not None:
            found.keep(_constraint_modifier(tree, self))
        return found

    def _modified(self, found: "Element", tree: t.Class | t.Component, outer: Modifier) -> "Element":
        """What a modifier makes of the element that `tree` declares."""
        self._check_changed(found.name, tree, outer)
        redeclaration, inside = outer.redeclaration, outer.without_redeclaration()
        if redeclaration is None:
            if outer.binding is not None and isinstance(found, ClassElement):
                raise outer.error(f"{found.name} is a class, which `redeclare` replaces, not a value.")
            found.modifier = merged(inside, found.modifier)
            return found
        new, scope, below = redeclaration.element, redeclaration.scope, redeclaration.below
        if below is not None:
            found = self._modified(found, tree, below)
        kept = _constraint_modifier(new, scope)
        if not redeclaration.extends_itself:
            kept = merged(kept, self._kept(tree, below))
        if isinstance(found, ClassElement) and isinstance(new, t.Class):
            definition = Definition(new, scope.source)
            changed = ClassElement(found.name, scope, self, self.top, lambda: definition, inside, replaced=found)
            changed.is_protected = found.is_protected
            changed.extended = found if redeclaration.extends_itself else None
            changed.keep(kept)
            return changed
        if isinstance(found, ClassElement) or isinstance(new, t.Class):
            own, other = ("class", "component") if isinstance(found, ClassElement) else ("component", "class")
            raise outer.error(f"{found.name} is a {own}, and cannot be redeclared as a {other}.")
        for prefix in ("connection", "causality", "variability"):
            before, after = found.prefix(prefix), getattr(new, prefix)
            is_less = prefix == "variability" and _VARIABILITIES[after] <= _VARIABILITIES[before]
            if before and after and after != before and not is_less:
                raise outer.error(f"{found.name} is declared {before}, and cannot become {after}.")
        return ComponentElement(new, scope, merged(inside, merged(redeclaration.own, kept)), self, replaced=found)

    def _kept(self, tree: t.Class | t.Component, outer: Modifier | None) -> Modifier | None:
        """The modifiers that redeclarations of an element have, too: those of its constraint, or of a declaration
        without one, and those that modify the element (section 7.3.2).
        """
        if outer is not None and outer.redeclaration is not None:
            redeclaration = outer.redeclaration
            constraint = _constraint_modifier(redeclaration.element, redeclaration.scope)
            return merged(outer.without_redeclaration(), merged(constraint, self._kept(tree, redeclaration.below)))
        if tree.constraint is not None:
            return merged(outer, _constraint_modifier(tree, self))
        body = tree if isinstance(tree, t.Component) else tree.body
        own = modifier_of(body.modification, self) if isinstance(body, t.Component | t.Short) else None
        return merged(outer, own)

    def _check_changed(self, name: str, tree: t.Class | t.Component, outer: Modifier) -> None:
        redeclaration = outer.redeclaration
        if tree.is_outer and not tree.is_inner and (outer.redeclaration or outer.binding or outer.elements):
            raise outer.error(f"the modifier changes {name}, which is outer.")
        if redeclaration and isinstance(tree, t.Component) and tree.variability == "constant":
            raise outer.error(f"{name} is a constant, and cannot be redeclared.")
        if outer.redeclaration and tree.is_final:
            raise outer.error(f"{name} cannot be redeclared, because it is final.")
        last = redeclaration.below.redeclaration if redeclaration and redeclaration.below else None
        before, scope = (last.element, last.scope) if last else (tree, self)
        if redeclaration and not (
            before.is_replaceable or _have_one_class(before, scope, redeclaration.element, redeclaration.scope)
        ):
            raise outer.error(f"{name} cannot be redeclared, because it is not replaceable.")
        if tree.is_final and (outer.binding or outer.elements):
            raise outer.error(f"the modifier changes {name}, which is final.")
        if (
            (tree.is_protected or self.is_hidden)
            and outer.scope.whole is not self.whole
            and not any(one is outer.scope for one in self.derivations())  # it comes from outside of the class
        ):
            raise outer.error(f"the modifier changes {name}, which is protected.")

    def _component(self, tree: t.Component) -> "ComponentElement":
        own = modifier_of(tree.modification, self)
        if tree.is_final and own is not None:
            own = dataclasses.replace(own, is_final=True)
        return ComponentElement(tree, self, merged(own, _constraint_modifier(tree, self)), self)

    # Inheritance

    def _expanded(self) -> "dict[str, Element]":
        if self.level > _DEPTH:
            raise self.error(self.tree.at, f"{self.name} extends itself.")
        body = self.tree.body
        if self.source is not _PREDEFINED and self.tree not in self.top.checked:
            self.top.checked.add(self.tree)
            restrictions.check(self.tree, self.source)
        found = dict(self.own)
        if isinstance(body, t.Long):
            self._inherit_all(body, found)
        elif isinstance(body, t.Short):
            scope = self.encloser or self.top
            modifier = modifier_of(body.modification, scope if isinstance(scope, Instance) else self)
            base = scope.find_class(body.type, self.source)
            self._inherit(base, merged(modifier, self.element.kept), self.tree.at, found)
        elif isinstance(body, t.Derivative):
            raise self.error(self.tree.at, "a function that is a partial derivative is not supported.")
        if self.modifier is not None and self.derived is None:
            self._check_names(self.modifier, found)
        found = self._ordered(found)
        for name in self.modifier.breaks if self.modifier else ():
            if not name.startswith("connect(") and found.pop(name, None) is None:
                assert self.modifier is not None
                raise self.modifier.error(f"{self.name} has no {name} to remove.")
        return found

    def _ordered(self, found: "dict[str, Element]") -> "dict[str, Element]":
        """Elements in the order of the text, with those of a base class in the place of its extends-clause."""
        if not self._bases or not isinstance(self.tree.body, t.Long):
            return found
        places = {e.name: e.at for e in self.tree.body.elements if isinstance(e, t.Class | t.Component)}
        clauses = [(places.get(name, -1), [name]) for name in self.own]
        clauses += [(at, list(base.elements)) for at, base in zip(self._base_at, self._bases, strict=True)]
        clauses.sort(key=lambda one: one[0])
        return {name: found[name] for _, names in clauses for name in names if name in found}

    def _inherit_all(self, body: t.Long, found: "dict[str, Element]") -> None:
        redeclared = self._redeclarations(body)
        if body.is_class_extends:
            assert self.element.extended is not None
            self._inherit(self.element.extended, modifier_of(body.extends, self), -1, found, redeclared)
        for element in body.elements:
            if isinstance(element, t.Extends):
                base = self.find_class(element.type, is_base=True)
                if self.element.extended is None and base.definition.tree is self.tree:
                    raise self.error(element.at, f"{self.name} extends itself.")
                modifier = modifier_of(element.modification, self)
                self._inherit(base, modifier, element.at, found, redeclared, is_protected=element.is_protected)
                restrictions.check_base(self.tree, self._bases[-1], self.source, element.at)
                if element.is_protected:
                    for inherited in self._bases[-1].elements.values():
                        inherited.is_protected = True
                first = element.type.parts[0]
                if first in found and first not in self.own and not element.type.is_global:
                    raise self.error(element.at, f"{self.name} inherits {first}, which is not the one that it extends.")
        alone = next((one for one in self._bases if one.type_causality or any(one.type_dims())), None)
        if alone is not None and (len(self._bases) > 1 or any(isinstance(one, t.Component) for one in body.elements)):
            raise self.error(
                self.tree.at,
                f"{self.name} extends {alone.name}, which has a size or a prefix, and can have nothing else.",
            )
        for name, modifier in redeclared.items():
            if name not in found:
                raise modifier.error(f"no base class of {self.name} has {name} to redeclare.")
            assert modifier.redeclaration is not None
            before = found[name].replaced
            if before is not None and before.is_protected != modifier.redeclaration.element.is_protected:
                raise modifier.error(
                    f"{name} is protected either here or in the base class, and must be so in both or none."
                )

    def _redeclarations(self, body: t.Long) -> dict[str, Modifier]:
        """The elements that redeclare those of base classes, as modifiers of these."""
        found: dict[str, Modifier] = {}
        for element in body.elements:
            if isinstance(element, t.Class | t.Component) and (element.is_redeclare or _extends_itself(element)):
                if element.name in found or element.name in self.own:
                    raise self.error(element.at, f"{self.name} declares {element.name} twice.")
                found[element.name] = Modifier(
                    self, element.at, redeclaration=redeclaration_of(element, self), is_final=element.is_final
                )
        return found

    def _inherit(
        self,
        base: ClassElement,
        modifier: Modifier | None,
        at: int,
        found: "dict[str, Element]",
        redeclared: dict[str, Modifier] | None = None,
        *,
        is_protected: bool = False,
    ) -> None:
        own = modifier
        if redeclared:
            own = merged(Modifier(self, at, elements=redeclared), modifier)
        outer = self.modifier
        if outer is not None:
            outer = dataclasses.replace(outer, binding=None, redeclaration=None, breaks=frozenset())
        instance = Instance(base, merged(merged(outer, own), base.modifier), self.path, self.component, self)
        instance.is_hidden = self.is_hidden or is_protected
        self._bases.append(instance)
        self._base_at.append(at)
        inherited = instance.elements
        if modifier is not None:
            instance._check_names(modifier, inherited)
        for name, element in inherited.items():
            before = found.get(name)
            if before is None:
                found[name] = element
            elif not _are_equal(before, element):
                raise self.error(
                    before.tree.at if name in self.own else at,
                    f"{self.name} has two elements {name} that differ, of its own or of its base classes.",
                )

    def _check_names(self, modifier: Modifier, found: "dict[str, Element]") -> None:
        """Raises `TextError` for a modifier of an element that does not exist."""
        known: Any = found
        if self.builtin:
            known = ATTRIBUTES[self.builtin]
        elif self.literals is not None:
            known = ATTRIBUTES["enumeration"]
        for name, inner in modifier.elements.items():
            if known is not found and inner.redeclaration is not None:
                raise inner.error(f"{name} is an attribute, and cannot be redeclared.")
            if name not in known:
                raise inner.error(f"{self.name} has no element {name} to modify.{suggestion(name, list(known))}")

    @ft.cached_property
    def builtin(self) -> str:
        """The predefined type that the class is or extends; empty for any other class."""
        if self.source is _PREDEFINED and self.tree.name in BUILTIN:
            return self.tree.name
        return next((base.builtin for base in self.bases if base.builtin), "")

    @ft.cached_property
    def literals(self) -> tuple[str, ...] | None:
        """The literals of an enumeration."""
        body = self.tree.body
        if isinstance(body, t.Enumeration):
            return body.literals or ()
        return next((base.literals for base in self.bases if base.literals is not None), None)

    def attributes(self) -> dict[str, Modifier]:
        """The modifiers of the attributes of a predefined type or enumeration."""
        found = self
        while found.bases:
            found = found.bases[0]
        return found.modifier.elements if found.modifier else {}

    def type_dims(self) -> "Iterator[tuple[Instance, t.Expression]]":
        """Sizes that short definitions of the class state, each with its scope."""
        for size in self.tree.body.dims if isinstance(self.tree.body, t.Short) else ():
            yield self.encloser or self, size
        for base in self.bases:
            if isinstance(self.tree.body, t.Short) or base.builtin or base.literals is not None:
                yield from base.type_dims()

    @ft.cached_property
    def type_causality(self) -> tuple[str, ...]:
        """The prefixes `input` and `output` of short definitions, the outermost one first."""
        body = self.tree.body
        own = (body.causality,) if isinstance(body, t.Short) and body.causality else ()
        inherited = (base for base in self.bases if isinstance(body, t.Short) or base.builtin)
        return sum((base.type_causality for base in inherited), own)

    def origin(self) -> "Instance":
        """The class that a chain of short definitions names in the end."""
        found = self
        while isinstance(found.tree.body, t.Short):
            found = found.bases[0]
        return found

    def lineage(self) -> "Iterator[Instance]":
        """The base classes in the order of the text, each before the class that extends it; the class itself last."""
        for base in self.bases:
            yield from base.lineage()
        yield self

    def annotation(self, name: str) -> t.Expression | None:
        """The value of an annotation of the class or of a base class."""
        for instance in reversed(list(self.lineage())):
            found = annotation(instance.tree.annotation, name)
            if found is not None:
                return found
        return None

    def inputs(self) -> "list[ComponentElement]":
        """The inputs of a function."""
        return [one for one in self.components() if one.causality == "input"]

    def outputs(self) -> "list[ComponentElement]":
        """The outputs of a function."""
        return [one for one in self.components() if one.causality == "output"]

    def components(self) -> "Iterator[ComponentElement]":
        for element in self.elements.values():
            if isinstance(element, ComponentElement):
                yield element

    def is_removed(self, connect: t.Connect) -> bool:
        """Whether `break connect(a, b)` removes a connection of this base class."""
        text = connection_text(connect)
        return any(one.modifier is not None and text in one.modifier.breaks for one in self.derivations())

    # Look-up (Modelica 3.6, section 5.3)

    def find(self, name: str, *, is_base: bool = False) -> "Element | None":
        """The element that a simple name means in this class, or in the classes around it. `is_base`: the name is that
        of a base class, which is not looked up among inherited elements.
        """
        for here in self.enclosers():
            found = (here.own if is_base else here.elements).get(name) or here._import(name)
            if found is not None:
                return found
            if here.tree.is_encapsulated:
                return self.top.predefined(name)
            is_base = False
        return self.top.find(name)

    def _import(self, name: str) -> "Element | None":
        if name not in self._imported:
            self._imported[name] = None  # while the imports are looked up
            self._imported[name] = self._imported_as(name)
        return self._imported[name]

    def _imported_as(self, name: str) -> "Element | None":
        body = self.tree.body
        imports = [x for x in body.elements if isinstance(x, t.Import)] if isinstance(body, t.Long) else []
        named = [one for one in imports if one.names is not None and name in one.names]
        if len(named) > 1:
            raise self.error(named[1].at, f"{self.name} imports {name} twice.")
        for clause in named:
            parts = clause.name.parts if clause.alias else (*clause.name.parts, name)
            found = self.top.find_path(parts, self, clause.at)
            if len(parts) > 1:
                self.top.check_package(self.top.find_path(parts[:-1], self, clause.at), self, clause.at)
            return found
        several: list[Element] = []
        for clause in imports:
            if clause.names is None:
                package = self.top.find_path(clause.name.parts, self, clause.at)
                self.top.check_package(package, self, clause.at)
                found = package.instance.elements.get(name) if isinstance(package, ClassElement) else None
                if found is not None and not found.is_protected:
                    several.append(found)
                    if several[0].tree is not found.tree:
                        raise self.error(clause.at, f"{name} is in several packages from which {self.name} imports.")
        return several[0] if several else None

    def find_class(self, name: t.Name, source: Source | None = None, *, is_base: bool = False) -> ClassElement:
        """The class that a name means. Raises `TextError`."""
        key = str(name)
        if key in self._classes:
            return self._classes[key]
        source = source or self.source
        found = self.top.find(name.parts[0]) if name.is_global else self.find(name.parts[0], is_base=is_base)
        if found is None:
            raise self.top.unknown(name.parts, self, name.at, f"there is no class {name}", source)
        found = inside(found, name.parts, source, name.at, self, is_base=is_base)
        if found.tree.is_outer:
            return self.inner_class(found)
        if not self._pending and self.modifier is None:
            self._classes[key] = found
        return found

    def inner_class(self, found: ClassElement) -> ClassElement:
        """The inner class of an outer one (section 5.4); the outer one itself if there is none."""
        body = found.tree.body
        if isinstance(body, t.Short) and body.modification is not None:
            raise found.definition.source.error(found.tree.at, f"{found.name} is outer, and cannot have modifiers.")
        inner = inner_element(found.name, found.holder.component if found.holder else None)
        if isinstance(inner, ComponentElement):
            raise inner.error(f"{found.name} is an inner component, but the outer element is a class.")
        return inner or found

    def __repr__(self) -> str:
        return f"<{self.name} at {self.path}>"


def inside(
    found: "Element",
    parts: tuple[str, ...],
    source: Source,
    at: int,
    user: "Instance | Top",
    *,
    is_base: bool = False,
) -> "ClassElement":
    """The class with the further parts of a name. `is_base`: that of a base class, which must not be replaceable."""
    for i, part in enumerate((*parts[1:], ""), 1):
        if isinstance(found, ComponentElement):
            raise source.error(at, f"{'.'.join(parts[:i])} is a component, not a class or package.")
        if is_base and found.tree.is_replaceable:
            raise source.error(at, f"{'.'.join(parts[:i])} is replaceable, and cannot be extended (section 7.1.4).")
        if not part:
            break
        found.check_inside(user, source, at)
        found = found.member(part, ft.partial(source.error, at))
    if isinstance(found, ComponentElement):
        raise source.error(at, f"{'.'.join(parts)} is a component, not a class.")
    return found


@dataclasses.dataclass(eq=False, repr=False)
class ComponentElement:
    """A component as an element of a class instance. `scope` is the class instance of its declaration's text, `holder`
    the one whose element it is, `replaced` the component that a redeclaration has replaced.
    """

    tree: t.Component
    scope: Instance
    modifier: Modifier | None
    holder: Instance
    replaced: "ComponentElement | None" = None
    is_protected: bool = False
    dims: tuple[int | None, ...] | None = None  # found by structure.py
    is_present: bool | None = None
    inner: "ComponentElement | None" = None
    is_added: bool = False  # to an expandable connector
    has_equation: bool = False  # a record that a call of a function gives
    _type: ClassElement | None = None
    _members: dict[Index, Instance] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        self.name = self.tree.name
        self.is_protected = self.tree.is_protected or bool(self.replaced and self.replaced.is_protected)

    @property
    def place(self) -> SourcePlace:
        """The place of the declaration."""
        return self.scope.source.place(self.tree.at)

    def error(self, message: str) -> TextError:
        return self.scope.source.error(self.tree.at, message)

    @property
    def path(self) -> str:
        return join(self.holder.path, self.name)

    @property
    def parent(self) -> "ComponentElement | None":
        return self.holder.component

    @property
    def type(self) -> ClassElement:
        if self._type is None:
            self._type = self.scope.find_class(self.tree.type)
            _check_constraint(self, self._type.instance, self.error)
        return self._type

    @property
    def constraint(self) -> ClassElement:
        """The constraining type of redeclarations (section 7.3.2)."""
        stated = self.tree.constraint
        if stated is None and self.replaced is not None:
            return self.replaced.constraint
        return self.scope.find_class((stated or self.tree).type)

    @property
    def binding(self) -> Binding | None:
        return self.modifier.binding if self.modifier else None

    def stated_sizes(self) -> list[tuple[Instance, t.Expression]]:
        """The sizes in the text of the declaration and of its type, with the class instances that have them."""
        declared = self
        while declared.replaced is not None and not declared.tree.dims:
            declared = declared.replaced
        return [*((declared.scope, size) for size in declared.tree.dims), *self.prototype.type_dims()]

    @property
    def prototype(self) -> Instance:
        """The type, without the index of a member."""
        return self._members.get(()) or self.member(())

    @property
    def value_type(self) -> Type:
        return self.prototype.value_type

    def member(self, index: Index) -> Instance:
        """The type of a member of an array of components."""
        if index not in self._members:
            if self.depth > _DEPTH:
                raise self.error(f"the class of {self.name} contains itself.")
            modifier = self.modifier
            if modifier is not None:
                modifier = (modifier.indexed(self, index) if index else modifier).without_binding()
            path = self.path + (f"[{','.join(map(str, index))}]" if index else "")
            self._members[index] = self.type.instantiate(modifier, path, self)
        return self._members[index]

    @property
    def depth(self) -> int:
        return sum(1 for _ in self.around())

    def around(self) -> "Iterator[ComponentElement]":
        """The components around it, the innermost first."""
        found = self.parent
        while found is not None:
            yield found
            found = found.parent

    @property
    def is_inner(self) -> bool:
        return self.tree.is_inner or bool(self.replaced and self.replaced.is_inner)

    @property
    def is_outer(self) -> bool:
        return self.tree.is_outer or bool(self.replaced and self.replaced.is_outer)

    @property
    def condition(self) -> t.Expression | None:
        return self.replaced.condition if self.replaced else self.tree.condition

    @property
    def condition_scope(self) -> Instance:
        return self.replaced.condition_scope if self.replaced else self.scope

    def prefix(self, name: str) -> str:
        """The prefix `variability`, `causality` or `connection`, possibly that of a replaced declaration."""
        own = getattr(self.tree, name)
        return own or (self.replaced.prefix(name) if self.replaced else "")

    @property
    def variability(self) -> str:
        """The variability of the declaration, or of the component around it if that changes less."""
        own = self.prefix("variability")
        around = self.parent.variability if self.parent is not None else ""
        return min(own, around, key=_VARIABILITIES.__getitem__)

    @property
    def causality(self) -> str:
        own = self.causalities
        return own[0] if own else self.parent.causality if self.parent is not None else ""

    @property
    def causalities(self) -> tuple[str, ...]:
        """The prefixes `input` and `output` of the declaration and of its type."""
        own = self.prefix("causality")
        return ((own,) if own else ()) + self.type.instance.type_causality

    @property
    def connection(self) -> str:
        """The prefix `flow` or `stream`."""
        own = self.prefix("connection")
        return own or (self.parent.connection if self.parent is not None else "")

    @property
    def is_final(self) -> bool:
        return self.tree.is_final or bool(self.modifier and self.modifier.is_final)

    def annotation(self, name: str) -> t.Expression | None:
        return annotation(self.tree.annotation, name)

    @property
    def is_local(self) -> bool:
        """Whether it belongs to a function."""
        return self.holder.whole.is_function if self.parent is None else self.parent.is_local

    def __repr__(self) -> str:
        return f"<component {self.path}>"


Element: TypeAlias = ClassElement | ComponentElement


def inner_element(name: str, around: ComponentElement | None) -> Element | None:
    """The inner element of a name that is next to a component, or to the components around it (section 5.4)."""
    for component in () if around is None else (around, *around.around()):
        found = component.holder.whole.elements.get(name)
        if found is not None and (found.tree.is_inner if isinstance(found, ClassElement) else found.is_inner):
            return found
    return None


class Top:
    """The top of the classes: predefined ones, those of the user's text, and libraries. `root` is the model."""

    def __init__(self, libraries: Libraries) -> None:
        self.libraries = libraries
        self.root: Instance | None = None
        self.checked: set[t.Class] = set()  # against the restrictions of their kind
        self._found: dict[str, ClassElement | None] = {}
        for tree in parse(_PREDEFINED).classes:
            definition = Definition(tree, _PREDEFINED)
            self._found[tree.name] = ClassElement(tree.name, None, None, self, lambda d=definition: d)
        self._predefined = dict(self._found)

    def predefined(self, name: str) -> ClassElement | None:
        return self._predefined.get(name)

    def find(self, name: str) -> ClassElement | None:
        """A top class."""
        if name not in self._found:
            definition = self.libraries.find(name)
            self._found[name] = None if definition is None else ClassElement(name, None, None, self, lambda: definition)
        return self._found[name]

    def find_class(self, name: t.Name, source: Source | None = None) -> ClassElement:
        assert source is not None
        found = self.find(name.parts[0])
        if found is None:
            raise source.error(name.at, f"there is no class {name}.")
        return inside(found, name.parts, source, name.at, self)

    def find_path(self, parts: tuple[str, ...], user: Instance, at: int) -> "Element":
        """A class or constant by its full name, which `user` imports. Raises `TextError`."""
        found: Element | None = self.find(parts[0])
        if found is None:
            raise self.unknown(parts, user, at, f"there is no class {'.'.join(parts)} to import", user.source)
        for part in parts[1:]:
            if isinstance(found, ComponentElement):
                raise user.error(at, f"{found.path} is a component, from which nothing can be imported.")
            found = found.member(part, ft.partial(user.error, at))
        return found

    def check_package(self, found: "Element", user: Instance, at: int) -> None:
        """Raises `TextError` for an import from something else than a package (section 13.2.1.1)."""
        if not isinstance(found, ClassElement) or found.instance.kind not in ("package", "operator", "class"):
            raise user.error(at, f"{found.name} is no package, and nothing can be imported from it.")

    def unknown(self, parts: tuple[str, ...], user: Instance, at: int, message: str, source: Source) -> TextError:
        """The error for a name that is not found, with a suggestion, or the library that is missing and its version."""
        first, *further = parts
        around = list(user.enclosers())
        known = {
            *self.libraries.names(),
            *(() if further else self._predefined),
            *(n for a in around for n in a.elements),
        }
        if not further:
            # A name that is known around an encapsulated class cannot be used in it.
            return source.error(at, f"{message}.{'' if first in known else suggestion(first, sorted(known))}")
        version = version_wanted(first, [one.definition for one in around])
        uses = "" if version is None else f"{first} {version}".strip()
        name = ".".join(one.name for one in reversed(around))
        needed = f"{name} needs the library {uses}. Give" if uses else f"If {first} is a library, give"
        similar = "" if uses else suggestion(first, sorted(known))
        given = self.libraries.given()
        return source.error(at, f"{message}.{similar} {needed} its folder by roots=[...]; {given}.")

    def model(self, name: str, modification: t.Modification | None, source: Source) -> Instance:
        """The instance of the model that is flattened. Raises `ModelicaError`."""
        parts = tuple(name.split("."))
        found = self.find(parts[0])
        if found is None:
            raise ModelicaError(
                f"There is no model {name}.{suggestion(parts[0], self.libraries.names())} "
                "Give its full name, and the folder of its library by roots=[...]."
            )
        element: Element = found
        for part in (*parts[1:], ""):
            if isinstance(element, ComponentElement):
                raise ModelicaError(f"{element.path} is a component, not a model.")
            element = element.member(part, ModelicaError) if part else element
        assert isinstance(element, ClassElement)
        wrapper = Source("<request>", "")
        scope = Instance(
            ClassElement("", None, None, self, lambda: Definition(_EMPTY, source or wrapper)), None, "", None
        )
        modifier = modifier_of(modification, scope)
        self.root = Instance(element, merged(modifier, element.modifier), "", None)
        return self.root


_EMPTY = parse(Source("<request>", "model request end request;")).classes[0]


def annotation(modification: t.Modification | None, name: str) -> t.Expression | None:
    """The value of an annotation."""
    found = modification.named(name) if modification else []
    return found[0].modification.value if found else None


def _extends_itself(element: t.Component | t.Class) -> bool:
    return isinstance(element, t.Class) and isinstance(element.body, t.Long) and element.body.is_class_extends


def _constraint_modifier(tree: t.Class | t.Component, scope: Instance) -> Modifier | None:
    return modifier_of(tree.constraint.modification, scope) if tree.constraint is not None else None


def _are_equal(a: Element, b: Element) -> bool:
    """Whether two elements of one name are the same, as two base classes may have them."""
    if not _have_one_text(_values(a.modifier), _values(b.modifier)):
        return False
    if a.tree is b.tree:
        return True
    if isinstance(a, ClassElement) and isinstance(b, ClassElement):
        return a.target() is b.target() or _have_one_text(a.tree, b.tree)
    if isinstance(a, ClassElement) or isinstance(b, ClassElement):
        return False
    same = a.type.definition.tree is b.type.definition.tree or a.type.path == b.type.path
    same = same and _have_one_text((a.tree.dims, a.tree.condition), (b.tree.dims, b.tree.condition))
    return same and all(a.prefix(name) == b.prefix(name) for name in ("variability", "causality", "connection"))


def _have_one_class(a: t.Class | t.Component, a_scope: Instance, b: t.Class | t.Component, b_scope: Instance) -> bool:
    """Whether two components have the same class, or two short classes name the same one: the second declaration then
    changes no class, though possibly prefixes and sizes.
    """
    if isinstance(a, t.Component) and isinstance(b, t.Component):
        own, other = a_scope.find_class(a.type).target(), b_scope.find_class(b.type).target()
        return own.definition.tree is other.definition.tree
    if (
        isinstance(a, t.Class)
        and isinstance(b, t.Class)
        and isinstance(a.body, t.Short)
        and isinstance(b.body, t.Short)
    ):
        plain = not (a.body.modification or a.body.dims or b.body.modification or b.body.dims)
        return plain and a_scope.find_class(a.body.type).target() is b_scope.find_class(b.body.type).target()
    return False


def _values(modifier: Modifier | None) -> tuple[object, ...]:
    """The values in a modifier, by the names of their elements."""
    if modifier is None:
        return ()
    own: tuple[object, ...] = () if modifier.binding is None else (modifier.binding.expression,)
    if modifier.redeclaration is not None:
        own = (*own, modifier.redeclaration.element)
    inner = [(name, _values(modifier.elements[name])) for name in sorted(modifier.elements)]
    return (*own, *((name, value) for name, value in inner if value))


def _have_one_text(a: object, b: object) -> bool:
    """Whether two trees are the same, but for their places."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_have_one_text(x, y) for x, y in zip(a, b, strict=True))
    if type(a) is not type(b):
        return False
    if not dataclasses.is_dataclass(a):
        return a == b
    names = [one.name for one in dataclasses.fields(a) if one.name != "at"]
    return all(_have_one_text(getattr(a, name), getattr(b, name)) for name in names)


def _check_constraint(own: Element, new: Instance, error: Callable[[str], TextError]) -> None:
    """Raises `error` for a class that does not fit its constraint, or that of what it replaces (section 7.3.2)."""
    if own.tree.constraint is not None:
        check_subtype(new, own.constraint.instance, error, "its constraint")
    if own.replaced is not None:
        wanted = own.replaced.constraint.instance
        check_subtype(own.constraint.instance if own.tree.constraint is not None else new, wanted, error)


def check_subtype(
    new: Instance, wanted: Instance, error: Callable[[str], TextError], role: str = "which it replaces"
) -> None:
    """Raises `error` for a class without the elements of the one that it replaces (section 7.3, chapter 6)."""
    if new.tree is wanted.tree:
        return
    if new.builtin != wanted.builtin and (wanted.builtin or new.builtin) and wanted.kind == "type":
        raise error(f"{new.name} is no {wanted.builtin or wanted.name}, {role}.")
    if wanted.literals and new.literals != wanted.literals:
        raise error(f"{new.name} has other literals than {wanted.name}, {role}.")
    for one in wanted.components():
        if one.is_protected:
            continue
        own = new.elements.get(one.name)
        if not isinstance(own, ComponentElement):
            raise error(f"{new.name} has no {one.name}, as {wanted.name} has, {role}.")
        kind, other = own.type.instance.builtin, one.type.instance.builtin
        if kind != other and (kind or other) and (kind, other) != ("Integer", "Real"):
            raise error(f"{own.path} is no {other or one.type.name}, as in {wanted.name}, {role}.")
