"""Tables of alternatives and all their combinations: values by path, and figures outside the model."""

import dataclasses
import functools as ft
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float, Int

from ..._declare.component import Component
from ..._errors import ModelError, ParameterError
from ..._numbers import Scalar
from .._problem.free import Free
from .._problem.free_parameters import free_parameters
from .._problem.types import Function, Key, number_in
from .._sweep.sweep import MOST, listed

M = TypeVar("M", bound=Component)
Figures = Mapping[str, Mapping[str, object]]  # by table and by name


class Alternatives(NamedTuple):
    """A table: names of its rows, their values by path, as `given` and as numbers, and their figures."""

    title: str
    names: tuple[str, ...]
    paths: tuple[Key, ...]
    given: tuple[Mapping[Key, object], ...]
    x: Float[np.ndarray, "n k"]
    figure_names: tuple[str, ...]
    figures: Float[np.ndarray, "n f"]


@dataclasses.dataclass(frozen=True)
class CatalogueVariables(Free):
    """Variables of a combination: values by path, followed by figures."""

    figures: tuple[tuple[str, str], ...]  # table and name of each

    @property
    def names(self) -> tuple[str, ...]:
        """The paths of the values, then table and name of the figures."""
        return super().names + tuple(f"{table}: {name}" for table, name in self.figures)

    def values(self, model: Component) -> Float[np.ndarray, " n"]:
        """The values in a model in the declared units, with zeros for the figures."""
        return np.concatenate([super().values(model), np.zeros(len(self.figures))])

    def with_values(self, model: Any, x: Any) -> Any:
        """A copy of the model with other values, and the figures by table."""
        n = len(self.variables)
        found: dict[str, dict[str, Scalar]] = {}
        for (table, name), value in zip(self.figures, x[n:], strict=True):
            found.setdefault(table, {})[name] = value
        return super().with_values(model, x[:n]), found


@dataclasses.dataclass(frozen=True, eq=False)
class DesignSpace(Generic[M]):
    """A model with its tables and all combinations of their rows, the last table varying fastest."""

    name: str
    model: M
    tables: tuple[Alternatives, ...]
    variables: CatalogueVariables
    picked: Int[np.ndarray, "n t"]  # row of each table
    x: Float[np.ndarray, "n k"]  # values followed by figures

    def named(self, i: int) -> dict[str, str]:
        """The names of the alternatives of a combination, by table."""
        return {table.title: table.names[row] for table, row in zip(self.tables, self.picked[i], strict=True)}

    def of(self, i: int) -> tuple[M, Figures]:
        """The model and the figures of a combination."""
        return self.variables.with_values(self.model, self.x[i].tolist())

    def span(self, path: Key) -> tuple[object, object]:
        """The smallest and the largest value of a path in the tables, with their units."""
        for table in self.tables:
            if path in table.paths:
                column = table.x[:, table.paths.index(path)]
                return table.given[np.argmin(column)][path], table.given[np.argmax(column)][path]
        known = ", ".join(str(path) for table in self.tables for path in table.paths)
        raise ModelError(f"The tables have no {path!r}, but {known}.")


def design_space(name: str, model: M, tables: Mapping[str, object]) -> DesignSpace[M]:
    """All combinations of tables. Raises `ModelError` or `ParameterError` for invalid tables."""
    if not isinstance(tables, Mapping) or not tables:
        raise ModelError(f"tables must be a dictionary of at least one table, got {tables!r}.")
    found = tuple(_alternatives(model, title, table) for title, table in tables.items())
    paths = [path for table in found for path in table.paths]
    if twice := [path for path in paths if paths.count(path) > 1]:
        raise ModelError(f"{twice[0]} is in two tables. Keep it in one of them.")
    n = math.prod(len(table.names) for table in found)
    if n > MOST:
        raise ModelError(f"{n} combinations are too many. Leave out alternatives that cannot win.")
    picked = np.indices([len(table.names) for table in found]).reshape(len(found), -1).T
    free = free_parameters(model, dict.fromkeys(paths)).variables if paths else ()
    variables = CatalogueVariables(free, tuple((table.title, name) for table in found for name in table.figure_names))
    columns = [table.x[rows] for table, rows in zip(found, picked.T, strict=True)]
    columns += [table.figures[rows] for table, rows in zip(found, picked.T, strict=True)]
    return DesignSpace(name, model, found, variables, picked, np.concatenate(columns, axis=1))


def _alternatives(model: Component, title: str, table: Any) -> Alternatives:
    rows = table.to_dict("records") if hasattr(table, "to_dict") else list(table)
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        raise ModelError(f"{title}: a table must be a list of dictionaries with values by path, got {table!r}.")
    values = [{key: value for key, value in row.items() if key not in ("name", "figures")} for row in rows]
    names = tuple(
        str(row.get("name", "") or ", ".join(map(_label, value.values())))
        for row, value in zip(rows, values, strict=True)
    )
    doubled = [name for i, name in enumerate(names) if name in names[:i]]
    if doubled:
        raise ModelError(f"{title}: two rows have the name {doubled[0]!r}. Give each row a name of its own.")
    x = listed(model, values).x if any(values) else np.zeros((len(rows), 0))
    figure_names, figures = _figures(title, names, [row.get("figures", {}) for row in rows])
    return Alternatives(title, names, tuple(values[0]), tuple(values), x, figure_names, figures)


def _figures(title: str, names: Sequence[str], rows: Sequence[Any]) -> tuple[tuple[str, ...], np.ndarray]:
    for name, row in zip(names, rows, strict=True):
        if not isinstance(row, Mapping) or row.keys() != rows[0].keys():
            raise ModelError(
                f"{title}, {name}: figures must be a dictionary with the names of the first row, got {row!r}."
            )
    found = np.array(
        [
            [number_in(value, "", f"{title}, {name}: {key}")[0] for key, value in row.items()]
            for name, row in zip(names, ({key: row[key] for key in rows[0]} for row in rows), strict=True)
        ]
    ).reshape(len(rows), len(rows[0]))
    if np.any(np.isnan(found)):
        i, j = np.argwhere(np.isnan(found))[0]
        raise ParameterError(f"{title}, {names[i]}: the figure {list(rows[0])[j]} is not a number. State it, or inf.")
    return tuple(rows[0]), found


def _label(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def run_of_pair(run: Function, pair: tuple[Any, Figures]) -> tuple[Any, Figures]:
    """The run of a model, with its figures."""
    model, figures = pair
    return run(model), figures


def on_pair(function: Callable[..., Any]) -> Callable[[tuple[Any, Figures]], Any]:
    """A function of a run, or of a run and figures, as a function of the pair (run, figures)."""
    needed = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
    takes_two = sum(p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) for p in needed) == 2
    return ft.partial(_on_first, function, 2 if takes_two else 1)


def _on_first(function: Callable[..., Any], n: int, pair: tuple[Any, Figures]) -> Any:
    return function(*pair[:n])


def with_figures(function: Callable[..., Any], figures: Figures) -> Function:
    """A function of the run alone, with the figures of a combination."""
    return lambda run: on_pair(function)((run, figures))
