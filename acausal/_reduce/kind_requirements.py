"""The requirements of a component class on its parameters, traced once and shared by every component of that class."""

import dataclasses
import functools as ft
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.component import Component
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.node import Node
from .._declare.node_requirements import named, parameters_of, stated
from .._errors import ModelError
from .._jax_private import ClosedJaxpr, Literal, jaxpr_as_fun
from .._numbers import Numbers
from .._tracing import is_traced
from .jaxpr import assembled, structs
from .traced import Forbidden

if TYPE_CHECKING:
    from .flat_model import Kind


def own_records(node: Node, path: str = "") -> Iterator[tuple[str, Node]]:
    """A node and its parts other than components, each with its path."""
    yield path, node
    for name, declaration in dynamic_fields(type(node)):
        for part_path, part in parts_of(getattr(node, name), join(path, name)) if declaration is None else ():
            if isinstance(part, Node) and not isinstance(part, Component):
                yield from own_records(part, part_path)


def is_held_to(node: Node) -> bool:
    """Whether a node has requirements on its parameters."""
    cls: Any = type(node)
    return bool(parameters_of(cls)) or cls._states_requirements()


@dataclasses.dataclass(frozen=True, eq=False)
class Required:
    """The requirements of a component kind: a call with the values of `slots` returns the truth of each of `texts`."""

    texts: tuple[str, ...]
    slots: tuple[int, ...]
    jaxpr: ClosedJaxpr
    quoted: tuple[tuple[int, ...], ...]  # the slots of the parameters in each text
    never: tuple[str, ...]  # texts that are false for all values

    def __call__(self, *values: Numbers) -> list[Array]:
        return jaxpr_as_fun(self.jaxpr)(*values)


@ft.cache
def required(kind: "Kind") -> Required:
    """The requirements on the parameters of a component kind.

    Raises `ModelError` for requirements that read variables or cannot be traced.
    """
    params = [slot for slot, declaration in enumerate(kind.declarations) if declaration.role == "param"]
    texts: list[str] = []
    never: list[str] = []
    read: list[tuple[int, ...]] = []

    def holds(*values: Array) -> list[Array]:
        leaves: list[Any] = [_no_parameter(kind.cls.__name__, name) for name in kind.names]
        for slot, value in zip(params, values, strict=True):
            leaves[slot] = value
        results = []
        for path, part in own_records(kind.component(leaves)):
            for requirement in stated(part):
                text = join(path, requirement.text)
                if not is_traced(requirement.holds) and not np.all(requirement.holds):
                    never.append(text)
                texts.append(text)
                paths = {join(path, name) for name in named(requirement.text, _Any())}
                read.append(tuple(slot for slot in params if kind.names[slot] in paths))
                results.append(jnp.all(jnp.asarray(requirement.holds)))
        return results

    try:
        closed = jax.make_jaxpr(holds)(*structs([kind.sizes[slot] for slot in params]))
    except (TypeError, ValueError, IndexError, AttributeError) as error:
        raise ModelError(f"{kind.cls.__name__}.requirements: {error}") from error
    jaxpr = closed.jaxpr
    atoms = [atom for eqn in jaxpr.eqns for atom in eqn.invars] + list(jaxpr.outvars)
    used = {atom for atom in atoms if not isinstance(atom, Literal)}
    kept = [i for i, var in enumerate(jaxpr.invars) if var in used]
    slim = assembled([jaxpr.invars[i] for i in kept], jaxpr.outvars, jaxpr.eqns, jaxpr.constvars)
    slots = tuple(params[i] for i in kept)
    return Required(tuple(texts), slots, ClosedJaxpr(slim, closed.consts), tuple(read), tuple(never))


class _Any:
    """Contains everything."""

    def __contains__(self, item: object) -> bool:
        return True


def _no_parameter(owner: str, name: str) -> Forbidden:
    return Forbidden(
        f"{owner}.requirements uses {name}, which is not a parameter: requirements concern parameters only. "
        "Use refuse(...) in events for variables."
    )
