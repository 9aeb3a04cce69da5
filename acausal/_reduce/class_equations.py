"""The equations and the requirements of a component class, traced once and shared by all components of the class."""

import dataclasses
import functools as ft
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.annotations import indices
from .._declare.component import Component, Equation
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.node import Node
from .._declare.node_requirements import named, parameters_of, stated
from .._errors import ModelError
from .._jax_private import ClosedJaxpr, Literal, jaxpr_as_fun
from .._numbers import Numbers
from .._tracing import is_traced
from .flat_model import Kind
from .forms import ANY, NONNEGATIVE, NONZERO, POSITIVE
from .jaxpr import assembled, check_effects, slice_outputs, structs
from .scalarise import element_values, elements_of, objects
from .single_elements import with_single_elements
from .template import Input, Template, sliced
from .traced import Forbidden, Held, check_bounds, check_derivatives, tracing, with_truths

_SIGNS = {None: ANY, "positive": POSITIVE, "nonnegative": NONNEGATIVE, "nonzero": NONZERO}


def templates(kind: Kind, *, split: bool = False) -> tuple[Template, ...]:
    """The equations of a component kind, in the order of its class; with `split`, by element.

    Raises `ModelError` if `equations` does not return a dictionary of `eq(...)`, or has side effects.
    """
    return _split(kind) if split else _stated(kind, "equations")


@ft.cache
def _split(kind: Kind) -> tuple[Template, ...]:
    return tuple(part for template in _stated(kind, "equations") for part in _by_element(template))


def initial_templates(kind: Kind) -> tuple[Template, ...]:
    """The initial equations of a component kind; raises as `templates` does."""
    return _stated(kind, "initial_equations")


class _Traced(NamedTuple):
    """A traced method: its inputs, its equations, and whether to check the units of each."""

    inputs: list[Input]
    held: Held
    checks: dict[str, bool]


def shapes_held(kind: Kind) -> tuple[tuple[int, ...], ...]:
    """The shapes of the truths that `ifelse` holds in the equations of a kind."""
    return _traced(kind.own, "equations").held.shapes


def conditions_held(kind: Kind) -> ClosedJaxpr:
    """The conditions of `ifelse` in the equations of a kind, from all its slots.

    Raises `ModelError` if a condition reads a derivative.
    """
    inputs, held, _ = _traced(kind.own, "equations")
    read = slice_outputs(held.conditions, slice(0, len(held.shapes))).used
    for i in read:
        if i < len(inputs) and inputs[i].order:
            name = kind.names[inputs[i].slot]
            raise ModelError(
                f"{kind.cls.__name__}.equations: a condition of ifelse reads d.{name}. Declare a variable that equals "
                "it, and compare that one."
            )

    def conditions(*slots: Array) -> list[Array]:
        own, truths = slots[: kind.n_own], slots[kind.n_own :]
        rates = [jnp.zeros_like(own[item.slot]) for item in inputs if item.order]
        return list(jaxpr_as_fun(held.conditions)(*own, *rates, *truths))

    return jax.make_jaxpr(conditions)(*structs(kind.sizes))


@ft.cache
def _traced(kind: Kind, method: str) -> _Traced:
    where = f"{kind.cls.__name__}.{method}"
    roles = [declaration.role for declaration in kind.declarations]
    variables = [slot for slot, declaration in enumerate(kind.declarations) if declaration.is_variable]
    inputs: list[Input] = [
        Input(slot, 0, role if role in ("param", "discrete", "time") else "var") for slot, role in enumerate(roles)
    ]
    inputs += [Input(slot, 1, "var") for slot in variables]
    checks: dict[str, bool] = {}  # by name of the equation

    def residuals(*values: Array) -> tuple[Array, ...]:
        self = kind.component(values[: len(roles)])
        d_leaves: list[Any] = [_no_derivative(where, name) for name in kind.names]
        for slot, value in zip(variables, values[len(roles) :], strict=True):
            d_leaves[slot] = value
        d = kind.component(d_leaves)
        with tracing(where):
            stated = _checked(getattr(self, method)(d), where)
            if method == "equations":
                stated = stated | _checked(self.shared_equations(d), f"{kind.cls.__name__}.shared_equations")
        checks.update((name, equation.check_units) for name, equation in stated.items())
        return tuple(jnp.asarray(equation.residual, dtype=float) for equation in stated.values())

    closed = with_single_elements(jax.make_jaxpr(residuals)(*structs([kind.sizes[item.slot] for item in inputs])))
    check_effects(closed, where)
    check_bounds(closed, where)
    check_derivatives(closed, where)
    held = with_truths(closed, where) if method == "equations" else Held(closed, closed, ())
    return _Traced(inputs, held, checks)


@ft.cache
def _stated(kind: Kind, method: str) -> tuple[Template, ...]:
    inputs, held, checks = _traced(kind.own, method)
    inputs = inputs + [Input(kind.n_own + i, 0, "discrete") for i in range(len(held.shapes))]
    signs = []
    for item in inputs:
        sign = kind.declarations[item.slot].sign
        signs.append(_SIGNS[sign.name if sign else None])
    return tuple(
        dataclasses.replace(sliced(name, kind, held.equations, i, inputs, signs, 0), check_units=check)
        for i, (name, check) in enumerate(checks.items())
    )


def _no_derivative(where: str, name: str) -> Forbidden:
    return Forbidden(
        f"{where} uses d.{name}, but {name} is a parameter: only variables have time derivatives. "
        "Declare it with Var[...] if it changes in time."
    )


def _by_element(template: Template) -> list[Template]:
    """An equation between arrays as one equation for each element of its residual."""
    shapes = [aval.shape for aval in template.jaxpr.in_avals]
    if not any(shapes) and not template.shape:
        return [template]
    inputs: list[Input] = []
    for item, shape in zip(template.inputs, shapes, strict=True):
        inputs += [item._replace(element=i) for i in range(math.prod(shape))] if item.source == "var" else [item]

    def residuals(*values: Array) -> list[Array]:
        remaining, arrays = list(values), []
        for item, shape in zip(template.inputs, shapes, strict=True):
            if item.source == "var":
                arrays.append(objects([remaining.pop(0) for _ in range(math.prod(shape))], shape))
            else:
                arrays.append(elements_of(remaining.pop(0)))
        return [jnp.asarray(value, float) for value in np.ravel(element_values(template.jaxpr, arrays))]

    whole = dict(zip(template.inputs, shapes, strict=True))
    closed = jax.make_jaxpr(residuals)(*structs([() if i.source == "var" else whole[i] for i in inputs]))
    known = {(item.slot, item.order): sign for item, sign in zip(template.inputs, template.signs, strict=True)}
    signs = [known[item.slot, item.order] for item in inputs]
    is_modelica = template.owner is not None and any(one.counts_from_1 for one in template.owner.declarations)
    places = np.ndindex(*template.shape)
    names = [template.name + indices(place, counts_from_1=is_modelica) for place in places]
    return [sliced(name, template.owner, closed, i, inputs, signs, 0) for i, name in enumerate(names)]


def _checked(stated: Any, where: str) -> dict[str, Equation]:
    if not isinstance(stated, dict) or not all(isinstance(value, Equation) for value in stated.values()):
        raise ModelError(
            f"{where} must return a dictionary of named equations, such as "
            f"dict(ohm=eq(self.v, self.R * self.i)); got {type(stated).__name__}."
        )
    for name, equation in stated.items():
        if not isinstance(equation.check_units, bool):
            raise ModelError(
                f"{where}: {name} is stated with check_units={equation.check_units!r}; it must be True or False."
            )
    return stated


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
