"""The events that components state in their methods `events`, with their checks."""

from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.array import Array
from .._declare.component import At, Component, Event, Follow, Impact, Refuse, Sampling, Started, When, Yields
from .._declare.history import ROW, Remember
from .._declare.node import Node
from .._errors import ModelError, suggestion
from .._numbers import Numbers
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import children
from .._reduce.traced import tracing
from .._tracing import is_traced
from .event_set import EventEntry, EventKind

NOT_POSITIVE = "the interval between repetitions must be positive. Remedy: correct the parameters that determine it."
NO_DELAY = "the delay of a recorded signal must be positive. Remedy: correct the parameters that determine it."
_STATIC = ("reason", "force", "check_units")  # fields of events that are no numbers
_KINDS: dict[type, EventKind] = {
    When: "when",
    At: "at",
    Sampling: "sample",
    Refuse: "refuse",
    Impact: "impact",
    Yields: "yields",
    Follow: "follow",
    Started: "started",
    Remember: "remember",
}


def states_events(view: Node) -> bool:
    """Whether the class of a component or of one of its parts states events."""
    if isinstance(view, Component) and type(view).events is not Component.events:
        return True
    return any(states_events(part) for _, part in children(view, "") if isinstance(part, Component))


def events_in(view: Node, path: str, depth: int) -> Iterator[tuple[str, str, int, Event]]:
    """The events of a component and its parts, member by member for an array of components. `depth` is the number of
    enclosing arrays.
    """
    if isinstance(view, Component) and type(view).events is not Component.events:
        with tracing(f"{path}.events" if path else f"{type(view).__name__}.events"):
            stated = view.events()
        if not isinstance(stated, dict) or not all(isinstance(event, Event) for event in stated.values()):
            raise ModelError(
                f"{type(view).__name__}.events must return a dictionary of events, such as "
                "dict(impact=when(self.h < 0.0, v=-self.e * self.v))."
            )
        yield from ((path, name, depth, event) for name, event in stated.items())
    for part_path, part in children(view, path):
        if isinstance(part, Component) and isinstance(view, Array):
            yield from _stacked(part, part_path, depth)
        elif isinstance(part, Component):
            yield from events_in(part, part_path, depth)


def _stacked(item: Component, path: str, depth: int) -> Iterator[tuple[str, str, int, Event]]:
    names: list[tuple[str, str, int, Event]] = []

    def members(part: Component) -> list[list[Any]]:
        found = list(events_in(part, path, depth + 1))
        names[:] = found
        return [[value for name, value in event._asdict().items() if name not in _STATIC] for *_, event in found]

    events = jax.vmap(members)(item)
    for (where, name, below, event), fields in zip(names, events, strict=True):
        numbers = [field for field in event._fields if field not in _STATIC]
        yield where, name, below, event._replace(**dict(zip(numbers, fields, strict=True)))


def entry_of(flat: FlatModel, path: str, name: str, depth: int, event: Event) -> EventEntry:
    """The entry of an event. Raises `ModelError` if it changes what events cannot change, or has no shape."""
    where = where_of(path, name)
    stack = _stack(event, where, depth)
    # The path of an array ends in brackets if its elements are variables of their own.
    places = {leaf.path.rstrip("[]"): index for index, leaf in enumerate(flat.leaves)}
    targets, history = [], None
    if isinstance(event, Remember):
        name_of_history = _signal(event, where)[0]
        history = _history(flat, event, f"{path}.{name_of_history}" if path else name_of_history, places, where)
    for target in changes_of(event):
        full = f"{path}.{target}" if path else target
        if full not in places:
            raise ModelError(f"{where} changes {target}, which does not exist.{suggestion(full, places)}")
        role = flat.leaves[places[full]].declaration.role
        if role in ("param", "time"):
            raise ModelError(
                f"{where} changes {target}, a {role}. Declare what events change with Discrete[...] or Var[...]."
            )
        if role != "discrete" and isinstance(event, Follow | Started | Yields):
            raise ModelError(f"{where} changes {target}, a {role}. Declare it with Discrete[...].")
        targets.append(places[full])
    force = _force(flat, event, path, places, where) if isinstance(event, Impact) else None
    reason = event.reason if isinstance(event, Refuse) else ""
    repeats = isinstance(event, At) and event.every is not None
    return EventEntry(path, name, _KINDS[type(event)], stack, tuple(targets), reason, repeats, history, force)


