"""The units of one kind of components: its equations and its energy account."""

import dataclasses
import functools as ft
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp

from .._declare.component import Component
from .._reduce.flatten import Kind
from .._reduce.jaxpr import structs
from .._reduce.template import Input, templates
from .dimension import DERIVED, TIME, Dimension, described
from .interpret import Interpreter
from .parsing import UnknownUnit, parsed
from .values import Value


@dataclasses.dataclass(frozen=True)
class KindUnits:
    """What is found once for all components of a kind.

    - `problems`: each as where it is and what it is, such as ("equation ohm", "equates ... with ...").
    - `dimensions`: of its leaves by slot, declared or, where no unit is declared, following from the equations.
    - `alike`: pairs of slots without a unit that have the same dimension.
    - `unchecked`: the equations that are stated with `check_units=False`.
    """

    problems: tuple[tuple[str, str], ...]
    dimensions: tuple[Dimension | None, ...]
    alike: frozenset[tuple[int, int]]
    unchecked: tuple[str, ...]


@ft.cache
def kind_units(kind: Kind) -> KindUnits:
    """Check the units of a kind of components."""
    values, problems = _leaves(kind)
    dimensions = [value.dimension for value in values]
    alike: set[tuple[int, int]] = set()
    inferred: dict[int, set[Dimension]] = {}
    unchecked = [template.name for template in templates(kind) if not template.check_units]
    for where, checked in _interpreted(kind, values):
        problems += [(where, problem) for problem in dict.fromkeys(checked.problems)]
        alike |= checked.alike
        for slot, found in checked.inferred.items():
            inferred.setdefault(slot, set()).update(found)
    for slot, found in inferred.items():
        dimensions[slot] = next(iter(found)) if len(found) == 1 else None
    return KindUnits(tuple(problems), tuple(dimensions), frozenset(alike), tuple(unchecked))


def _interpreted(kind: Kind, values: list[Value]) -> Iterator[tuple[str, Interpreter]]:
    for template in templates(kind):
        if template.check_units:
            checked = Interpreter()
            checked.residual(template.jaxpr, [_input(item, values) for item in template.inputs])
            yield f"equation {template.name}", checked
    if kind.cls.energy is not Component.energy:
        yield "energy", _account(kind, values)


def _leaves(kind: Kind) -> tuple[list[Value], list[tuple[str, str]]]:
    """The leaves of a kind as values, and the units that are not what they should be."""
    values, problems = [], []
    for slot, (name, declaration) in enumerate(zip(kind.names, kind.declarations, strict=True)):
        try:
            unit = parsed(declaration.unit) if declaration.unit else None
        except UnknownUnit as error:
            problems.append((f"declaration of {name}", str(error)))
            unit = None
        if unit is not None and not unit.is_si:
            problems.append((f"declaration of {name}", _not_si(declaration.unit, unit.dimension)))
        dimension = None if unit is None else unit.dimension
        leaf = slot if not declaration.unit else None
        values.append(Value(dimension, f"self.{name}", unit=declaration.unit or None, leaf=leaf))
    return values, problems


def _not_si(unit: str, dimension: Dimension) -> str:
    wanted = DERIVED.get(dimension, str(dimension))
    return f"the unit {unit!r} is not coherent with SI: declare {wanted!r} and give values by quantity(..., {unit!r})"


def _input(item: Input, values: list[Value]) -> Value:
    value = values[item.slot]
    if item.order == 0:
        return value
    rate = None if value.dimension is None else value.dimension / TIME
    return Value(rate, "d" + value.text.removeprefix("self"))


def _account(kind: Kind, values: list[Value]) -> Interpreter:
    """The energy account must be stated in J, W and W."""

    def account(*leaves: Any) -> list[Any]:
        return [jnp.asarray(item, float) for item in kind.component(leaves).energy() or ()]

    closed = jax.make_jaxpr(account)(*structs(kind.sizes))
    checked = Interpreter()
    watt = parsed("W").dimension
    for name, dimension, value in zip(
        ("stored", "dissipated", "supplied"), (watt * TIME, watt, watt), checked.run(closed, values), strict=False
    ):
        unit = described(dimension, "J" if name == "stored" else "W")
        checked.require(value, dimension, f"states {name} as {value}, which should be in {unit}")
    return checked
