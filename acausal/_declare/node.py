"""The classes of models: `Component`, `Port` and `Record`, all pytrees that declare their leaves."""

import copy
import dataclasses
import sys
import types
import typing
from collections.abc import Container, Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, NoReturn, cast, dataclass_transform

import equinox as eqx
import jax
import numpy as np

from .._errors import ArgumentError, ModelError, ParameterError, UnknownNameError, listed, suggestion
from .._numbers import Scalar
from .annotations import Declaration, declared
from .class_help import OwnText, attributes, class_text, html_method, plain_signature
from .fields import (
    CONVERTERS,
    Converter,
    check_arguments,
    computes_fields,
    dynamic_fields,
    join,
    known_here,
    parts_of,
    plain_number,
    remember_arguments,
)
from .node_requirements import Requirements, broken


def _own_annotations(namespace: dict[str, Any]) -> dict[str, Any]:
    """Annotations of the class under construction, in the storage of this version of Python."""
    if "__annotations__" in namespace:
        return dict(namespace["__annotations__"])
    if sys.version_info < (3, 14):
        return {}
    import annotationlib

    annotate = annotationlib.get_annotate_from_class_namespace(namespace)
    if annotate is None:
        return {}
    return annotationlib.call_annotate_function(annotate, annotationlib.Format.FORWARDREF)


def _evaluated(annotation: object, namespace: dict[str, Any]) -> object:
    """A postponed annotation, resolved if its names are already defined; otherwise unchanged."""
    if not isinstance(annotation, str):
        return annotation
    scope = vars(sys.modules[namespace["__module__"]]) | namespace
    try:
        return eval(annotation, scope)
    except NameError:
        return annotation


def _holds_parts(annotation: object) -> bool:
    """Whether an annotation stands for components, ports or records; an unresolved name counts as one."""
    if isinstance(annotation, str | typing.TypeVar):
        return True
    origin = typing.get_origin(annotation)
    if origin in (tuple, typing.Union, types.UnionType):
        return any(_holds_parts(argument) for argument in typing.get_args(annotation))
    kind = origin if isinstance(origin, type) else annotation
    return isinstance(kind, type) and issubclass(kind, Node)


@dataclass_transform(kw_only_default=True, field_specifiers=(dataclasses.field, eqx.field))
class NodeMeta(type(eqx.Module)):
    """Turns declarations into dataclass fields, and keeps each class either partial or final."""

    _partial: bool

    def __dir__(cls) -> list[str]:
        return attributes(cls, super().__dir__())

    if not TYPE_CHECKING:  # type checkers take the arguments and the result from the class
        __doc__ = property(class_text)
        __signature__ = property(plain_signature)
        _repr_html_ = property(html_method)

        def __call__(cls, *args: Any, **kwargs: Any) -> Any:
            if cls._partial:
                raise ModelError(f"{cls.__name__} is partial: derive a component from it and instantiate that.")
            check_arguments(cls, args, kwargs)
            made = super().__call__(*args, **kwargs)
            if computes_fields(cls):
                remember_arguments(made, kwargs)
            return made

    def __new__(mcs, name: str, bases: tuple[type, ...], namespace: dict[str, Any], *, partial: bool = False):
        if namespace.get("__module__") != __name__:
            _check_bases(name, bases)
        annotations = _own_annotations(namespace)
        _check_overrides(name, bases, namespace, annotations)
        for field, annotation in annotations.items():
            annotation = _evaluated(annotation, namespace)
            if typing.get_origin(annotation) is not ClassVar and annotation is not ClassVar:
                _check_kind(name, bases, field, annotation)
                namespace[field] = _field(name, field, annotation, namespace.get(field, dataclasses.MISSING))
        namespace["__doc__"] = OwnText(namespace.get("__doc__") or "")
        cls = super().__new__(mcs, name, bases, namespace)
        cls._partial = partial
        _own_converters(cls, annotations)
        return cls


def _check_bases(name: str, bases: tuple[type, ...]) -> None:
    for base in bases:
        if isinstance(base, NodeMeta) and not base._partial and not cast(Any, base)._is_composite():
            partial = [kind.__name__ for kind in base.__bases__ if not kind.__module__.startswith(str(__package__))]
            also = f", derive from {' and '.join(partial)} as {base.__name__} does" if partial else ""
            raise ModelError(
                f"{name} derives from {base.__name__}, which is final: only a class that does no more than join parts "
                f"can be varied. Use {base.__name__} as a part{also}, or move their common fields to a base with "
                "`partial=True`."
            )


def derived(cls: Any, fields: Mapping[str, object], namespace: Mapping[str, object]) -> Any:
    """A class with more fields and other methods. The engine, unlike users, may derive from final classes."""
    meta: Any = NodeMeta
    return meta(cls.__name__, (cls,), {"__module__": __name__, "__annotations__": dict(fields), **namespace})


