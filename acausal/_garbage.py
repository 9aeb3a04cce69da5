"""Less frequent garbage collection during passes that create many long-lived objects."""

import contextlib
import gc
from collections.abc import Iterator

SELDOM = (100_000, 20, 100)  # thresholds of `gc.set_threshold`: new objects, then collections of the generation before


@contextlib.contextmanager
def seldom_collected() -> Iterator[None]:
    """Raise the thresholds of the garbage collector.

    Structural passes and traces of programs create long-lived objects. Repeated collections over them would take a
    fifth of the tracing time.
    """
    before = gc.get_threshold()
    if not 0 < before[0] < SELDOM[0]:  # set by the user or by an outer call
        yield
        return
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        gc.set_threshold(*before)
