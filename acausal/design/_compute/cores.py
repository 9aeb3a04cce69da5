"""Work in threads on all cores, while the main thread waits for a keyboard interrupt.

Compiled programs release Python's global lock, so threads keep all cores busy.
"""

import concurrent.futures
import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any, TextIO, TypeVar

import numpy as np
from jaxtyping import Float

from ..._progress import is_read, is_silent, is_terminal
from .._problem.types import Progress

EVERY = 10.0  # s between lines in a log
FAILURES = 5  # most failures that are reported as they happen


class Bar:
    """Shows how many of how many members are done, with the rate and the time left.

    `wanted`: whether to show it. None: on terminals, and in logs after `EVERY`. A function receives both numbers
    instead.
    """

    def __init__(self, what: str, wanted: Progress | bool | None) -> None:
        self._what, self._wanted = what, wanted
        self._began = self._said = time.monotonic()
        self._already = -1  # done before, according to a store
        self._first: tuple[int, float] | None = None  # first progress and its time, after compilation
        self._failures, self._is_begun = 0, False

    def __call__(self, done: int, total: int) -> None:
        if callable(self._wanted):
            self._wanted(done, total)
            return
        if is_silent(sys.stderr, self._wanted):
            return
        is_over, now = done >= total, time.monotonic()
        if self._already < 0:
            self._already = done
        elif self._first is None and done > self._already:
            self._first = done, now
        if is_terminal(sys.stderr):
            _write("\r" + self._text(done, total).ljust(79) + ("\n" if is_over else ""))
        elif now - self._said >= EVERY or (is_over and (self._is_begun or is_read(sys.stderr, self._wanted))):
            self._said, self._is_begun = now, True
            _write(self._text(done, total) + "\n")

    def say(self, text: str) -> None:
        """Prints a separate line."""
        if not callable(self._wanted) and not is_silent(sys.stderr, self._wanted):
            line = f"{self._what}: {text}"
            _write(f"\r{line.ljust(79)}\n" if is_terminal(sys.stderr) else f"{line}\n")

    def failed(self, text: str) -> None:
        """Reports a failure, if it is among the first."""
        self._failures += 1
        if self._failures <= FAILURES:
            self.say(text)

    def _text(self, done: int, total: int) -> str:
        filled = int(30 * done / max(total, 1))
        now = time.monotonic()
        how = f", {now - self._began:.0f} s"
        if self._first is not None and self._first[0] < done < total:
            rate = (done - self._first[0]) / max(now - self._first[1], 1e-9)
            how = f", {rate:.3g} per s, {(total - done) / rate:.0f} s left"
        return f"{self._what} [{'#' * filled}{'.' * (30 - filled)}] {done} of {total}{how}"


def is_logged(stream: TextIO | None, wanted: bool | None, waited: float) -> bool:
    """Whether to print a message to a log after so many seconds without one."""
    return waited >= EVERY and not is_silent(stream, wanted)


def _write(text: str) -> None:
    print(text, end="", file=sys.stderr, flush=True)


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
