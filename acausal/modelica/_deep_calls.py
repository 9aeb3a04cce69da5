"""Deep calls: look-up and evaluation in large libraries need more of them than Python allows by default."""

import contextlib
import sys
from collections.abc import Iterator

from ._errors import ModelicaError

_DEPTH = 4_000


@contextlib.contextmanager
def deep_calls() -> Iterator[None]:
    """Allows deep calls. Raises `ModelicaError` for a text that nests too deeply even so."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, _DEPTH))
    try:
        yield
    except RecursionError as error:
        raise ModelicaError("Expressions or classes nest too deeply. Remedy: divide them.") from error
    finally:
        sys.setrecursionlimit(before)
