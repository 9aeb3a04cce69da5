"""Unit check of a whole model, and of the events and requirements of one kind of components."""

import functools as ft
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .._declare.array import Array
from .._declare.component import At, Component, Event, Impact, Refuse, When
from .._declare.history import Remember
from .._errors import UnitError, complain
from .._reduce.class_equations import required
from .._reduce.flat_model import FlatModel, Instances, Kind
from .._reduce.flatten import children
from .._reduce.jaxpr import slice_output, structs
from .._reduce.traced import tracing
from .._tracing import is_traced
from .._units.dimension import TIME
from .interpret import Interpreter, Value
from .kind_units import kind_units, values_of_leaves
from .signal_units import signal_problems

CONDITION, INSTANT, SIGNAL = "a condition", "a time", "a signal"  # roles, which are no names of variables


class Item(NamedTuple):
    """An expression of an event: the name of the event, the variable that it sets or its role, and its value."""

    name: str
    role: str
    value: Any


def event_problems(kind: Kind, path: str) -> list[tuple[str, str]]:
    """Pairs of place and problem for a kind. `path` is that of one of its components, for errors of its methods."""
    found = list(_of_requirements(kind))
    if kind.cls.events is not Component.events:
        found += _of_events(kind, path)
    return found


@ft.cache
def _of_requirements(kind: Kind) -> tuple[tuple[str, str], ...]:
    """The contradictions in the requirements of a kind."""
    values, found = _values(kind), []
    rules = required(kind)
    for i, text in enumerate(rules.texts):
        closed, used = slice_output(rules.jaxpr, i)
        checked = Interpreter(any_constant=True)
        checked.interpret(closed, [values[rules.slots[place]] for place in used])
        found += [(f"requirement {text!r}", problem) for problem in dict.fromkeys(checked.problems)]
    return tuple(found)


@ft.lru_cache(maxsize=1024)
def _of_events(kind: Kind, path: str) -> tuple[tuple[str, str], ...]:
    """The contradictions in the events of a kind: within conditions, times and new values, and between new values and
    the variables that they set. Numbers fit any unit.
    """
    items: list[Item] = []

    def stated(*leaves: Any) -> list[jax.Array]:
        component = kind.component(leaves)
        with tracing(f"{path}.events" if path else f"{kind.cls.__name__}.events"):
            events = component.events()
        # Malformed events are refused when the model is built.
        events = events.items() if isinstance(events, dict) else ()
        checked = [(name, event) for name, event in events if isinstance(event, Event)]
        found = [item for name, event in checked if getattr(event, "check_units", True) for item in _items(name, event)]
        items[:] = [item._replace(value=None) for item in found if is_traced(item.value)]
        return [jnp.asarray(item.value) for item in found if is_traced(item.value)]

    closed = jax.make_jaxpr(stated)(*structs(kind.sizes[: kind.n_own]))
    values, found = _values(kind), []
    slots = {name.rstrip("[]"): slot for slot, name in enumerate(kind.names)}
    for i, (name, role, _) in enumerate(items):
        checked = Interpreter(any_constant=True)
        part, used = slice_output(closed, i)
        (value,) = checked.interpret(part, [values[slot] for slot in used])
        if role == INSTANT:
            checked.require(value, TIME, f"takes {value} as a time, which should be in s")
        elif role in slots:
            checked.sets(values[slots[role]], value)
        found += [(f"event {name}", problem) for problem in dict.fromkeys(checked.problems)]
    return tuple(dict.fromkeys(found))


def _items(name: str, event: Event) -> Sequence[Item]:
    """The expressions of an event."""
    match event:
        case When() | Refuse():
            own = [(CONDITION, event.condition)]
        case Impact():
            own = [(CONDITION, event.condition), (CONDITION, event.closed), (SIGNAL, event.speed + event.after)]
            own.append((SIGNAL, event.acceleration))
        case At():
            own = [(INSTANT, event.time), (INSTANT, event.every)]
        case Remember():
            own = [(INSTANT, event.delay), *((SIGNAL, value) for value in event.signals.values())]
        case _:
            own = []
    changes = {} if isinstance(event, Refuse | Remember) else event.changes
    return [Item(name, role, value) for role, value in (*own, *changes.items())]


def _values(kind: Kind) -> list[Value]:
    """The leaves of a kind as values, with the dimensions that their equations determine."""
    return values_of_leaves(kind, kind_units(kind).dimensions)


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
