"""Parts of models with other constructor arguments, and models with other parts."""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

import jax
import numpy as np

from .._errors import ModelError, ParameterError
from .._tracing import are_traced
from .arguments import argument_names, computes_fields, given_arguments
from .fields import copied, dynamic_fields, first_index, join
from .layout import rebuilt
from .node import Node, leaves_of

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
