"""A user's actuator from the command line: parts, changed parameters, and optimisation problem."""

import dataclasses
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from acausal import ArgumentError, quantity, replace
from acausal.design import Design
from components.catalogues import COLUMNS, DataSheet, catalogue, load

from .actuators import ClutchActuator, electrohydraulic, electromechanical, optimum

BUILD: Mapping[str, Callable[..., ClutchActuator]] = {
    "electromechanical": electromechanical,
    "electrohydraulic": electrohydraulic,
}
ASKED = ("minimise", "limits", "free", "temperatures", "set")
TABLES = {"motor": "motors", "gearhead": "gearheads", "pump": "pumps"}  # catalogue of each kind of part


@dataclasses.dataclass(frozen=True)
class Task:
    """An actuator and the arguments of `optimum`."""

    model: ClutchActuator
    asked: Mapping[str, Any]

    def solve(self, rtol: float) -> Design[Any]:
        return optimum(self.model, rtol=rtol, **self.asked)


def task(
    file: Path | None = None,
    motor: str | None = None,
    changes: Sequence[str] = (),
    temperatures: Sequence[float] = (),
) -> Task:
    """The task of a TOML file, with the changes of the other arguments.

    The file contains `concept = "electromechanical"` or `"electrohydraulic"`, arguments of that function, such as
    `motor`, `gearhead` and `voltage`, and arguments of `optimum`: `minimise`, `limits`, `free`, `temperatures`. Its
    table `set` contains parameters by path. Numbers are in SI units, strings have a unit: `"19 mm"`. A part is an order
    name of the catalogues or a CSV file in the folder of the TOML file, `"FILE.csv"` or `"FILE.csv:ORDER"`. Without a
    file, the concept is electromechanical with a gearhead of 4.3:1.
    """
    given = {"concept": "electromechanical", "gearhead": 4.3} if file is None else _read(file)
    folder = Path() if file is None else file.parent
    concept = given.pop("concept", None)
    if concept not in BUILD:
        raise ArgumentError(f"concept must be {' or '.join(BUILD)}, got {concept!r}.")
    asked: dict[str, Any] = {name: given.pop(name) for name in ASKED if name in given}
    if motor is not None:
        given["motor"] = motor
    if "motor" not in given:
        raise ArgumentError("A motor is required: --motor FILE.csv or an order name, or `motor` in the TOML file.")
    where = {"motor": Path() if motor is not None else folder}
    parts = {name: _value(name, value, where.get(name, folder)) for name, value in given.items()}
    try:
        model = BUILD[concept](**parts)
    except TypeError as error:
        raise ArgumentError(f"{concept} cannot be built: {error}.") from error
    changed = asked.pop("set", {}) | dict(_change(text) for text in changes)
    if temperatures:
        asked["temperatures"] = list(temperatures)
    if "free" in asked:
        asked["free"] = {path: tuple(bounds) for path, bounds in asked["free"].items()}
    return Task(replace(model, {path: _number(value) for path, value in changed.items()}), asked)


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ArgumentError(f"{file} cannot be read: {error.strerror}.") from error
    except tomllib.TOMLDecodeError as error:
        raise ArgumentError(f"{file} is not a valid TOML file: {error}.") from error


def _change(text: str) -> tuple[str, str]:
    path, equals, value = text.partition("=")
    if not equals:
        raise ArgumentError(f"--set takes PATH=VALUE, as in supply.V=12, got {text!r}.")
    return path.strip(), value.strip()


def _value(name: str, value: Any, folder: Path) -> Any:
    """An argument of an actuator: a part, or a number."""
    if name in TABLES and isinstance(value, str):
        return _sheet(TABLES[name], value, folder)
    if isinstance(value, list):
        return tuple(_number(one) for one in value)
    return value if isinstance(value, bool) else _number(value)


def _sheet(table: str, text: str, folder: Path) -> DataSheet:
    """The data sheet of an order name or of a file."""
    name, _, order = text.partition(":")
    if not name.endswith(".csv"):
        return catalogue(table)[text]
    file = folder / name
    if not file.exists():
        raise ArgumentError(f"{file} does not exist.")
    sheets = load(file, COLUMNS[table])
    if order:
        return sheets[order]
    if len(sheets) != 1:
        names = ", ".join(sheet.order for sheet in sheets)
        raise ArgumentError(f"{file} has {len(sheets)} rows: choose one, as in {text}:ORDER. The rows are {names}.")
    return sheets[0]


def _number(value: Any) -> Any:
    """A number in SI units, or a quantity from a string with a unit."""
    if not isinstance(value, str):
        return value
    number, _, unit = value.strip().partition(" ")
    try:
        plain = float(number)
    except ValueError as error:
        raise ArgumentError(
            f"A value must be a number or a number with a unit, as in '12 V', got {value!r}."
        ) from error
    return quantity(plain, unit.strip()) if unit else plain
