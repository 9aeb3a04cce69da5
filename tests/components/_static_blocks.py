"""Evaluation of components in the mode that belongs to given inputs."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp

from acausal import Component, replace
from acausal._declare.component import When
from acausal._declare.layout import complete


def _events(model: Component, path: str = "") -> Iterator[tuple[str, Component, When]]:
    for event in model.events().values():
        if isinstance(event, When):
            yield path, model, event
    for field in dataclasses.fields(model):
        part = getattr(model, field.name)
        if isinstance(part, Component):
            yield from _events(part, f"{path}{field.name}.")


def _settled(model: Any, rounds: int = 4) -> Any:
    """A model after the events triggered by its values, and those that follow."""
    model = jax.tree.map(jnp.asarray, model)  # as in a run: Python's own False has no negation by ~
    for _ in range(rounds):
        new: dict[str, Any] = {}
        for path, part, event in _events(model):
            for target, value in event.changes.items():
                before = new.get(path + target, getattr(part, target))
                new[path + target] = jnp.where(event.condition, value, before)
        model = replace(model, new)
    return model


def output(block: Component, *inputs: Any, names: tuple[str, ...] = ("u",)) -> jax.Array:
    """y of a block that is one explicit equation, y - f(...) = 0, for arrays of inputs, in the order of their names."""

    def at(*values: Any) -> Any:
        given = {f"{name}.value": value for name, value in zip(names, values, strict=True)}
        here = _settled(complete(replace(block, {**given, "y.value": 0.0})))
        (equation,) = here.equations(here).values()
        return -equation.residual

    return jnp.asarray(jax.jit(jax.vmap(at))(*(jnp.asarray(item, dtype=float) for item in inputs)))
