"""How far a long piece of work is, on one line of the terminal."""

import sys
import time
from collections.abc import Callable

from .._progress import is_read


def bar(what: str, wanted: bool | None) -> Callable[[int, int], None]:
    """A function of how much is done, and of how much there is, that draws a bar: on a terminal, or as `wanted`."""
    began, first = time.monotonic(), [-1]

    def tell(done: int, total: int) -> None:
        if not is_read(sys.stderr, wanted):
            return
        if first[0] < 0:
            first[0] = done
        filled = int(30 * done / max(total, 1))
        seconds = time.monotonic() - began
        rest = seconds / max(done - first[0], 1) * (total - done)
        left = f", {rest:.0f} s left" if done < total and done > first[0] else f", {seconds:.0f} s"
        line = f"\r{what} [{'#' * filled}{'.' * (30 - filled)}] {done} of {total}{left}".ljust(79)
        sys.stderr.write(line + ("\n" if done >= total else ""))
        sys.stderr.flush()

    return tell
