"""How far a long piece of work is: a bar on a terminal, a line now and then in a log."""

import sys
import time

from ..._progress import is_read, is_silent, is_terminal
from .._problem.types import Progress

EVERY = 10.0  # s between lines in a log
FAILURES = 5  # that are reported as they happen


class Bar:
    """Is told how much is done and how much there is, and says so with the rate and the time left.

    `wanted`: whether to say it; None: also in logs, but only of work that takes longer than `EVERY`. A function of the
    two numbers is told instead.
    """

    def __init__(self, what: str, wanted: Progress | bool | None) -> None:
        self._what, self._wanted = what, wanted
        self._began = self._said = time.monotonic()
        self._already = -1  # done before, as a store tells
        self._first: tuple[int, float] | None = None  # done, and when: a program is compiled before that
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
        """A line of its own."""
        if not callable(self._wanted) and not is_silent(sys.stderr, self._wanted):
            line = f"{self._what}: {text}"
            _write(f"\r{line.ljust(79)}\n" if is_terminal(sys.stderr) else f"{line}\n")

    def failed(self, text: str) -> None:
        """Say the first failures."""
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


def _write(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
