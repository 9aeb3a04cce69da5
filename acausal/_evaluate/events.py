"""The events that components state, with their checks, as functions of the leaves of a model."""

import itertools
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.array import Array
from .._declare.component import At, Component, Event, Follow, Impact, Refuse, Sampling, Started, When, Yields
from .._declare.history import ROW, Remember, returns
from .._declare.node import Node
from .._errors import ModelError, suggestion
from .._jax_private import ClosedJaxpr, jaxpr_as_fun
from .._numbers import Numbers
from .._reduce.aliases import TIME, Merged
from .._reduce.class_equations import conditions_held
from .._reduce.equalities import are_equalities
from .._reduce.event_indicators import Expression, relations
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import children
from .._reduce.jaxpr import check_effects, slice_outputs, structs
from .._reduce.jaxpr_instants import Instants, Knowledge, instants
from .._reduce.traced import check_bounds, check_derivatives, tracing
from .._tracing import is_traced
from .event_set import EventEntry, EventKind, EventSet, Function

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


def events_of(flat: FlatModel, time_leaves: Collection[int]) -> EventSet | None:
    """The events of a model, some of whose leaves are the time; None if it has none.

    Raises `ModelError` for an event that changes an unknown name or a parameter, or has side effects.
    """
    structure = flat.structure
    if len(flat.leaves) == structure.num_leaves and not states_events(structure.unflatten(range(structure.num_leaves))):
        return None
    entries: list[EventEntry] = []

    def stated(*leaves: jax.Array) -> tuple[list[jax.Array], ...]:
        found = list(events_in(flat.structure.unflatten(leaves[: flat.structure.num_leaves]), "", 0))
        found += list(refused_intervals(flat, leaves, found))
        entries[:] = [entry_of(flat, *item) for item in found]
        held = list(_held(flat, leaves))
        entries.extend(entry for entry, _ in held)
        events = [event for _, _, _, event in found]
        conditions = [jnp.asarray(event.condition) for event in events if isinstance(event, When | Refuse | Impact)]
        conditions += [condition for _, condition in held]
        pairs = list(zip(entries, events, strict=False))
        times = [item for entry, event in pairs for item in _times(event, entry, leaves)]
        values = [jnp.asarray(value, float) for event in events for value in changes_of(event).values()]
        values += [jnp.where(leaves[entry.targets[0]] > 0.5, 0.0, 1.0) for entry, _ in held]  # the opposite truth
        records = [event for event in events if isinstance(event, Remember)]
        signals = [jnp.asarray(value, float) for event in records for value in event.signals.values()]
        delays = [jnp.asarray(event.delay, float) for event in records]
        impacts = [event for event in events if isinstance(event, Impact)]
        contacts = [jnp.asarray(x, float) for event in impacts for x in (event.closed, event.speed, event.after)]
        rates = [jnp.asarray(event.acceleration, float) for event in impacts]
        return conditions, times, values, contacts, rates, signals, delays

    shapes = [leaf.stack + leaf.sizes for leaf in flat.leaves]
    closed, structure = jax.make_jaxpr(stated, return_shape=True)(*structs(shapes))
    check_effects(closed, "A method `events`")
    check_bounds(closed, "A method `events`")
    check_derivatives(closed, "A method `events`")
    if not entries:
        return None
    ends = np.cumsum([len(part) for part in structure]).tolist()
    n, m = ends[:2]
    _check_equalities(flat, closed, [entry for entry in entries if entry.has_condition])
    truths = jax.make_jaxpr(lambda *leaves: _truths(closed, leaves, n))(*structs(shapes))
    logic: list[np.ndarray] = []
    of_equals: list[int] = []
    # Without the changes, whose relations do not trigger events.
    conditions, used = slice_outputs(closed, slice(0, n))

    def real(*leaves: jax.Array) -> list[jax.Array]:
        found, logic[:] = relations(conditions, [leaves[i] for i in used])
        of_equals[:] = found.of_equals
        return [jnp.asarray(x, float) for x in (*found.indicators, *found.sizes)]

    both = jax.make_jaxpr(real)(*structs(shapes))
    half = len(both.out_avals) // 2
    found, read = _instants(flat, truths, time_leaves)
    actions, contacts, rates, signals, delays = (
        _function(closed, first, end) for first, end in itertools.pairwise(ends[1:])
    )
    return EventSet(
        tuple(entries),
        _function(both, 0, half),
        _function(both, half, 2 * half),
        np.array(of_equals, int),
        _in_order(entries, logic),
        _function(closed, n, m),
        actions,
        contacts,
        rates,
        signals,
        delays,
        found,
        read,
    )


