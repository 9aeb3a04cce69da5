"""Files of solutions and other results, with a description that other programs can read."""

import importlib.metadata
import json
import math
import os
import pickle
import platform
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ._declare.by_name import Parameters, parameters
from ._declare.component import Component
from ._errors import ArgumentError, ModelError, listed

ABOUT, DATA = "about.json", "data.pickle"
# Errors of `zipfile` for damaged files.
SPOILT = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
PACKAGES = ("acausal", "jax", "equinox", "diffrax", "numpy")


class VersionWarning(UserWarning):
    """A file was written with other versions of the packages, or by a model with other equations."""


def save(file: str | os.PathLike[str], item: object) -> None:
    """Write a solution, a model or another result to a file for `load`.

    The file is a zip archive. Its entry `about.json` holds the parameters of the model with units, the options of the
    run and the versions of Python and of the packages, for `about(file)` and other programs.

    Raises `ModelError` for an item that cannot be stored, such as a traced value or an instance of a class that a
    function defines.
    """
    if not isinstance(file, str | os.PathLike):
        raise ArgumentError(f"save(file, item) takes the path of a file first, got {file!r}.")
    try:
        data = pickle.dumps(item)
    except (pickle.PicklingError, AttributeError, TypeError, RecursionError, jax.errors.JAXTypeError) as error:
        raise ModelError(f"{type(item).__name__} cannot be stored: {error}") from error
    described = {"kind": type(item).__name__, **_described(item), "versions": versions()}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(ABOUT, json.dumps(_plain(described), indent=2) + "\n")
        archive.writestr(DATA, data)


def load(file: str | os.PathLike[str]) -> Any:
    """Read the item of a file of `save`. Load only files that you trust: they can run code.

    The classes of the item must be importable. Warns with `VersionWarning` if the versions of the packages or the
    equations of the model have changed: a solution computes all its values except the states from the equations.

    Raises `ModelError` if `save` has not written the file, if it is damaged, or if the present versions and classes
    cannot read it.
    """
    written = about(file)
    was, now = written["versions"], versions()
    other = [f"{name} {version}, not {now.get(name)}" for name, version in was.items() if version != now.get(name)]
    said = f"{file} was written with {', '.join(other)}."
    if other:
        warnings.warn(said, VersionWarning, stacklevel=2)
    data = _entry(file, DATA)
    try:
        item = pickle.loads(data)
    except ModelError as error:
        raise ModelError(f"{file} cannot be loaded: {error} {said if other else _CHANGED}") from error
    except (AttributeError, ImportError, TypeError, ValueError, EOFError, pickle.UnpicklingError) as error:
        raise ModelError(f"{file} cannot be loaded: {error}. {said if other else _GONE}") from error
    described = _plain(_described(item))
    _check_units(file, written, described)
    if not other and written.get("equations") != described.get("equations"):
        said = f"{file} was written with other equations in the classes of {written['model']}."
        warnings.warn(
            f"{said} All values except the states follow from the present equations.", VersionWarning, stacklevel=2
        )
    return item


_CHANGED = 'Remedy: load it with the classes that it was saved with; about(file)["parameters"] are its parameters.'
_GONE = "Its classes must be where they were: import or define them first."


def _check_units(file: Any, written: dict[str, Any], described: dict[str, Any]) -> None:
    """Raise if the unit of a parameter has changed since the file was written."""
    then, now = (
        {path: parameter["unit"] for path, parameter in said.get("parameters", {}).items()}
        for said in (written, described)
    )
    if changed := [f"{path} in {unit}, not {now.get(path)}" for path, unit in then.items() if unit != now.get(path)]:
        raise ModelError(f"{file} cannot be loaded: it was written with other units, {listed(changed)}.")


def about(file: str | os.PathLike[str]) -> dict[str, Any]:
    """Description of a file of `save`: kind, parameters of the model with units, options of the run, versions.

    Raises `ModelError` for a missing file and for a file of another kind.
    """
    if not Path(file).is_file():
        raise ModelError(f"There is no file {file}.")
    try:
        found = json.loads(_entry(file, ABOUT))
    except ValueError:
        found = None
    if not isinstance(found, dict) or not isinstance(found.get("versions"), dict):
        raise ModelError(f"{file} was not written by save(...).")
    return found


def _entry(file: str | os.PathLike[str], name: str) -> bytes:
    """An entry of a file of `save`."""
    try:
        with zipfile.ZipFile(file) as archive:
            return archive.read(name)
    except (*SPOILT, KeyError, OSError) as error:
        raise ModelError(f"{file} was not written by save(...), or is damaged: {error}.") from error


def versions() -> dict[str, str]:
    found = {name: importlib.metadata.version(name) for name in PACKAGES}
    return {"python": platform.python_version(), **found}


def _described(item: Any) -> dict[str, Any]:
    """The description of an item; for a model, its parameters."""
    if isinstance(item, Component):
        return {"parameters": described(parameters(item))}
    return item._described() if hasattr(item, "_described") else {}


def described(params: Parameters) -> dict[str, Any]:
    """Parameters with their units."""
    return {path: {"value": value, "unit": params.units[path]} for path, value in params.items()}


def _plain(value: object) -> Any:
    """A value for JSON: arrays as lists, numbers that are not finite and other values as text."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | jax.Array | np.generic):
        return _plain(value.tolist())
    is_known = value is None or isinstance(value, str | bool | int)
    return value if is_known or (isinstance(value, float) and math.isfinite(value)) else str(value)
