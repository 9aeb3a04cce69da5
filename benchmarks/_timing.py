"""Fair timings on a machine that does other things as well."""

import gc
import time
from collections.abc import Callable, Mapping
from typing import Any

import jax


def fastest(functions: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """The least time in s that each function took.

    They take turns, so that a slow spell of the machine hits all of them; the least time is what the work needs, the
    rest being what else the machine did.
    """
    times = dict.fromkeys(functions, float("inf"))
    for function in functions.values():
        jax.block_until_ready(function())
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for _ in range(repeats):
            for name, function in functions.items():
                start = time.perf_counter()
                jax.block_until_ready(function())
                times[name] = min(times[name], time.perf_counter() - start)
    finally:
        if was_enabled:
            gc.enable()
    return times
