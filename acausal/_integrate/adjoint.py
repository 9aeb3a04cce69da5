"""Differentiation of the loop over the steps, in both modes."""

import functools as ft
import itertools
import math
from collections.abc import Callable

import diffrax
import jax
import numpy as np
from jaxtyping import PyTree

from .._diffrax_private import with_short_start
from .._equinox_private import while_loop

BASE = 16  # rounds of each of the nested loops
HELD = 10_000_000  # numbers that reverse mode may keep in copies of what is saved along a run


class Forwards(diffrax.ForwardMode):
    """`diffrax.ForwardMode` that compiles less."""

    @property
    def _loop(self) -> Callable[..., PyTree]:
        return with_short_start(super()._loop)


class BothModes(diffrax.DirectAdjoint):
    """`diffrax.DirectAdjoint` with more copies of the state: one before each 16 steps.

    With the few copies that it takes itself, reverse mode computes most steps two more times, and compiles them as
    often. Here it computes each step once more.
    """

    @property
    def _loop(self) -> Callable[..., PyTree]:
        return with_short_start(super()._loop)

    def loop(
        self,
        *,
        max_steps: int | None,
        throw: object,
        passed_solver_state: object,
        passed_controller_state: object,
        **others: PyTree,
    ) -> PyTree:
        del throw, passed_solver_state, passed_controller_state
        saves = ft.partial(while_loop, kind="bounded")
        return self._loop(max_steps=max_steps, inner_while_loop=saves, outer_while_loop=nested_loop, **others)


def nested_loop(
    cond: Callable[..., PyTree],
    body: Callable[..., PyTree],
    init: PyTree,
    *,
    max_steps: int,
    buffers: Callable[[PyTree], PyTree],
) -> PyTree:
    """`while cond(x): x = body(x)`, for `max_steps` at most, as loops within loops of `BASE` rounds.

    Reverse mode keeps the state before each of the innermost loops. Where there is too much of it, as when every step
    is saved, it keeps fewer, and computes more of them again.
    """
    levels = next(n for n in itertools.count(1) if BASE**n >= max_steps)
    saved = sum(np.size(x) for x in jax.tree_util.tree_leaves(buffers(init)))
    is_much = saved * math.ceil(max_steps / BASE) > HELD

    def goes_on(counted: PyTree) -> PyTree:
        return (counted[0] < max_steps) & cond(counted[1])

    def run(counted: PyTree, level: int) -> PyTree:
        if level == 0:
            return counted[0] + 1, body(counted[1])
        inner = ft.partial(run, level=level - 1)
        if level == 2 or (level > 2 and is_much):
            inner = jax.checkpoint(inner, prevent_cse=False)
        return while_loop(
            goes_on, inner, counted, max_steps=BASE, base=BASE, kind="bounded",
            buffers=lambda counted: buffers(counted[1]),
        )  # fmt: skip

    return run((0, init), levels)[1]
