"""The exceptions of the library: each message names the component's path and the remedy."""

import contextlib
import contextvars
import difflib
from collections.abc import Iterable, Iterator, Sequence


class AcausalError(Exception):
    """The base of all errors of the library."""


class ModelError(AcausalError):
    """A model that is declared or connected wrongly; raised before any number is computed."""


class StructureError(ModelError):
    """A system of equations that has no unique solution for structural reasons."""


class ParameterError(ModelError, ValueError):
    """A parameter outside its admissible range."""


class ArgumentError(ModelError, TypeError):
    """An argument that a component does not take, or one that it lacks."""


class UnknownNameError(ModelError, KeyError, AttributeError):
    """A name that the model does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


class UnknownPartError(ModelError, IndexError):
    """A part that an array of components does not have."""


class UnitError(ModelError):
    """Equations or connections whose units do not agree; the message lists all that were found."""


class SimulationError(AcausalError, RuntimeError):
    """A run that failed numerically, or never met its stop condition."""


_collected: contextvars.ContextVar[list[ModelError] | None] = contextvars.ContextVar("collected", default=None)


@contextlib.contextmanager
def collecting() -> Iterator[list[ModelError]]:
    """Let what is wrong with a model be listed, as far as it does not hinder looking on, instead of raised."""
    found: list[ModelError] = []
    token = _collected.set(found)
    try:
        yield found
    finally:
        _collected.reset(token)


def complain(error: ModelError) -> None:
    """Raise an error, or add it to the list that is being collected."""
    found = _collected.get()
    if found is None:
        raise error
    found.append(error)


def listed(names: Sequence[str], most: int = 12) -> str:
    """Names joined by commas, the first `most` of them."""
    return ", ".join(names[:most]) + (f", and {len(names) - most} more" if len(names) > most else "")


def suggestion(name: str, known: Iterable[str]) -> str:
    """A sentence that offers names like a misspelt one; empty where there are none.

    One that differs in case and underscores alone is offered alone; what the name begins or ends with comes first, as
    `w` for `w_start` and `a` for `flange_a`.
    """
    known = list(known)
    same = [other for other in known if _plain(other) == _plain(name)]
    within = [other for other in known if name.startswith(f"{other}_") or name.endswith(f"_{other}")]
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
    offered = same or list(dict.fromkeys([*sorted(within, key=len, reverse=True), *close]))[:3]
    return f" Did you mean {' or '.join(offered)}?" if offered else ""


def _plain(name: str) -> str:
    return name.replace("_", "").lower()