def _check_equalities(flat: FlatModel, closed: ClosedJaxpr, entries: Sequence[EventEntry]) -> None:
    """Raise `ModelError` for a condition that tests varying real numbers for equality."""
    moving = [leaf.declaration.role not in ("param", "discrete") for leaf in flat.leaves]
    for entry, is_equality in zip(entries, are_equalities(closed, moving), strict=False):
        if is_equality:
            raise ModelError(
                f"{where_of(entry.path, entry.name)} tests real numbers for equality (== or !=), which a run cannot "
                "locate. Remedy: an inequality, which becomes true when the "
                "numbers cross, such as self.x > 0.5; for a time, at(...)."
            )


def _held(flat: FlatModel, leaves: Sequence[jax.Array]) -> Iterator[tuple[EventEntry, jax.Array]]:
    """The conditions of `ifelse` in equations, with the truths that they change."""
    for instances in flat.instances:
        kind = instances.kind
        n_truths = len(kind.sizes) - kind.n_own
        if not n_truths:
            continue
        function = jaxpr_as_fun(conditions_held(kind))
        for entry, (path, stack) in enumerate(zip(instances.paths, instances.stacks, strict=True)):
            slots = [leaves[instances.leaf(entry, slot)] for slot in range(len(kind.sizes))]
            batched = function
            for _ in stack:
                batched = jax.vmap(batched)
            for i, condition in enumerate(batched(*slots)):
                leaf = instances.leaf(entry, kind.n_own + i)
                yield EventEntry(path, f"_held{i}", "hold", condition.shape, (leaf,)), condition


def _in_order(entries: Sequence[EventEntry], logic: Sequence[np.ndarray]) -> tuple[Expression | None, ...]:
    remaining = iter(logic)
    parts = [next(remaining).ravel().tolist() if e.has_condition else [None] * e.count for e in entries]
    return tuple(expression for part in parts for expression in part)


def _times(event: Event, entry: EventEntry, leaves: Sequence[jax.Array]) -> tuple[jax.Array, ...]:
    """The times of a scheduled event and their period; nothing for other events."""
    match event:
        case At():
            return jnp.asarray(event.time, float), jnp.asarray(jnp.inf if event.every is None else event.every, float)
        case Remember():
            assert entry.history is not None
            return returns(leaves[entry.history], jnp.asarray(event.delay)[..., None])[0], jnp.asarray(jnp.inf)
    return ()


def _truths(closed: ClosedJaxpr, leaves: Sequence[jax.Array], n: int) -> list[jax.Array]:
    found = jaxpr_as_fun(closed)(*leaves)[:n]
    return [value if value.dtype == bool else value > 0.0 for value in found]


def _function(closed: ClosedJaxpr, start: int, stop: int) -> Function:
    """Some outputs of a jaxpr as a function."""
    return Function(*slice_outputs(closed, slice(start, stop)))


def _instants(
    flat: FlatModel, closed: ClosedJaxpr, time_leaves: Collection[int]
) -> tuple[Instants | None, tuple[int, ...]]:
    """The instants at which conditions on time alone change, and the leaves that determine them."""

    def knowledge(index: int) -> Knowledge:
        if index in time_leaves:
            return "time"
        return "known" if flat.leaves[index].declaration.role in ("param", "discrete") else "unknown"

    inputs: list[Knowledge] = [knowledge(index) for index in range(len(flat.leaves))]
    found = instants(closed, inputs, [leaf.stack + leaf.sizes for leaf in flat.leaves])
    return found, tuple(i for i, item in enumerate(inputs) if item == "known") if found else ()


def time_leaves(flat: FlatModel, merged: Merged) -> frozenset[int]:
    """The leaves that represent the time."""
    is_time = (merged.representative == TIME) & (merged.sign == 1)
    others = set(flat.leaf_of_node[~is_time].tolist())
    return frozenset(set(flat.leaf_of_node[is_time].tolist()) - others)
