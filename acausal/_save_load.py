"""Solutions and other results in one file: what they are, for anyone to read, and what it takes to load them again."""

import importlib.metadata
import json
import math
import os
import pickle
import platform
import warnings
import zipfile
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ._declare.by_name import Parameters, parameters
from ._declare.component import Component
from ._errors import ModelError

ABOUT, DATA = "about.json", "data.pickle"
PACKAGES = ("acausal", "jax", "equinox", "diffrax", "numpy")


class VersionWarning(UserWarning):
    """A file was written with other versions than those that read it."""


def save(file: str | os.PathLike[str], item: Any) -> None:
    """Write a solution, a model or another result to a file, from which `load` makes it again.

    The file is a zip archive. `about.json` in it holds the parameters of the model with units, the options of the run
    and the versions of Python and of the packages, for `about(file)` and other programs.

    Raises `ModelError` for what cannot be stored, such as what `jit` is tracing, or an instance of a class that a
    function defines.
    """
    try:
        data = pickle.dumps(item)
    except (pickle.PicklingError, AttributeError, TypeError, jax.errors.JAXTypeError) as error:
        raise ModelError(f"{type(item).__name__} cannot be stored: {error}") from error
    described = {"kind": type(item).__name__, **_described(item), "versions": _versions()}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(ABOUT, json.dumps(_plain(described), indent=2) + "\n")
        archive.writestr(DATA, data)


def load(file: str | os.PathLike[str]) -> Any:
    """What `save` has written. Its classes must be there to import. Load only files that you trust: they can run code.

    Warns with `VersionWarning` where versions differ from those that it was written with.

    Raises `ModelError` where the file is none of `save`, or cannot be read with the versions that are installed.
    """
    written = about(file)["versions"]
    other = {name: f"{was}, not {_versions()[name]}" for name, was in written.items() if was != _versions().get(name)}
    said = f"{file} was written with {', '.join(f'{name} {text}' for name, text in other.items())}."
    if other:
        warnings.warn(said, VersionWarning, stacklevel=2)
    with zipfile.ZipFile(file) as archive:
        try:
            return pickle.loads(archive.read(DATA))
        except (AttributeError, ImportError, TypeError, ValueError, pickle.UnpicklingError) as error:
            hint = f" {said}" if other else " Its classes must be where they were: import or define them first."
            raise ModelError(f"{file} cannot be loaded: {error}.{hint}") from error


def about(file: str | os.PathLike[str]) -> dict[str, Any]:
    """What a file of `save` holds: kind, parameters of the model with units, options of the run, versions.

    Raises `ModelError` for a file of another kind, and for one that is not there.
    """
    if not Path(file).exists():
        raise ModelError(f"There is no file {file}.")
    try:
        with zipfile.ZipFile(file) as archive:
            return json.loads(archive.read(ABOUT))
    except (zipfile.BadZipFile, KeyError, json.JSONDecodeError) as error:
        raise ModelError(f"{file} was not written by save(...).") from error


def _versions() -> dict[str, str]:
    found = {name: importlib.metadata.version(name) for name in PACKAGES}
    return {"python": platform.python_version(), **found}


def _described(item: Any) -> dict[str, Any]:
    """What an item says of itself; of a model, its parameters."""
    if isinstance(item, Component):
        return {"parameters": described(parameters(item))}
    return item._described() if hasattr(item, "_described") else {}


def described(listed: Parameters) -> dict[str, Any]:
    """Parameters with their units."""
    return {path: {"value": value, "unit": listed.units[path]} for path, value in listed.items()}


def _plain(value: Any) -> Any:
    """What JSON knows: arrays as lists; what is not finite, and all else, as text."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | jax.Array | np.generic):
        return _plain(value.tolist())
    is_known = value is None or isinstance(value, str | bool | int)
    return value if is_known or (isinstance(value, float) and math.isfinite(value)) else str(value)
