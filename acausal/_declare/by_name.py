"""Parameters and parts of a model by name, and models with others."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar, cast

import jax
import numpy as np

from .._errors import ModelError, ParameterError, UnitError, suggestion
from .._tracing import are_traced
from .._units.parsing import UnknownUnit, parsed, quotient
from .annotations import Declaration
from .array import Array
from .component import Component
from .fields import (
    CONVERTERS,
    argument_names,
    computes_fields,
    copied,
    dynamic_fields,
    first_index,
    given_arguments,
    join,
    parts_of,
)
from .layout import determined_names, rebuilt, with_determined
from .node import Node, check_is_node, leaves_of, nodes_of
from .node_requirements import broken, out_of_range
from .tree import value_table, with_unit

N = TypeVar("N", bound=Node)


def arguments_of(node: Node) -> dict[str, Any] | None:
    """The constructor arguments of a node by name, fields with their present values; None if they are lost."""
    cls: type = type(node)
    fields = {field.name: getattr(node, field.name) for field in dataclasses.fields(node) if field.init}
    if not computes_fields(cls):
        return fields
    given = given_arguments(node)
    # The start values of a constructor may have another form than those of the fields.
    variables = {name for name, leaf in dynamic_fields(type(node)) if leaf is not None and leaf.role != "param"}
    kept = argument_names(cls) - variables
    present = {name: value for name, value in fields.items() if name in kept and value is not None}
    return None if given is None else {**given, **present}


def with_arguments(node: N, changes: Mapping[str, object], path: str) -> N:
    """A node rebuilt with some other constructor arguments. It keeps the parameters and start values that were set
    later, unless these arguments determine them.

    Raises `ParameterError` if they do, and `ModelError` if the arguments of the node are lost.
    """
    names, given = ", ".join(join(path, name) for name in changes), arguments_of(node)
    if given is None:
        raise ModelError(
            f"{names}: the constructor computes parameters from this argument, which a model does not keep through "
            "jit, vmap, grad, tree_at or a file. Replace it before."
        )
    cls: type = type(node)
    made: N = cls(**{**given, **changes})
    if not computes_fields(cls):
        return made
    with jax.ensure_compile_time_eval():  # numbers that are known stay known while another function is traced
        before, now = _leaves(cls(**given)), _leaves(node)
    later = {name: now[name] for name in before.keys() & now.keys() if not _is_same(before[name], now[name])}
    new = _leaves(made)
    for name in later:
        if name not in new or not _is_same(new[name], before[name]):
            raise ParameterError(f"{names} determines {join(path, name)}, which was set since. Set {names} first.")
    return rebuilt(made, lambda name, declaration, value: later.get(name, value))


def with_nodes(node: Any, new: Mapping[str, Node], path: str = "") -> Any:
    """A tree of nodes with other nodes at some paths."""
    if path in new:
        return new[path]
    if isinstance(node, tuple | list):
        indexed = enumerate(node, start=first_index(node))
        return type(node)(with_nodes(item, new, f"{path}[{index}]") for index, item in indexed)
    if not isinstance(node, Node) or (path and not any(name.startswith(f"{path}.") for name in new)):
        return node
    parts = [name for name, declaration in dynamic_fields(type(node)) if declaration is None]
    return copied(node, {name: with_nodes(getattr(node, name), new, join(path, name)) for name in parts})


def _leaves(node: Node) -> dict[str, Any]:
    return {leaf.path: leaf.value for leaf in leaves_of(node)}


def _is_same(a: Any, b: Any) -> bool:
    """Whether two values are known and equal, or both are missing."""
    if a is None or b is None:
        return a is b
    return not are_traced(a, b) and np.array_equal(a, b)


M = TypeVar("M", bound=Component)


@jax.tree_util.register_pytree_node_class
class Parameters(dict[str, Any]):
    """Parameters, or sensitivities to them, by path, with their `units`. `print` shows a table."""

    def __init__(self, values: Mapping[str, Any], units: Mapping[str, str]) -> None:
        super().__init__(values)
        self.units = dict(units)

    def __str__(self) -> str:
        width = max(map(len, self), default=0)
        return "\n".join(f"{path:{width}}  {with_unit(value, self.units[path])}" for path, value in self.items())

    def _repr_html_(self) -> str:
        return value_table([(path, with_unit(value, self.units[path])) for path, value in self.items()])

    def tree_flatten(self) -> tuple[list[Any], tuple[tuple[str, str], ...]]:
        """The values and, as static data, the units."""
        return list(self.values()), tuple(self.units.items())

    @classmethod
    def tree_unflatten(cls, units: tuple[tuple[str, str], ...], values: Iterable[Any]) -> "Parameters":
        """The inverse of `tree_flatten`."""
        return cls(dict(zip(dict(units), values, strict=True)), dict(units))


def parameters(model: Component, of: str | None = None) -> Parameters:
    """The parameters of a model by path, or the sensitivities in a gradient with respect to a model, without parameters
    that others determine.

    `of` is the unit of the differentiated result: with `of="s"`, the sensitivity to a resistance is in s/ohm.
    """
    leaves = [leaf for leaf in leaves_of(model) if leaf.declaration.role == "param"]
    others = determined_names(model)
    leaves = [leaf for leaf in leaves if leaf.path not in others]
    units = {leaf.path: leaf.declaration.unit for leaf in leaves}
    if of is not None:
        try:
            parsed(of)
        except UnknownUnit as error:
            raise UnitError(f"of: {error}") from error
        units = {path: quotient(of, unit) for path, unit in units.items()}
    return Parameters({leaf.path: leaf.value for leaf in leaves}, units)


def replace(model: M, values: Mapping[str, object]) -> M:
    """A copy of the model with other parameters or start values, by path: `replace(model, {"gearbox.ratio": 5.0})`.

    None removes a start value. A path can also name a part, as in `replace(model, {"controller": notch})`, a static
    field, as in `{"line.n": 20}`, or a constructor argument from which a component computes its parameters, such as
    `{"valve.rated_flow": 4e-4}`. The component is then rebuilt.

    Raises `ModelError` for an unknown name. Raises `ParameterError` for a value that the constructor of its component
    would refuse; a run checks the relations between parameters of a member of an array.
    """
    if not isinstance(values, Mapping):
        raise ModelError(f"replace(model, values) takes a dictionary by path, got {values!r}.")
    check_is_node(model)
    refuse_fixed(model, map(str, values))
    known = {leaf.path for leaf in leaves_of(model)}
    others = {str(name): value for name, value in values.items() if name not in known}
    if others:
        model = _with_others(model, others)
        values = {name: value for name, value in values.items() if name not in others}
        known = {leaf.path for leaf in leaves_of(model)}
    for name in map(str, values):
        if name not in known:
            raise ModelError(f"The model has no parameter or start value {name!r}.{suggestion(name, known)}")

    def new(path: str, declaration: Declaration, value: object) -> object:
        if path not in values:
            return value
        return CONVERTERS[declaration.role](values[path], unit=declaration.unit, where=path)

    for name in determined_names(model).intersection(map(str, values)):
        raise ParameterError(
            f"{name} is determined by other parameters of the model. Set those, or load the model with a value of it."
        )
    changed = with_determined(rebuilt(model, new))
    _check(changed, "", [*values, *others])
    return changed


def refuse_fixed(model: Node, names: Iterable[str]) -> None:
    """Raises `ParameterError` for a parameter on which the structure of a loaded model depends."""
    fixed = {join(path, own) for path, node in nodes_of(model) for own in getattr(type(node), "structural_names", ())}
    for name in fixed.intersection(names):
        raise ParameterError(
            f"{name} is fixed, because the structure of the model may depend on it. Give it a value by a modifier when "
            f'you load the model, as in load(text, "Model({name.rpartition(".")[2]} = ...)").'
        )


def _with_others(model: M, values: Mapping[str, object]) -> M:
    """A model with other parts, static fields and constructor arguments, by path."""
    nodes = dict(nodes_of(model))
    parts: dict[str, Node] = {}
    arguments: dict[str, dict[str, object]] = {}
    for path, value in values.items():
        above, _, name = path.rpartition(".")
        if path in nodes and path:
            if not isinstance(value, Node):
                raise ModelError(f"{path} is a {type(nodes[path]).__name__}: replace it by a component, got {value!r}.")
            parts[path] = value
        elif above in nodes and name in argument_names(type(nodes[above])):
            arguments.setdefault(above, {})[name] = value
        else:
            arguments_here = argument_names(type(nodes[above])) if above in nodes else ()
            known = [leaf.path for leaf in leaves_of(model)] + [join(above, other) for other in arguments_here]
            raise ModelError(f"The model has no parameter or start value {path!r}.{suggestion(path, known)}")
    made = {path: with_arguments(nodes[path], changes, path) for path, changes in arguments.items()}
    if "" in made:
        model, made = cast(M, made[""]), {path: node for path, node in made.items() if path}
    return with_nodes(model, {**made, **parts})


def _check(node: Node, path: str, names: Iterable[str], *, is_stacked: bool = False) -> None:
    """Raise `ParameterError` if a node that holds one of the named leaves violates a requirement.

    Parts come first, as in construction. The members of an array have stacked leaves, on which only the declared ranges
    are evaluated.
    """
    for name, declaration in dynamic_fields(type(node)):
        for at, part in parts_of(getattr(node, name), name) if declaration is None else ():
            if below := [other.removeprefix(f"{at}.") for other in names if other.startswith(f"{at}.")]:
                _check(part, join(path, at), below, is_stacked=is_stacked or isinstance(node, Array))
    for sentence in (out_of_range if is_stacked else broken)(node):
        raise ParameterError(join(path, sentence))
