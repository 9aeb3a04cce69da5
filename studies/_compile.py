"""Fast compilation for studies that run each of many programs only a few times."""

import contextlib
import gc
from collections.abc import Iterator

import jax

SELDOM = (100_000, 20, 100)  # thresholds of the garbage collector, for `gc.set_threshold`


@contextlib.contextmanager
def compiled_quickly() -> Iterator[None]:
    """Compiles without most optimisations, which would take longer than they save.

    Garbage is collected less often, because the collector would otherwise take a fifth of the tracing time.
    """
    before, thresholds = jax.config.read("jax_disable_most_optimizations"), gc.get_threshold()
    jax.config.update("jax_disable_most_optimizations", True)
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        jax.config.update("jax_disable_most_optimizations", before)
        gc.set_threshold(*thresholds)
