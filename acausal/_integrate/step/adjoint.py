"""Differentiation of the loop over the steps, in both modes."""

import functools as ft
import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import diffrax
import jax
import numpy as np
from jaxtyping import PyTree

from ..._equinox_private import while_loop
from ..._errors import ModelError

BASE = 16  # iterations of each nested loop
HELD = 10_000_000  # limit on the numbers that reverse mode stores in copies of the saved data of a run


class LoopKind(NamedTuple):
    """The loop over the steps, and whether it supports reverse mode."""

    loop: Callable[..., PyTree]
    is_reversible: bool


def kind_of_loop(adjoint: diffrax.AbstractAdjoint) -> LoopKind:
    """The loop for an adjoint method of diffrax."""
    if isinstance(adjoint, diffrax.ForwardMode):
        return FORWARDS
    if isinstance(adjoint, diffrax.DirectAdjoint):
        return BOTH_MODES
    if isinstance(adjoint, diffrax.RecursiveCheckpointAdjoint):
        return LoopKind(ft.partial(while_loop, kind="checkpointed", checkpoints=adjoint.checkpoints), True)
    raise ModelError(
        f"adjoint={type(adjoint).__name__}() is not supported: events need the derivative of each step. "
        "Use ForwardMode, DirectAdjoint or RecursiveCheckpointAdjoint of diffrax, or None."
    )


def nested_loop(
    cond: Callable[..., PyTree],
    body: Callable[..., PyTree],
    init: PyTree,
    *,
    max_steps: int,
    buffers: Callable[[PyTree], PyTree],
) -> PyTree:
    """`while cond(x): x = body(x)`, for at most `max_steps` iterations, as nested loops of `BASE` iterations.

    Reverse mode stores a checkpoint before each innermost loop. If these need too much memory, for example because
    every step is saved, it stores fewer of them and recomputes more.
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


FORWARDS = LoopKind(ft.partial(while_loop, kind="lax"), False)
BOTH_MODES = LoopKind(nested_loop, True)
