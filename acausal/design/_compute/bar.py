"""Progress of a long computation: a bar on a terminal, occasional lines in a log."""

import sys
import time
from typing import TextIO

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