def changes_of(event: Event) -> dict[str, Numbers]:
    """The new values of the variables that an event changes, by name."""
    return {} if isinstance(event, Refuse | Remember) else event.changes


def where_of(path: str, name: str) -> str:
    """The place of an event in messages."""
    return f"{path}.events: {name}" if path else f"events: {name}"


def refused_intervals(
    flat: FlatModel, leaves: Sequence[jax.Array], events: Sequence[tuple[str, str, int, Event]]
) -> Iterator[tuple[str, str, int, Refuse]]:
    """Refusals of intervals and delays that are not positive, except parameters that are declared `positive`."""
    signs = [leaf.declaration.sign for leaf in flat.leaves]
    declared = {id(value) for value, sign in zip(leaves, signs, strict=True) if sign and sign.name == "positive"}
    for path, name, depth, event in events:
        match event:
            case At():
                label, interval, reason = f"{name}.every", event.every, NOT_POSITIVE
            case Remember():
                label, interval, reason = f"{name}.delay", event.delay, NO_DELAY
            case _:
                continue
        if is_traced(interval) and id(interval) not in declared:
            is_bad = jnp.broadcast_to(~(jnp.asarray(interval, float) > 0.0), _stack(event, label, depth))
            yield path, label, depth, Refuse(is_bad, reason)


def _stack(event: Event, where: str, depth: int) -> tuple[int, ...]:
    """The shape of the `depth` arrays that contain an event."""
    match event:
        case At():
            return _checked_times(event, where)[:depth]
        case When() | Refuse() | Impact():
            return _checked_condition(event, where, depth)
    if isinstance(event, Remember):
        return np.shape(_signal(event, where)[1])[:depth]
    if not event.changes:
        raise ModelError(f"{where} changes nothing. State the variables that it changes, by name.")
    return np.shape(next(iter(event.changes.values())))[:depth]


def _checked_times(event: At, where: str) -> tuple[int, ...]:
    """The shape of the times of an event. Raises `ModelError` if there is none, or if `every` is not positive."""
    shape = jnp.shape(jnp.asarray(event.time, float))
    if 0 in shape:
        raise ModelError(f"{where} has no time: at(...) needs one time in s, or an array of at least one.")
    if event.every is not None and not is_traced(event.every) and not np.all(np.asarray(event.every) > 0.0):
        raise ModelError(f"{where} repeats every {event.every} s: `every` must be positive, or None for an event once.")
    return shape


def _checked_condition(event: When | Refuse | Impact, where: str, depth: int) -> tuple[int, ...]:
    """The shape of a condition in `depth` arrays. Raises `ModelError` if it cannot change."""
    condition = event.condition
    if not is_traced(condition):
        raise ModelError(
            f"{where} has a {type(condition).__name__} as its condition, which is not a function of the component's "
            "variables: state a relation between them, such as self.x > 0.5, or at(...) for a known time."
        )
    shape = np.shape(condition)
    if len(shape) != depth:
        raise ModelError(f"{where} has a condition of shape {shape[depth:]}: it must be one truth value.")
    return shape


def _force(flat: FlatModel, event: Impact, path: str, places: dict[str, int], where: str) -> int:
    """The leaf of the contact force of an `impact`."""
    full = f"{path}.{event.force}" if path else event.force
    if full not in places or flat.leaves[places[full]].declaration.role != "discrete":
        raise ModelError(
            f"{where} has the force {event.force}, which is not a discrete variable of the component. Declare it with "
            'Discrete[Scalar, "N"] = 0.0, and add it to the contact force in the equations.'
        )
    return places[full]


def _signal(event: Remember, where: str) -> tuple[str, Numbers]:
    """The name of the history of a `remember`, and the signal."""
    if len(event.signals) != 1:
        raise ModelError(f"{where} records {len(event.signals)} signals. State one remember(...) for each signal.")
    ((name, value),) = event.signals.items()
    return name, value


def _history(flat: FlatModel, event: Remember, full: str, places: dict[str, int], where: str) -> int:
    """The leaf of the history of a `remember`."""
    leaf = flat.leaves[places[full]] if full in places else None
    if leaf is None or leaf.declaration.role != "discrete" or len(leaf.sizes) != 2 or leaf.sizes[1] != ROW:
        raise ModelError(
            f"{where} records into {full}, which is not a history. Declare it as "
            'Discrete[Vector, "", shape("n", ROW)] = -jnp.inf, with the number n of rows.'
        )
    return places[full]
