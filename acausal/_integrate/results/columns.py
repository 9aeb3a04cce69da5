"""Columns for plots and exports of a solution: variables and expressions, each with a label and a unit."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax
import numpy as np
from jax import Array

from ..._declare.annotations import indices
from ..._declare.component import Component
from ..._declare.fields import join
from ..._declare.node import nodes_of
from ..._errors import ModelError
from ..._extras import DataFrame, Dataset, needed
from ..._units.quantity import from_si, magnitude, quantity
from ..setup.expressions import expression, shown_unit, unit_of_expression, varies

if TYPE_CHECKING:
    from .solution import Solution

# A variable or an expression: the path of a variable, a function of the variables, or either with its unit.
Quantity: TypeAlias = str | Callable[[Any], Any] | tuple[str | Callable[[Any], Any], str]
Item: TypeAlias = Quantity | Mapping[str, Quantity]  # a mapping gives labels


class Column(NamedTuple):
    """The values of a variable or expression at the saved times."""

    label: str
    unit: str
    values: np.ndarray
    names: Mapping[float, str] | None = None  # of the values of a discrete variable
    counts_from_1: bool = False  # names of elements, as in Modelica

    def curves(self, label: str) -> Iterator[tuple[str, np.ndarray]]:
        """Each element with its label: an array variable has one curve for each."""
        for place in np.ndindex(self.values.shape[1:]):
            yield label + indices(place, counts_from_1=self.counts_from_1), self.values[(slice(None), *place)]


def columns(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> list[Column]:
    """The columns of the items, in the wanted units. Without items, the columns of all variables."""
    if solution.is_batched:
        raise ModelError("The solution is a batch: select one run with jax.tree_util.tree_map(lambda x: x[i], sol).")
    if isinstance(units, str):
        raise ModelError(f"units={units!r}: pass a list of units, as in units=[{units!r}].")
    named = list(_named(items)) if items else [(name, name, "") for name in variables(solution)]
    labels = Counter(label for label, *_ in named)
    if twice := [label for label, count in labels.items() if count > 1]:
        raise ModelError(f"There are two columns {twice[0]!r}: label them, as in {{'power': lambda s: s.r.v * s.r.i}}.")
    leaves, modes = jax.tree_util.tree_leaves(solution.values), named_modes(solution)
    return [_column(solution, leaves, modes, label, what, unit, units) for label, what, unit in named]


def variables(solution: "Solution") -> list[str]:
    """The paths of everything except parameters."""
    leaves = solution.system.flat.leaves
    return [
        name for name, (leaf, _) in solution.system.flat.leaf_names.items() if leaves[leaf].declaration.role != "param"
    ]


def named_modes(solution: "Solution") -> dict[str, Mapping[float, str]]:
    """The discrete variables whose class names their values, by path, with these names."""
    structure = solution.system.flat.structure
    parts = [(path, type(part)) for path, part in nodes_of(structure.unflatten(range(structure.num_leaves)))]
    return {
        join(path, name): names
        for path, cls in parts
        if issubclass(cls, Component)
        for name, names in cls.mode_names.items()
        if join(path, name) in solution
    }


def _named(items: Sequence[Item]) -> Iterator[tuple[str, str | Callable[[Any], Any], str]]:
    """The label, the path or function, and the wanted unit, if there is one, of each quantity."""
    for item in items:
        if isinstance(item, Mapping):
            yield from ((label, *_with_unit(quantity)) for label, quantity in item.items())
        else:
            what, unit = _with_unit(item)
            yield what if isinstance(what, str) else _name(what), what, unit


def _with_unit(item: object) -> tuple[Any, str]:
    what, unit = item if isinstance(item, tuple) and len(item) == 2 else (item, "")
    if isinstance(what, list):
        raise ModelError(f"Pass items one by one, not in a list, got {what!r}.")
    if isinstance(what, tuple) or not isinstance(unit, str):
        raise ModelError(f"An item is a path or a function, or a pair of one and its unit, got {item!r}.")
    return what, unit


def _name(function: Callable[[Any], Any]) -> str:
    name = getattr(function, "__name__", "<lambda>")
    return "expression" if name == "<lambda>" else name


def _column(
    solution: "Solution",
    leaves: list[Array],
    modes: Mapping[str, Mapping[float, str]],
    label: str,
    what: str | Callable[[Any], Any],
    wanted: str,
    units: Sequence[str],
) -> Column:
    flat, times, names, counts_from_1 = solution.system.flat, np.shape(solution.ts), None, False
    if isinstance(what, str):
        values, unit, number = solution._pick(leaves, what), solution.unit(what), solution._place(what)[0]
        values = values if varies(flat, number) else np.broadcast_to(values, times + np.shape(values))
        names, counts_from_1 = modes.get(what), flat.leaves[number].declaration.counts_from_1
    else:
        values, unit = expression(flat, leaves, times, what), unit_of_expression(what, flat)
    values, shown = np.asarray(values), wanted or shown_unit(unit, units)
    if shown != unit:  # a quantity without a known unit is in SI units
        names = None
        values = magnitude(quantity(values, unit), shown, label) if unit else from_si(values, shown, label)
    return Column(label, shown, values, names, counts_from_1)


def to_pandas(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> DataFrame:
    """See `Solution.to_pandas`."""
    pd = needed("pandas", "tables", "to_pandas()")
    found = [(*one, column.unit) for column in columns(solution, items, units) for one in column.curves(column.label)]
    frame = pd.DataFrame(
        {label: values for label, values, _ in found}, index=pd.Index(np.asarray(solution.ts), name="t")
    )
    frame.attrs["units"] = {"t": "s"} | {label: unit for label, _, unit in found}
    return frame


def to_xarray(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> Dataset:
    """See `Solution.to_xarray`."""
    xr = needed("xarray", "tables", "to_xarray()")
    found = {}
    for label, unit, values, *_ in columns(solution, items, units):
        if label == "t":
            raise ModelError("A column 't' has the name of the time axis: label it, as in {'time': 't'}.")
        dims = ["t", *(f"{label}_{i}" for i in range(values.ndim - 1))]
        found[label] = xr.Variable(dims, values, {"units": unit})
    return xr.Dataset(found, coords={"t": xr.Variable("t", np.asarray(solution.ts), {"units": "s"})})
