"""Packages that only some calls need."""

import importlib
from typing import Any

from ._errors import ModelError


def pyplot() -> Any:
    """matplotlib's pyplot."""
    return needed("matplotlib.pyplot", "plots", "A picture")


def needed(module: str, extra: str, what: str) -> Any:
    """The module that something needs, or an error that says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ModelError(f'{what} needs {package}: pip install "acausal[{extra}]".') from error
