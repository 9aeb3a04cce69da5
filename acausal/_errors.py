"""The exceptions of the library: each message names the component's path and the remedy."""

import difflib
from collections.abc import Iterable


class ModelError(Exception):
    """A model that is declared or connected wrongly; raised before any number is computed."""


class StructureError(ModelError):
    """A system of equations that has no unique solution for structural reasons."""


class ParameterError(ModelError, ValueError):
    """A parameter outside its admissible range."""


class UnitError(ModelError):
    """Equations or connections whose units do not agree; the message lists all that were found."""


class SimulationError(RuntimeError):
    """A run that failed numerically, or never met its stop condition."""


def suggestion(name: str, known: Iterable[str]) -> str:
    """A sentence that offers names like a misspelt one; empty where there are none."""
    close = difflib.get_close_matches(name, list(known), n=3, cutoff=0.4)
    return f" Did you mean {' or '.join(close)}?" if close else ""
