"""The events of a model: samples, ticks of clocks, resets, assertions, and the variables that `pre` follows."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.component import At, Events, Follow, Refuse, Sampling, Started, When, at, refuse, when
from ..._declare.history import Remember, remember
from ..._errors import ModelError
from ..._tracing import is_traced
from .._syntax import expressions as e
from .._syntax.visits import mapped
from .evaluate import evaluate
from .leaves import ModelLeaf
from .new_variables import Delay
from .scope import NotKnown, Scope
from .slots import Slots
from .translation import INITIAL, Translation
from .tree import attribute_path
from .values import Value, is_known, number
from .whens import Assertion

Event = At | When | Started | Follow | Refuse | Remember


@dataclasses.dataclass(frozen=True)
class _StatedEvent:
    """An event: its name, terms with the paths of the leaves of their slots, and the event for the model and their
    values; None if it cannot happen.
    """

    name: str
    terms: list[Any]
    paths: list[str]
    event: Callable[[Any, list[Value]], Event | None]


class ModelEvents:
    """Collects the events of a model."""

    def __init__(self, model: Translation, delays: Sequence[Delay]) -> None:
        self._model = model
        self._found: list[_StatedEvent] = []
        lowered = model.lowered
        for sample in lowered.samples:
            event = ft.partial(_sample_event, attribute_path(sample.ticks))
            self._add(f"_{sample.ticks}", [self._before(sample.start), self._before(sample.interval)], event)
        for tick in model.clocked.ticks:
            terms = [*(() if tick.of is None else (tick.of,)), *tick.changes.values()]
            names = tuple(map(model.path, tick.changes))
            self._add(f"_{tick.kind}_{len(self._found)}", terms, ft.partial(_tick_event, tick.kind, names))
        for reset in lowered.resets:
            event = ft.partial(_reset_event, model.path(reset.state))
            self._add(f"reinit_{len(self._found)}", [e.Ref(reset.active), reset.value], event)
        for demand in lowered.demands:
            self._demand(demand)
        for delay in delays:
            self._add(delay.past, [delay.signal, delay.delay], ft.partial(_delay_event, model.path(delay.past)))

    def _add(self, name: str, terms: Sequence[Any], event: Callable[[Any, list[Value]], Event | None]) -> None:
        slots = Slots()
        made = [self._model.resolver.term(term, slots) for term in terms]
        self._found.append(_StatedEvent(name, made, [attribute_path(leaf.path) for leaf in slots.leaves], event))

    def _demand(self, demand: Assertion) -> None:
        try:
            truth = self._model.known.value(demand.condition)
        except (NotKnown, ModelError):  # an error occurs again where the value is needed
            truth = None
        if truth is not None and np.all(truth):
            return
        message = self._message(demand.message)
        if truth is not None and demand.active is None:
            raise ModelError(f"{demand.name}: {message}")
        active = e.Ref(demand.active) if demand.active else e.Const(True)
        count = sum(item.name.partition(" #")[0] == demand.name for item in self._found)
        name = f"{demand.name} #{count + 1}" if count else demand.name
        self._add(name, [active, demand.condition], ft.partial(_assert_event, message))

    def _before(self, x: Any) -> Any:
        """An expression of the values before the instant of the variables in it."""
        if isinstance(x, e.Ref):
            leaf = self._model.leaves.get(x.name)
            return e.Builtin("Pre", (x,)) if leaf is not None and leaf.role == "var" and leaf.is_discrete else x
        return mapped(x, self._before)

    def _message(self, x: Any) -> str:
        """A message, with dots in place of what is not known before a run."""
        try:
            return str(self._model.known.value(x))
        except NotKnown:
            return self._message(x.left) + self._message(x.right) if isinstance(x, e.Binary) else "..."

    def __bool__(self) -> bool:
        return bool(self._found or self._model.previous.of)

    def method(self) -> Callable[[Any], Events]:
        """The method `events` of the component."""
        library, found = self._model.known.library, self._found
        previous = {attribute_path(name): leaf for name, leaf in self._model.previous.of.items()}

        def events(self: Any) -> Events:
            made: dict[str, Any] = {}
            for item in found:
                at_slots = Scope(library, [value_at(self, path) for path in item.paths], in_condition=True)
                event = item.event(self, [evaluate(term, at_slots) for term in item.terms])
                if event is not None:
                    made[item.name] = event
            follow = {
                attribute_path(leaf.path): _followed(value_at(self, path), leaf) for path, leaf in previous.items()
            }
            # While the initial equations hold, `pre` keeps its start value.
            holds = jnp.asarray(value_at(self, INITIAL)) > 0.5
            if follow:
                made["_follow"] = Follow(
                    {path: jnp.where(holds, value_at(self, path), value) for path, value in follow.items()}
                )
            made["_started"] = Started({INITIAL: 0.0, **follow})
            # Without a check of units, because literals have none in Modelica.
            return {name: event._replace(check_units=False) for name, event in made.items()}

        return events


def value_at(node: Any, path: str) -> Any:
    """The leaf at a path."""
    for part in path.split("."):
        name, *indices = part.replace("]", "").split("[")
        node = getattr(node, name)
        for index in indices:
            node = node[int(index)]
    return node


def _sample_event(ticks: str, model: Any, values: list[Value]) -> Event:
    start, interval = values
    return Sampling(start, interval, {ticks: value_at(model, ticks) + 1.0})


def _tick_event(kind: str, names: Sequence[str], model: Any, values: list[Value]) -> Event:
    """The event at the ticks of clocks: the values are the time or condition, if any, and those of the variables."""
    new = (jnp.asarray(number(value), float) for value in values[-len(names) :])
    changes: dict[str, Any] = dict(zip(names, new, strict=True))
    if kind == "started":
        return Started(changes)
    return at(values[0], **changes) if kind == "at" else when(values[0], **changes)


def _reset_event(state: str, model: Any, values: list[Value]) -> Event:
    active, value = values
    return when(jnp.asarray(active), **{state: jnp.asarray(value, float)})


def _delay_event(past: str, model: Any, values: list[Value]) -> Event:
    signal, delay = (jnp.asarray(number(value), float) for value in values)
    return remember(delay, **{past: signal})


def _assert_event(message: str, model: Any, values: list[Value]) -> Event | None:
    active, truth = values
    broken = not np.all(truth) if is_known(truth) else jnp.any(jnp.logical_not(truth))
    parts = [item for item in (active, broken) if item is not True]
    condition = ft.reduce(jnp.logical_and, parts) if parts else True
    return refuse(condition, message) if is_traced(condition) else None


def _followed(value: Any, leaf: ModelLeaf) -> Any:
    """A value that `pre` follows. Truths and integers have no derivatives."""
    value = jnp.asarray(value, float)
    return value if leaf.kind == "real" else jax.lax.stop_gradient(value)
