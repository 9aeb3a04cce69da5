"""Dense output of a step that is taken in pieces."""

import functools as ft
from typing import Any, TypeAlias

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Vector: TypeAlias = Float[Array, " n"]
PIECES = 2  # of a step at most


class Held(diffrax.AbstractLocalInterpolation):
    """Dense output of the inner solver, with what events change held constant."""

    t0: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    inner: diffrax.AbstractLocalInterpolation
    switched: Vector
    start: int = eqx.field(static=True)

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        core = self.inner.evaluate(t0, left=left)
        return jnp.concatenate([core[: self.start], self.switched, core[self.start :]])


class Pieces(diffrax.AbstractLocalInterpolation):
    """Dense output of a step in pieces; at the moment of an event, the values before it."""

    t0: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    begins: Any
    pieces: list[Held]

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        value = self.pieces[0].evaluate(t0, left=left)
        for i, piece in enumerate(self.pieces[1:], start=1):
            is_later = (t0 > self.begins[i]) if left else (t0 >= self.begins[i])
            # Out of its range a piece may be anything, which reverse mode must not meet.
            inside = jnp.where(is_later, t0, self.t1)
            value = jnp.where(is_later, piece.evaluate(inside, left=left), value)
        return value


@ft.cache
def pieces_of(inner: Any, start: int) -> Any:
    """How to make `Pieces` from what a step leaves; the same for one `inner`, since jax compiles anew for another."""

    def make(*, t0: Any, t1: Any, begins: Any, infos: Any, switched: Any) -> Pieces:
        def held(i: int) -> Held:
            begin = jnp.where(jnp.isfinite(begins[i]), begins[i], t0)
            info = jax.tree.map(lambda x: x[i], infos)
            return Held(begin, t1, inner(t0=begin, t1=t1, **info), switched[i], start)

        return Pieces(t0, t1, begins, [held(i) for i in range(PIECES)])

    return make