def extended(node: "Node", cls: Any, **fields: object) -> Any:
    """A node as an instance of a class derived from its own, with the values of the additional fields."""
    made = object.__new__(cls)
    for name, value in {**vars(node), **fields}.items():
        object.__setattr__(made, name, value)
    return made


def _own_converters(cls: Any, annotations: Container[str]) -> None:
    """Let messages about inherited fields name the class itself, not its base."""
    for field in dataclasses.fields(cls):
        converter = field.metadata.get("converter")
        if field.name not in annotations and isinstance(converter, Converter):
            own = copy.copy(field)
            of_class = dataclasses.replace(converter, where=f"{cls.__name__}.{field.name}")
            own.metadata = types.MappingProxyType({**field.metadata, "converter": of_class})
            cls.__dataclass_fields__[field.name] = own


def _check_overrides(name: str, bases: tuple[type, ...], namespace: dict[str, Any], annotations: dict) -> None:
    inherited = {field.name for base in bases if isinstance(base, NodeMeta) for field in dataclasses.fields(base)}
    for field in sorted(inherited & namespace.keys() - annotations.keys()):
        raise ModelError(f"{name}.{field} overrides a declared field without an annotation; annotate it again.")


def _check_kind(name: str, bases: tuple[type, ...], field: str, annotation: object) -> None:
    """Check that an inherited port or part stays a part; its class may become narrower."""
    for base in bases:
        inherited = dict(dynamic_fields(base)) if isinstance(base, NodeMeta) else {}
        if field in inherited and inherited[field] is None and not _holds_parts(annotation):
            raise ModelError(
                f"{name}.{field} replaces a port or part of {base.__name__} by something else. Give it another name."
            )


def _field(owner: str, name: str, annotation: Any, default: object) -> object:
    where = f"{owner}.{name}"
    declaration = declared(annotation, where)
    if isinstance(default, dataclasses.Field):
        default.kw_only = True
        return default
    if declaration is None and not _holds_parts(annotation):
        return eqx.field(static=True, kw_only=True, default=default, converter=plain_number(annotation))
    if declaration is None:
        if isinstance(default, Node) and any(leaf.declaration.role == "param" for leaf in leaves_of(default)):
            raise ModelError(
                f"{where} has a default with parameters. Create it in the constructor of the component, or give a "
                "function, as in `dataclasses.field(default_factory=lambda: Gain(k=1.0))`, so that its numbers are "
                "64-bit and each component has its own."
            )
        return eqx.field(kw_only=True, default=default)
    if declaration.role != "param" and declaration.sizes is None:
        raise ModelError(f"{where} is an array variable: declare its shape, as in Var[Vector, 'K', shape('n')].")
    if declaration.role != "param":
        # The default in the class is a first guess, stored in the declaration. The field is None unless a model gives a
        # start value, which distinguishes given values from guesses.
        start = 0.0 if default is dataclasses.MISSING else default
        if not isinstance(start, int | float):
            raise ModelError(f"{where} must start from a plain number, got {start!r}.")
        if declaration.sign is not None and not declaration.sign.admits(start):
            raise ModelError(
                f"{where} must be {declaration.sign.name}, but starts from {start:g}. Give it a value in its range to "
                "start from, as in `T: Var[Scalar, 'K', positive] = 293.15`."
            )
        declaration, default = dataclasses.replace(declaration, start=float(start)), None
    metadata = {"declaration": declaration}
    converter = Converter(CONVERTERS[declaration.role], declaration.unit, where)
    return eqx.field(converter=converter, kw_only=True, default=default, metadata=metadata)


