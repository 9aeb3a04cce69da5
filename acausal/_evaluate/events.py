"""The events of a model as functions of its leaves: conditions, times, changes and recorded signals."""

import itertools
from collections.abc import Collection, Iterator, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.component import At, Event, Impact, Refuse, When
from .._declare.history import Remember, returns
from .._errors import ModelError
from .._jax_private import ClosedJaxpr, jaxpr_as_fun
from .._reduce.aliases import TIME, Merged
from .._reduce.equalities import are_equalities
from .._reduce.event_indicators import Expression, relations
from .._reduce.flat_model import FlatModel
from .._reduce.jaxpr import check_effects, slice_outputs, structs
from .._reduce.jaxpr_instants import Instants, Knowledge, instants
from .._reduce.stated import conditions_held
from .._reduce.traced import check_bounds, check_derivatives
from .event_set import EventEntry, EventSet, Function
from .stated_events import changes_of, entry_of, events_in, refused_intervals, states_events, where_of


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
