"""The exceptions of the library: each message names the component's path and the remedy."""

import contextlib
import contextvars
import difflib
from collections.abc import Iterable, Iterator, Sequence


class AcausalError(Exception):
    """Base class of all errors of the library."""


class ModelError(AcausalError):
    """A model with a wrong declaration or connection. Raised before any number is computed."""


class StructureError(ModelError):
    """A structurally singular system of equations."""


class ParameterError(ModelError, ValueError):
    """A parameter outside its admissible range."""


class ArgumentError(ModelError, TypeError):
    """An unknown or a missing argument of a component."""


class UnknownNameError(ModelError, KeyError, AttributeError):
    """A name that the model does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


class UnknownPartError(ModelError, IndexError):
    """A part that an array of components does not have."""


class UnitError(ModelError):
    """Equations or connections with inconsistent units. The message lists all of them."""


class SimulationError(AcausalError, RuntimeError):
    """A run that failed numerically or did not meet its stop condition."""


class DesignWarning(UserWarning):
    """An error has ended a study, or a part of it, early. The result holds what was computed before."""


def reason_of(error: BaseException) -> str:
    """The message of an error, or its class if it has none."""
    return str(error) or type(error).__name__


_collected: contextvars.ContextVar[list[ModelError] | None] = contextvars.ContextVar("collected", default=None)


@contextlib.contextmanager
def collecting() -> Iterator[list[ModelError]]:
    """Collect the errors of a model in a list instead of raising the first, as far as the analysis can continue."""
    found: list[ModelError] = []
    token = _collected.set(found)
    try:
        yield found
    finally:
        _collected.reset(token)


def complain(error: ModelError) -> None:
    """Raise an error, or add it to the list of `collecting`."""
    found = _collected.get()
    if found is None:
        raise error
    found.append(error)


def listed(names: Sequence[str], most: int = 12) -> str:
    """Names joined by commas, the first `most` of them."""
    return ", ".join(names[:most]) + (f", and {len(names) - most} more" if len(names) > most else "")


def suggestion(name: str, known: Iterable[str]) -> str:
    """A sentence that suggests similar names for a misspelt one; empty if there are none.

    A name that differs only in case and underscores is the only suggestion. Names that the misspelt one begins or ends
    with come first, such as `w` for `w_start` and `a` for `flange_a`.
    """
    known = list(known)
    same = [other for other in known if _plain(other) == _plain(name)]
    within = [other for other in known if name.startswith(f"{other}_") or name.endswith(f"_{other}")]
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
    offered = same or list(dict.fromkeys([*sorted(within, key=len, reverse=True), *close]))[:3]
    return f" Did you mean {' or '.join(offered)}?" if offered else ""


def unknown_part(path: str, known: Iterable[str], what: str) -> UnknownNameError:
    """The error for a path without a value of its own. It names the values of the parts below the path, if there are
    any, or similar paths.
    """
    known = list(known)
    below = [name for name in known if name.startswith((f"{path}.", f"{path}["))]
    remedy = f" Use the sum over its parts {listed(below)}." if below else suggestion(path, known)
    return UnknownNameError(f"{path!r} has no {what} of its own.{remedy or f' It is known for {listed(known)}.'}")


def _plain(name: str) -> str:
    return name.replace("_", "").lower()
