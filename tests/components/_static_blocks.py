"""Evaluation of blocks that are one explicit equation, y - f(...) = 0."""

from typing import Any

import jax
import jax.numpy as jnp

from acausal import Component, replace


def output(block: Component, *inputs: Any, names: tuple[str, ...] = ("u",)) -> jax.Array:
    """y for arrays of inputs, in the order of their names."""

    def at(*values: Any) -> Any:
        given = {f"{name}.value": value for name, value in zip(names, values, strict=True)}
        here = replace(block, {**given, "y.value": 0.0})
        (equation,) = here.equations(here).values()
        return -equation.residual

    return jnp.asarray(jax.jit(jax.vmap(at))(*(jnp.asarray(item, dtype=float) for item in inputs)))
