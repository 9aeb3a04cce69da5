"""Unit check of the events and requirements of one kind of components."""

import functools as ft
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._declare.component import At, Component, Event, Impact, Refuse, When
from .._declare.history import Remember
from .._reduce.flat_model import Kind
from .._reduce.jaxpr import slice_output, structs
from .._reduce.stated import required
from .._reduce.traced import tracing
from .._tracing import is_traced
from .._units.dimension import TIME
from .interpret import Interpreter
from .kind_units import kind_units, values_of_leaves
from .values import Value

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

    def stated(*leaves: Any) -> list[Array]:
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
