"""Work in threads, on all cores, while the main thread listens for an interrupt from the keyboard.

A compiled program runs without Python's lock, so that threads keep all cores busy.
"""

import concurrent.futures
import contextlib
import os
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

T = TypeVar("T")
SPAN = 0.25  # s that a piece of work takes, unless a single member takes longer
LISTEN = 0.5  # s after which a waiting thread looks for an interrupt, as not every system wakes it
CHUNK = 256  # members of a piece at most


def on_all_cores(
    work: Callable[[np.ndarray], Any], x: Float[np.ndarray, "n k"], most: int = CHUNK
) -> Generator[tuple[slice, Any]]:
    """Pieces of the rows of x and what `work` makes of them, in the order in which they are done.

    Pieces are as short as `SPAN` asks for, so that an interrupt loses little, and leave some rows for each core, so
    that none waits for another at the end.
    """
    cores, first, size = os.cpu_count() or 1, 0, 1
    running: dict[Any, slice] = {}
    with threads(cores) as pool:
        while first < len(x) or running:
            while first < len(x) and len(running) < 2 * cores:
                share = -(-(len(x) - first) // (2 * cores))
                rows = slice(first, first + min(size, share))
                running[pool.submit(_timed, work, x[rows])] = rows
                first = rows.stop
            for future in finished(running):
                rows = running.pop(future)
                found, seconds = future.result()
                size = int(np.clip(SPAN * (rows.stop - rows.start) / max(seconds, 1e-9), 1, most))
                yield rows, found


def heard(work: Callable[[], T]) -> T:
    """The result of a piece of work, which leaves the main thread free to hear an interrupt."""
    if threading.current_thread() is not threading.main_thread():
        return work()
    with threads(1) as pool:
        future = pool.submit(work)
        wait_for([future])
        return future.result()


def wait_for(futures: Iterable[concurrent.futures.Future[Any]]) -> None:
    """Returns once all of them are done."""
    while concurrent.futures.wait(futures, LISTEN).not_done:
        pass


def finished(futures: Iterable[concurrent.futures.Future[T]]) -> set[concurrent.futures.Future[T]]:
    """Those that are done: at least one, or none after `LISTEN`."""
    return concurrent.futures.wait(futures, LISTEN, concurrent.futures.FIRST_COMPLETED).done


@contextlib.contextmanager
def threads(number: int) -> Iterator[concurrent.futures.Executor]:
    """Threads that nobody waits for once an interrupt ends the work; each ends after its piece."""
    pool = concurrent.futures.ThreadPoolExecutor(number)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _timed(work: Callable[[np.ndarray], Any], x: np.ndarray) -> tuple[Any, float]:
    began = time.perf_counter()
    return work(x), time.perf_counter() - began
