"""Garbage is looked for less often while many objects are made that stay."""

import contextlib
import gc
from collections.abc import Iterator

SELDOM = (100_000, 20, 100)  # thresholds of `gc.set_threshold`: new objects, then collections of the generation before


@contextlib.contextmanager
def seldom_collected() -> Iterator[None]:
    """Structural passes and traces of programs make objects that stay; the collector would walk them again and again,
    which takes a fifth of the time in which programs are traced.
    """
    before = gc.get_threshold()
    if not 0 < before[0] < SELDOM[0]:  # by choice, or within another of these, maybe of another thread, which ends it
        yield
        return
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        gc.set_threshold(*before)
