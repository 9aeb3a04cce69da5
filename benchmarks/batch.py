"""Many designs at once, on all cores: against one CVODES run after the other, and runs with events against a loop."""

import concurrent.futures
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Scalar, simulate
from acausal.design import Tolerance, Uniform
from studies import opening_time
from studies.actuators import ema_maxon

from . import _handwritten as handwritten
from ._cvodes import Run
from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest
from .events import Ball

RTOL = 1e-6
LIMIT = 0.1
RATIOS = (3.0, 8.0)
CHUNKS = (8, 32, 128)
LIMIT_OF_EVENTS = 1.1  # of a loop over single runs, shared out to the cores
GRAVITY = (1.0, 5_000.0)  # m/s2: from 2 to 180 impacts


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """Time per design of all ways to run a batch; the limit holds for the fastest of them."""
    ratios = jnp.linspace(*RATIOS, effort.designs)
    threads = os.cpu_count() or 1
    ways: dict[str, Callable[[Any], Any]] = {"in lockstep (vmap)": jax.jit(jax.vmap(_opening))}
    ways["one by one (lax.map)"] = jax.jit(lambda ratios: jax.lax.map(_opening, ratios))
    for size in CHUNKS:
        ways[f"lockstep of {size}"] = jax.jit(lambda ratios, size=size: jax.lax.map(_opening, ratios, batch_size=size))
    for name, function in list(ways.items()):
        ways[f"{name}, {threads} threads"] = _threaded(function, threads)
    expected = ways["one by one (lax.map)"](ratios)
    for function in ways.values():
        np.testing.assert_allclose(function(ratios), expected, rtol=1e-5)

    p = {name: float(value) for name, value in handwritten.parameters(ema_maxon()).items()}
    calls = {name: lambda f=function: f(ratios) for name, function in ways.items()}
    times = fastest(calls, max(2, effort.repeats // 20))
    reference = fastest({"CVODES": Run(p, RTOL, RTOL)}, 5 * effort.repeats)["CVODES"] * 1e6
    best = min(ways, key=lambda name: times[name])
    return [_with_events(effort)] + [
        compared(
            f"batch: {name}", times[name] / effort.designs * 1e6, "us", reference, "one CVODES run",
            LIMIT if name == best else None,
        )
        for name in sorted(ways, key=lambda name: times[name])
    ]  # fmt: skip


def _with_events(effort: Effort) -> Row:
    """Balls with differing numbers of impacts, as a study of tolerances and as a loop over one compiled run."""
    run = lambda ball: simulate(ball, 5.0, save="end", rtol=RTOL)  # noqa: E731
    study = Tolerance(Ball(), {"g": Uniform(*GRAVITY)}, lambda s: s.final.h, run=run)
    scores = np.random.default_rng(0).standard_normal((effort.designs, 1))
    gravities = study.parameters_at(scores)[:, 0]
    one = jax.jit(lambda g: run(Ball(g=g)).final.h)
    ways = {
        "batch": lambda: study.members(scores, progress=False).outcomes.values[:, 0],
        "loop": lambda: np.array([float(one(g)) for g in gravities]),
    }
    np.testing.assert_allclose(ways["batch"](), ways["loop"](), rtol=1e-12)
    times = fastest(ways, max(2, effort.repeats // 20))
    share = times["loop"] / (os.cpu_count() or 1) / effort.designs * 1e6
    each = times["batch"] / effort.designs * 1e6
    return compared("batch: runs with events", each, "us", share, "a loop over single runs, by cores", LIMIT_OF_EVENTS)


def _opening(ratio: Scalar) -> Scalar:
    return opening_time(ema_maxon(ratio=ratio), rtol=RTOL)


def _threaded(function: Callable[[Any], Any], threads: int) -> Callable[[Any], Any]:
    """The batch in equal parts; compiled functions run without Python's lock. Neighbours in the batch go to different
    threads, as their runs take about as long.
    """
    pool = concurrent.futures.ThreadPoolExecutor(threads)

    def run(batch: Any) -> Any:
        parts = [batch[i::threads] for i in range(threads)]
        results = list(pool.map(lambda part: jax.block_until_ready(function(part)), parts))
        return jnp.stack(results, axis=1).ravel() if len({len(r) for r in results}) == 1 else _interleaved(results)

    return run


def _interleaved(parts: list[Any]) -> Any:
    total = np.empty(sum(len(part) for part in parts))
    for i, part in enumerate(parts):
        total[i :: len(parts)] = part
    return total
