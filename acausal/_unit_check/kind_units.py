"""Unit check of one kind of components: its equations and its energy account."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from .._declare.component import Component
from .._reduce.class_equations import conditions_held, initial_templates, templates
from .._reduce.flat_model import Kind
from .._reduce.jaxpr import slice_output, structs
from .._reduce.template import Input
from .._units.dimension import DERIVED, NUMBER, TIME, Dimension, described
from .._units.parsing import UnknownUnit, parsed
from .interpret import Interpreter, Value


@dataclasses.dataclass(frozen=True)
class KindUnits:
    """Results of the unit check of a kind of components.

    - `problems`: pairs of place and problem, such as ("equation ohm", "equates ... with ...").
    - `dimensions`: the dimension of each leaf by slot, declared or, without a declaration, inferred from the equations.
    - `alike`: pairs of variables without a unit that have the same dimension.
    - `unchecked`: the equations with `check_units=False`.
    """

    problems: tuple[tuple[str, str], ...]
    dimensions: tuple[Dimension | None, ...]
    alike: frozenset[tuple[int, int]]
    unchecked: tuple[str, ...]


@ft.cache
def kind_units(kind: Kind) -> KindUnits:
    """Check the units of a kind of components."""
    values, problems = _leaves(kind)
    found: dict[int, set[Dimension]] = {slot: set() for slot in range(len(values))}
    alike: set[tuple[int, int]] = set()
    for where, checked in _interpreted(kind, values):
        problems += [(where, problem) for problem in dict.fromkeys(checked.problems)]
        alike |= checked.alike
        for slot, dimensions in checked.inferred.items():
            found[slot] |= dimensions
    dimensions = [value.dimension for value in values]
    pairs: set[tuple[int, int]] = set()
    for group in _groups(len(values), alike):
        follow = set().union(*(found[slot] for slot in group))
        for slot in group if len(follow) == 1 else ():
            dimensions[slot] = next(iter(follow))
        pairs |= set(itertools.pairwise(slot for slot in group if kind.declarations[slot].role != "param"))
    stated = (*templates(kind), *initial_templates(kind))
    unchecked = tuple(template.name for template in stated if not template.check_units)
    return KindUnits(tuple(problems), tuple(dimensions), frozenset(pairs), unchecked)


def _groups(count: int, pairs: set[tuple[int, int]]) -> list[list[int]]:
    """The slots of equal dimension, one list for each dimension."""
    group = {slot: [slot] for slot in range(count)}
    for a, b in pairs:
        if group[a] is not group[b]:
            group[a] += group[b]
            group |= dict.fromkeys(group[b], group[a])
    return list({id(members): sorted(members) for members in group.values()}.values())


def _interpreted(kind: Kind, values: list[Value]) -> Iterator[tuple[str, Interpreter]]:
    named = [(f"equation {template.name}", template) for template in templates(kind)]
    named += [(f"initial equation {template.name}", template) for template in initial_templates(kind)]
    for where, template in named:
        if template.check_units:
            checked = Interpreter()
            checked.residual(template.jaxpr, [_input(item, values) for item in template.inputs])
            yield where, checked
    yield from _conditions(kind, values)
    if kind.cls.energy is not Component.energy:
        yield "energy", _account(kind, values)


def _conditions(kind: Kind, values: list[Value]) -> Iterator[tuple[str, Interpreter]]:
    """The conditions of `ifelse` in the equations to check."""
    read = {item.slot - kind.n_own: t.name for t in templates(kind) if t.check_units for item in t.inputs}
    for i, name in sorted(read.items()):
        if i >= 0:
            condition, used = slice_output(conditions_held(kind), i)
            checked = Interpreter()
            checked.interpret(condition, [values[slot] for slot in used])
            yield f"equation {name}", checked


def values_of_leaves(kind: Kind, dimensions: Sequence[Dimension | None]) -> list[Value]:
    """The leaves of a kind as values of known dimensions."""
    return [
        dataclasses.replace(value, dimension=dimension, leaf=None if dimension is not None else value.leaf)
        for value, dimension in zip(_leaves(kind)[0], dimensions, strict=True)
    ]


def _leaves(kind: Kind) -> tuple[list[Value], list[tuple[str, str]]]:
    """The leaves of a kind as values, and the problems of their declared units."""
    values, problems = [], []
    for slot, (name, declaration) in enumerate(zip(kind.names, kind.declarations, strict=True)):
        try:
            unit = parsed(declaration.unit) if declaration.unit else None
        except UnknownUnit as error:
            problems.append((f"declaration of {name}", str(error)))
            unit = None
        if unit is not None and not unit.is_si:
            problems.append((f"declaration of {name}", _not_si(declaration.unit, unit.dimension, unit.has_angle)))
        dimension = None if unit is None else unit.dimension
        leaf = slot if not declaration.unit else None
        values.append(Value(dimension, f"self.{name}", unit=declaration.unit or None, leaf=leaf))
    return values, problems


_ANGULAR = {NUMBER: "rad", TIME**-1: "rad/s", TIME**-2: "rad/s2"}


def _not_si(unit: str, dimension: Dimension, has_angle: bool) -> str:
    wanted = _ANGULAR[dimension] if has_angle and dimension in _ANGULAR else DERIVED.get(dimension, str(dimension))
    return f"the unit {unit!r} is not coherent with SI: declare {wanted!r} and give values by quantity(..., {unit!r})"


def _input(item: Input, values: list[Value]) -> Value:
    value = values[item.slot]
    if item.order == 0:
        return value
    rate = None if value.dimension is None else value.dimension / TIME
    return Value(rate, "d" + value.text.removeprefix("self"))


def _account(kind: Kind, values: list[Value]) -> Interpreter:
    """Check that the energy account is in J, W and W."""

    def account(*leaves: Any) -> list[Array]:
        component = kind.component(leaves)
        own = component.energy()
        return [] if own is None else [jnp.asarray(item, float) for item in component.shared_energy(own)]

    closed = jax.make_jaxpr(account)(*structs(kind.sizes))
    checked = Interpreter()
    watt = parsed("W").dimension
    for name, dimension, value in zip(
        ("stored", "dissipated", "supplied"), (watt * TIME, watt, watt), checked.interpret(closed, values), strict=False
    ):
        unit = described(dimension, "J" if name == "stored" else "W")
        checked.require(value, dimension, f"states {name} as {value}, which should be in {unit}")
    return checked
