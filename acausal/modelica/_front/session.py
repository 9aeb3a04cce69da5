"""Sessions of rumoca."""

import threading
from pathlib import Path
from types import ModuleType
from typing import Any

from ..._extras import needed
from .._errors import ModelicaError

SERIES = "0.10."  # of versions with the form of the flat model that is read here

_own = threading.local()  # a session belongs to its thread


def rumoca() -> ModuleType:
    """The front end. Raises `ModelicaError` if it is another version, and `ModelError` if it is not installed."""
    module = needed("rumoca", "modelica", "Modelica")
    if not module.version().startswith(SERIES):
        raise ModelicaError(
            f"rumoca {module.version()} is installed, but Modelica models are read by rumoca {SERIES}*. "
            f'Remedy: pip install "acausal[modelica]".'
        )
    return module


def session(root: Path) -> Any:
    """The session of this thread for a folder of libraries, which it parses once."""
    known = vars(_own).setdefault("sessions", {})
    if root not in known:
        known[root] = rumoca().Session(roots=[str(root)])
    return known[root]