class Node(eqx.Module, metaclass=NodeMeta, partial=True):
    """Base class of all parts of models. Fields are declared with `Param`, `Var`, `Flow`, as parts, or are static."""

    def __check_init__(self) -> None:
        for sentence in broken(self):
            raise ParameterError(f"{type(self).__name__}.{sentence}")
        for field in dataclasses.fields(self):
            where, value = f"{type(self).__name__}.{field.name}", getattr(self, field.name)
            if field.metadata.get("static"):
                _check_static(where, value)
            elif "declaration" not in field.metadata:
                _check_parts(where, value)

    def _shown(self) -> tuple[str, "Node"]:
        """Kind of the node in a tree, and the node that holds its parts."""
        return type(self).__name__, self

    def requirements(self) -> Requirements:
        """Conditions on parameters beyond their declared ranges: a tuple of `require(...)`.

        The check needs known numbers: it happens when a component is built, and in `replace`, `simulate`, `initialise`,
        `linearise` and `check`. Under `jit`, a run that violates a condition has the result `bad_parameter`.
        """
        return ()

    def start_requirements(self) -> Requirements:
        """Conditions on the start values of its own variables, checked when it is built: a tuple of `require(...)`."""
        return ()

    @classmethod
    def _is_composite(cls) -> bool:
        """Whether the class only joins parts, so that other classes can vary it."""
        return False

    @classmethod
    def _states_requirements(cls) -> bool:
        """Whether the class states requirements of its own."""
        return cls.requirements is not Node.requirements

    @classmethod
    def _states_start_requirements(cls) -> bool:
        """Whether the class states requirements on its start values."""
        return cls.start_requirements is not Node.start_requirements

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore from a pickle. Raises `ModelError` if the fields of the class have changed since it was written."""
        declared_now = {field.name for field in dataclasses.fields(self)}
        if others := declared_now ^ state.keys():
            lists = [sorted(others - declared_now), sorted(others & declared_now)]
            said = [
                f"{verb} {', '.join(names)}" for verb, names in zip(("holds", "lacks"), lists, strict=True) if names
            ]
            raise ModelError(f"{type(self).__name__} has changed: the stored object {' and '.join(said)}.")
        for name, value in state.items():
            object.__setattr__(self, name, value)

    if not TYPE_CHECKING:
        # Equinox looks at each attribute for a method, in Python, which would take most of the time of a compiled call.
        __getattribute__ = object.__getattribute__

        def __getattr__(self, name: str) -> NoReturn:
            if name.startswith("__"):
                raise AttributeError(name)
            names = [name for name, _ in dynamic_fields(type(self))]
            answer = known_here(type(self), name) or suggestion(name, names) or f" It has {listed(names)}."
            raise UnknownNameError(f"{type(self).__name__} has no port, part, parameter or variable {name!r}.{answer}")


def _check_static(where: str, value: object) -> None:
    if isinstance(value, Mapping):
        for name, item in value.items():
            _check_static(f"{where}[{name!r}]", item)
        return
    for path, item in parts_of(value, where):
        if isinstance(item, jax.Array | np.ndarray | Node):
            raise ModelError(
                f"{path} holds {type(item).__name__}, but does not declare it: annotate an array with Param[...], a "
                "part with its class, and several with tuple[..., ...] or Array[...] of it."
            )


def _check_parts(where: str, value: object) -> None:
    for path, part in parts_of(value, where):
        if not isinstance(part, Node):
            raise ArgumentError(f"{path} must be a component, a port or a record, got {part!r}.")


class Port(Node, partial=True):
    """Variables that a connection shares: across variables (`Var`) become equal, through variables (`Flow`) sum to 0.

    A flow is positive into the component. With `needs_connection`, an open port is an error. `reference` and `storage`
    are remedies in error messages: `reference` fixes the level of the across variables ("a Ground"), `storage` takes up
    a difference of flows ("a Chamber").
    """

    needs_connection: ClassVar[bool] = False
    reference: ClassVar[str] = ""
    storage: ClassVar[str] = ""

    def power(self, d: Any) -> Scalar:
        """The power into the component in W, from the variables and their time derivatives `d`.

        Checks of components need it for every port with a flow.
        """
        del d
        if any(leaf.declaration.role == "flow" for leaf in leaves_of(self)):
            name = type(self).__name__
            raise ModelError(
                f"{name} does not state its power. Remedy: add a method to {name}, such as "
                "`def power(self, d): return self.v * self.i`."
            )
        return 0.0


class Record(Node, partial=True):
    """A set of parameters with methods, such as a cam profile, without variables."""


def nodes_of(node: Node, path: str = "") -> Iterator[tuple[str, Node]]:
    """A node and all nodes below it, each with its path."""
    yield path, node
    for name, declaration in dynamic_fields(type(node)):
        for part_path, part in parts_of(getattr(node, name), join(path, name)) if declaration is None else ():
            if isinstance(part, Node):
                yield from nodes_of(part, part_path)


class Leaf(NamedTuple):
    """One leaf of a model: its path, declaration, value and declared shape."""

    path: str
    declaration: Declaration
    value: Any
    sizes: tuple[int, ...] | None


def check_is_node(model: object) -> None:
    """Raise `ModelError` for a model that is not a component, a port or a record, such as a class or a solution."""
    if not isinstance(model, Node):
        remedy = f"create one, as in {model.__name__}(...)" if isinstance(model, type) else "pass a model"
        raise ModelError(f"{model!r} is not a component: {remedy}.")


def leaves_of(node: Node, path: str = "") -> Iterator[Leaf]:
    """Every leaf below `node`, in pytree order."""
    check_is_node(node)
    for name, declaration in dynamic_fields(type(node)):
        value = getattr(node, name)
        if declaration is not None:
            yield Leaf(join(path, name), declaration, value, resolved_sizes(node, declaration))
            continue
        for part_path, part in parts_of(value, join(path, name)):
            if not isinstance(part, Node):
                raise ModelError(
                    f"{part_path} holds a value of type {type(part).__name__}, but a part must be a Component, "
                    "a Port or a Record."
                )
            yield from leaves_of(part, part_path)


def resolved_sizes(node: Node, declaration: Declaration) -> tuple[int, ...] | None:
    """The declared shape of a leaf; None for the shape of its value."""
    if declaration.sizes is None:
        return None
    return tuple(getattr(node, size) if isinstance(size, str) else size for size in declaration.sizes)
