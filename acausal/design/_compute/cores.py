"""Work in threads on all cores, while the main thread waits for a keyboard interrupt.

Compiled programs release Python's global lock, so threads keep all cores busy.
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
SPAN = 0.25  # s, target duration of a piece of work
LISTEN = 0.5  # s between checks for an interrupt, as not every system wakes a waiting thread
CHUNK = 256  # most members of a piece


def on_all_cores(
    work: Callable[[np.ndarray], Any], x: Float[np.ndarray, "n k"], most: int = CHUNK
) -> Generator[tuple[slice, Any]]:
    """Slices of the rows of x with the results of `work`, in order of completion.

    A piece takes about `SPAN`, so an interrupt loses little. The last pieces are spread over all cores.
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
            for future in concurrent.futures.wait(running, LISTEN, concurrent.futures.FIRST_COMPLETED).done:
                rows = running.pop(future)
                found, seconds = future.result()
                size = int(np.clip(SPAN * (rows.stop - rows.start) / max(seconds, 1e-9), 1, most))
                yield rows, found


def interruptible(work: Callable[[], T]) -> T:
    """The result of `work`, computed in another thread so that the main thread can receive an interrupt."""
    if threading.current_thread() is not threading.main_thread():
        return work()
    with threads(1) as pool:
        future = pool.submit(work)
        wait_for([future])
        return future.result()


def wait_for(futures: Iterable[concurrent.futures.Future[Any]]) -> None:
    """Waits until all futures are done."""
    while concurrent.futures.wait(futures, LISTEN).not_done:
        pass


@contextlib.contextmanager
def threads(number: int) -> Iterator[concurrent.futures.Executor]:
    """A thread pool that does not wait for its threads on exit; each ends after its piece."""
    pool = concurrent.futures.ThreadPoolExecutor(number)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _timed(work: Callable[[np.ndarray], Any], x: np.ndarray) -> tuple[Any, float]:
    began = time.perf_counter()
    return work(x), time.perf_counter() - began
