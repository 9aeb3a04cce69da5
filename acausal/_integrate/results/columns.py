"""Columns for plots and exports of a solution: variables and expressions, each with a label and a unit."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax
import numpy as np
from jax import Array

from ..._errors import ModelError
from ..._extras import DataFrame, Dataset, needed
from ..._units.quantity import magnitude, quantity
from ..setup.expressions import expression, shown_unit, unit_of_expression, varies

if TYPE_CHECKING:
    from .solution import Solution

# The path of a variable, a function of the variables, or a mapping from labels to paths and functions.
Item: TypeAlias = str | Callable[[Any], Any] | Mapping[str, str | Callable[[Any], Any]]


class Column(NamedTuple):
    """The values of a variable or expression at the saved times."""

    label: str
    unit: str
    values: np.ndarray


def columns(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> list[Column]:
    """The columns of the items, in the wanted units. Without items, the columns of all variables."""
    if solution.is_batched:
        raise ModelError("The solution is a batch: select one run with jax.tree_util.tree_map(lambda x: x[i], sol).")
    if isinstance(units, str):
        raise ModelError(f"units={units!r}: pass a list of units, as in units=[{units!r}].")
    named = list(_named(items)) if items else [(name, name) for name in variables(solution)]
    labels = Counter(label for label, _ in named)
    if twice := [label for label, count in labels.items() if count > 1]:
        raise ModelError(f"There are two columns {twice[0]!r}: label them, as in {{'power': lambda s: s.r.v * s.r.i}}.")
    leaves = jax.tree_util.tree_leaves(solution.values)
    return [_column(solution, leaves, label, what, units) for label, what in named]


def variables(solution: "Solution") -> list[str]:
    """The paths of everything except parameters."""
    leaves = solution.system.flat.leaves
    return [
        name for name, (leaf, _) in solution.system.flat.leaf_names.items() if leaves[leaf].declaration.role != "param"
    ]


def _named(items: Sequence[Item]) -> Iterator[tuple[str, str | Callable[[Any], Any]]]:
    for item in items:
        if isinstance(item, Mapping):
            yield from item.items()
        elif isinstance(item, list | tuple):
            raise ModelError(f"Pass items one by one, not in a {type(item).__name__}, got {item!r}.")
        else:
            yield item if isinstance(item, str) else _name(item), item


def _name(function: Callable[[Any], Any]) -> str:
    name = getattr(function, "__name__", "<lambda>")
    return "expression" if name == "<lambda>" else name


def _column(
    solution: "Solution", leaves: list[Array], label: str, what: str | Callable[[Any], Any], units: Sequence[str]
) -> Column:
    flat, times = solution.system.flat, np.shape(solution.ts)
    if isinstance(what, str):
        values, unit = solution._pick(leaves, what), solution.unit(what)
        values = values if varies(flat, solution._place(what)[0]) else np.broadcast_to(values, times + np.shape(values))
    else:
        values, unit = expression(flat, leaves, times, what), unit_of_expression(what, flat)
    wanted = shown_unit(unit, units)
    values = np.asarray(values)
    return Column(label, wanted, values if wanted == unit else magnitude(quantity(values, unit), wanted, label))


def to_pandas(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> DataFrame:
    """See `Solution.to_pandas`."""
    pd = needed("pandas", "tables", "to_pandas()")
    found = [column for column in columns(solution, items, units) if column.values.ndim == 1]
    frame = pd.DataFrame(
        {column.label: column.values for column in found}, index=pd.Index(np.asarray(solution.ts), name="t")
    )
    frame.attrs["units"] = {"t": "s"} | {column.label: column.unit for column in found}
    return frame


def to_xarray(solution: "Solution", items: Sequence[Item], units: Sequence[str]) -> Dataset:
    """See `Solution.to_xarray`."""
    xr = needed("xarray", "tables", "to_xarray()")
    found = {}
    for label, unit, values in columns(solution, items, units):
        if label == "t":
            raise ModelError("A column 't' has the name of the time axis: label it, as in {'time': 't'}.")
        dims = ["t", *(f"{label}_{i}" for i in range(values.ndim - 1))]
        found[label] = xr.Variable(dims, values, {"units": unit})
    return xr.Dataset(found, coords={"t": xr.Variable("t", np.asarray(solution.ts), {"units": "s"})})
