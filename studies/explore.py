"""Actuators with sliders in a browser: results, limits, gradients, curves and the optimum from the present values."""

import functools as ft
import runpy
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from acausal import ArgumentError
from acausal.design import Explorer, serve

from ._output import ACTUATOR_NAMES
from ._own import task
from .actuators import ClutchActuator, ehs_maxon, ema_fise, ema_maxon, explorer, sila

ACTUATORS: Mapping[str, Callable[[], ClutchActuator]] = MappingProxyType(
    {"ema_maxon": ema_maxon, "ema_fise": ema_fise, "ehs_maxon": ehs_maxon, "sila": sila}
)


def choices(name: str | None = None) -> dict[str, Callable[[], Explorer[Any]]]:
    """The explorers of the app by name, each made when it is chosen; the named actuator or file comes first.

    Raises `ArgumentError` for an unknown name.
    """
    known = {ACTUATOR_NAMES[key]: _explorer_of(build) for key, build in ACTUATORS.items()}
    if name is None:
        return known
    if name in ACTUATORS:
        first = ACTUATOR_NAMES[name]
        return {first: known[first]} | known
    file = Path(name)
    if file.suffix not in (".toml", ".py") or not file.exists():
        raise ArgumentError(f"{name} is not an actuator or a file. Give {', '.join(ACTUATORS)}, FILE.toml or FILE.py.")
    return (_of_task(file) if file.suffix == ".toml" else _of_program(file)) | known


def _explorer_of(build: Callable[[], ClutchActuator]) -> Callable[[], Explorer[Any]]:
    return ft.cache(lambda: explorer(build()))


def _of_task(file: Path) -> dict[str, Callable[[], Explorer[Any]]]:
    """The actuator of a TOML file, as for `studies optimise`."""
    asked = task(file)
    made = explorer(asked.model, **asked.asked)
    return {file.name: lambda: made}


def _of_program(file: Path) -> dict[str, Callable[[], Explorer[Any]]]:
    """The explorers that a Python file defines, by the names of their variables."""
    found = {name: item for name, item in runpy.run_path(str(file)).items() if isinstance(item, Explorer)}
    if not found:
        raise ArgumentError(f"{file} defines no explorer, such as explorer = acausal.design.explore(model, ...).")
    return {f"{file.name}: {name}": ft.partial(lambda item: item, item) for name, item in found.items()}


def main(name: str | None = None, port: int = 0, browser: bool = True) -> None:
    """Serve the app until an interrupt."""
    app = serve(choices(name), port=port, browser=browser)
    print(f"The app is at {app.url} until you press Ctrl+C.", flush=True)
    try:
        app.wait()
    except KeyboardInterrupt:
        app.close()
