"""Evaluation of blocks that are one explicit equation, y - f(...) = 0."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from acausal import Component


def output(block: Component, *inputs: Any, names: tuple[str, ...] = ("u",)) -> jax.Array:
    """y for arrays of inputs, in the order of their names."""

    def at(*values: Any) -> Any:
        where = lambda b: [getattr(b, name).value for name in names] + [b.y.value]  # noqa: E731
        here: Any = eqx.tree_at(where, block, [*values, 0.0])
        (equation,) = here.equations(here).values()
        return -equation.residual

    return jnp.asarray(jax.jit(jax.vmap(at))(*(jnp.asarray(item, dtype=float) for item in inputs)))
