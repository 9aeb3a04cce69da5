"""Optional packages, imported by the calls that need them."""

import importlib
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ._errors import ModelError

# Types of optional packages.
if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
    from pandas import DataFrame as DataFrame
    from xarray import Dataset as Dataset
else:
    Axes: TypeAlias = Any  # axes of matplotlib
    Figure: TypeAlias = Any
    DataFrame: TypeAlias = Any
    Dataset: TypeAlias = Any

Panels: TypeAlias = np.ndarray | Sequence[Axes] | Axes  # the axes of one or several panels


def pyplot() -> ModuleType:
    """matplotlib's pyplot."""
    return needed("matplotlib.pyplot", "plots", "A picture")


def given_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """The given axes, or those of a new figure of this size in inches."""
    return ax if ax is not None else pyplot().subplots(figsize=(width, height), layout="constrained")[1]


def panels(axes: Panels | None, rows: int, columns: int, size: tuple[float, float], sharex: bool = False) -> np.ndarray:
    """Axes in rows and columns: the given ones, or those of a new figure of this size in inches."""
    if axes is None:
        axes = pyplot().subplots(rows, columns, figsize=size, sharex=sharex, squeeze=False, layout="constrained")[1]
    given = np.asarray(axes, object)
    if given.size != rows * columns:
        raise ModelError(f"There are {rows * columns} panels to draw, but {given.size} axes were given.")
    return given.reshape(rows, columns)


def needed(module: str, extra: str, what: str) -> ModuleType:
    """Imports an optional module. Raises `ModelError` with the install command if it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ModelError(f'{what} needs {package}: pip install "acausal[{extra}]".') from error
