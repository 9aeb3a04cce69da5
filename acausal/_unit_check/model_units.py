"""Unit check of a whole model."""

from collections.abc import Iterator, Sequence
from typing import Any

import jax

from .._declare.array import Array
from .._declare.component import Component
from .._errors import UnitError, complain
from .._reduce.flat_model import FlatModel, Instances, Kind
from .._reduce.flatten import children
from .event_units import event_problems
from .kind_units import kind_units
from .signal_units import signal_problems

_REMEDY = (
    "Remedy: correct the equation or the declared unit, and turn a constant with a unit into a parameter. A leaf with "
    "the unit '' fits any; eq(..., check_units=False) disables the check of an equation."
)


_OF_SIGNALS = "Remedy: connect signals of the same quantity, or convert between them with a gain, which fits any units."


def unit_problems(flat: FlatModel) -> list[str]:
    """All contradictions between the declared units and the equations, energy accounts and connections of a model."""
    places = [(_instances(instances), instances.kind) for instances in flat.instances]
    others = {starters.kind: _instances(starters) for starters in flat.starters}
    others |= {kind: path for path, kind in composites(flat, ("energy", "events"))}
    known = {kind.own for _, kind in places}
    places += [(path, kind) for kind, path in others.items() if kind.own not in known]
    found = [
        f"{_named(kind, place)}, {where}: {problem}" + ("" if problem.endswith("?") else ".")
        for place, kind in places
        for where, problem in (*kind_units(kind).problems, *event_problems(kind, place))
    ]
    return found + signal_problems(flat)


def check_units(flat: FlatModel) -> None:
    """Raise `UnitError` with all unit problems of a model."""
    found = unit_problems(flat)
    if found:
        remedy = _OF_SIGNALS if found == signal_problems(flat) else _REMEDY
        complain(UnitError("\n  ".join(["The units of the model do not agree.", *found, remedy])))


def unchecked_equations(flat: FlatModel) -> list[str]:
    """The equations with `check_units=False`, by path; those of an array of components once."""
    return [
        f"{path}.{name}" if path else name
        for instances in flat.instances
        for path in instances.paths
        for name in kind_units(instances.kind).unchecked
    ]


def _instances(instances: Instances) -> str:
    others = instances.total - 1
    return f"{instances.name(0)} and {others} more" if others else instances.name(0)


def _named(kind: Kind, place: str) -> str:
    return f"{kind.cls.__name__} ({place})" if place else kind.cls.__name__


def composites(flat: FlatModel, methods: Sequence[str]) -> Iterator[tuple[str, Kind]]:
    """The path of each component that states one of the methods but no equations, and its kind; those of an array of
    components once.
    """
    view = flat.structure.unflatten(range(flat.structure.num_leaves))
    yield from _below(flat, view, "", 0, methods)


def _below(flat: FlatModel, node: Any, path: str, depth: int, methods: Sequence[str]) -> Iterator[tuple[str, Kind]]:
    if not isinstance(node, Component):
        return
    cls = type(node)
    states = any(getattr(cls, name) is not getattr(Component, name) for name in methods)
    if states and cls.equations is Component.equations:
        yield path, _kind(flat, node, path, depth)
    for part_path, part in children(node, path):
        yield from _below(flat, part, part_path, depth + isinstance(node, Array), methods)


def _kind(flat: FlatModel, node: Component, path: str, depth: int) -> Kind:
    own = [flat.leaves[index] for index in jax.tree_util.tree_leaves(node)]
    return Kind(
        jax.tree_util.tree_structure(node),
        tuple(leaf.stack[depth:] + leaf.sizes for leaf in own),
        type(node),
        tuple(leaf.declaration for leaf in own),
        tuple(leaf.path.removeprefix(f"{path}.") for leaf in own),
        depth if any(len(leaf.stack) > depth for leaf in own) else 0,
    )
