"""How studies compile that run each of many programs only a few times."""

import contextlib
import gc
from collections.abc import Iterator

import jax

SELDOM = (100_000, 20, 100)  # objects made, and collections of younger ones, between two collections of garbage


@contextlib.contextmanager
def compiled_quickly() -> Iterator[None]:
    """Programs are compiled without most optimisations, which would take longer than they save.

    And garbage is collected seldom: a fifth of the time in which programs are traced would go into looking for it.
    """
    before, thresholds = jax.config.read("jax_disable_most_optimizations"), gc.get_threshold()
    jax.config.update("jax_disable_most_optimizations", True)
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        jax.config.update("jax_disable_most_optimizations", before)
        gc.set_threshold(*thresholds)
