"""Choice of states by dummy derivatives."""

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .._errors import StructureError
from .incidence import Incidence
from .index import Reduced
from .nominal import nominal_size

SAFE = 0.05  # a pivot of this relative size is taken from the better-liked candidates before any larger one elsewhere
# Stand-ins for coefficients whose numbers are not known, by strength: what may vanish must not serve as a pivot.
_GENERIC = np.array([1e-3, 1e-2, 0.7, 1.0])


@dataclasses.dataclass
class Chosen:
    """`dummies[v]` is how many of the highest derivatives of variable v are algebraic; the orders below are states.

    A pair (variable, order) is a state where its derivative exists and is not a dummy.
    """

    reduced: Reduced
    dummies: np.ndarray

    def states(self) -> list[tuple[int, int]]:
        """(variable, order) of each state, variables in order of declaration."""
        orders, dummies = self.reduced.orders, self.dummies
        last = orders - dummies
        return [(v, k) for v in range(len(orders)) for k in range(int(last[v]))]


def select_states(reduced: Reduced, values: np.ndarray | None = None) -> Chosen:
    """Dummy derivatives (Mattsson and Söderlind, SIAM J. Sci. Comput. 14, 1993) with one static choice.

    In stage j the equations differentiated at least j times make as many derivatives algebraic, taken from those of
    stage j - 1. The choice is a Gaussian elimination on the coefficients of the highest derivatives: `values`, one
    number for each entry of the incidence at the initial point, or stand-ins by what is known of the coefficient, so
    that it depends on the classes alone. Avoided variables become dummies first, preferred ones last.
    """
    table = reduced.incidence
    dummies = np.zeros(table.n_variables, int)
    if not np.any(reduced.differentiations):
        return Chosen(reduced, dummies)
    top = table.matchable & (table.order + reduced.differentiations[table.row] == reduced.orders[table.variable])
    numbers = _generic(table) if values is None else values * nominals(table)[table.variable]
    candidates = reduced.orders >= 1
    for stage in range(1, int(reduced.differentiations.max()) + 1):
        candidates = candidates & (reduced.orders - stage + 1 >= 1)
        active = reduced.differentiations >= stage
        use = top & active[table.row] & candidates[table.variable]
        picked = _pick(reduced, table.row[use], table.variable[use], numbers[use], np.flatnonzero(active))
        candidates = np.zeros(table.n_variables, bool)
        candidates[picked] = True
        dummies[picked] += 1
    return Chosen(reduced, dummies)


def _generic(table: Incidence) -> np.ndarray:
    """Numbers that stand for unknown coefficients, different for each entry so that they do not cancel by accident."""
    spread = 1.0 + 0.3 * np.modf(0.6180339887 * (1.0 + np.arange(len(table.row))))[0]
    return np.where(table.strength == 3, table.number, _GENERIC[table.strength] * spread)


def nominals(table: Incidence) -> np.ndarray:
    """The nominal size of each variable: the one declared, else that of its unit."""
    return np.array([nominal_of(table, (variable, 0)) for variable in range(table.n_variables)])


def nominal_of(table: Incidence, pair: tuple[int, int]) -> float:
    """The nominal size of a variable, or of a derivative of it: as large over a typical time of a millisecond."""
    variable, order = pair
    declaration = table.flat.leaves[table.flat.leaf_of_node[table.variables[variable]]].declaration
    return nominal_size(declaration.unit, declaration.nominal) * 1e3**order


def _pick(
    reduced: Reduced, rows: np.ndarray, variables: np.ndarray, numbers: np.ndarray, active: np.ndarray
) -> list[int]:  # fmt: skip
    """As many variables as there are active equations, so that the square matrix between them is regular."""
    table = reduced.incidence
    n_rows = table.n_rows
    links = coo_array((np.ones(len(rows)), (rows, n_rows + variables)), shape=(n_rows + table.n_variables,) * 2)
    _, label = connected_components(links, directed=False)
    groups: dict[int, list[int]] = {}
    for row in active.tolist():
        groups.setdefault(int(label[row]), []).append(row)
    entries: dict[int, list[int]] = {}
    for entry, group in enumerate(label[rows].tolist()):
        entries.setdefault(group, []).append(entry)
    picked: list[int] = []
    for group, members in groups.items():
        chosen = np.array(entries.get(group, []), dtype=int)
        own = _Entries(rows[chosen], variables[chosen], numbers[chosen])
        peeled = _peel(reduced, members, own)
        rest = [row for row in members if row not in peeled]
        left = own.without(peeled)
        picked += [*peeled.values(), *_eliminate(reduced, rest, left.rows, left.variables, left.numbers)]
    return picked


class _Entries(NamedTuple):
    """Coefficients of constraints: one number for each (row, variable)."""

    rows: np.ndarray
    variables: np.ndarray
    numbers: np.ndarray

    def without(self, peeled: dict[int, int]) -> "_Entries":
        kept = ~(np.isin(self.rows, list(peeled)) | np.isin(self.variables, list(peeled.values())))
        return _Entries(self.rows[kept], self.variables[kept], self.numbers[kept])


def _peel(reduced: Reduced, members: list[int], entries: _Entries) -> dict[int, int]:
    """Constraints that have a variable to themselves, liked least of theirs as a state and safe to divide by.

    Taking them out needs no elimination, so that a long chain of constraints costs no more than its length.
    """
    of_row: dict[int, dict[int, float]] = {row: {} for row in members}
    users: dict[int, set[int]] = {}
    for row, variable, number in zip(*(part.tolist() for part in entries), strict=True):
        of_row[row][variable] = of_row[row].get(variable, 0.0) + number
        users.setdefault(variable, set()).add(row)
    peeled: dict[int, int] = {}
    queue = [variable for variable in users if len(users[variable]) == 1]
    while queue:
        variable = queue.pop(0)
        if len(users[variable]) != 1:
            continue
        (row,) = users[variable]
        row_entries = of_row[row]
        largest = max(abs(number) for number in row_entries.values())
        least = min(_reluctance(reduced, other) for other in row_entries)
        if _reluctance(reduced, variable) > least or abs(row_entries[variable]) <= SAFE * largest:
            continue
        peeled[row] = variable
        for other in row_entries:
            users[other].discard(row)
            if len(users[other]) == 1:
                queue.append(other)
    return peeled


def _eliminate(
    reduced: Reduced, members: list[int], rows: np.ndarray, variables: np.ndarray, numbers: np.ndarray
) -> list[int]:  # fmt: skip
    table = reduced.incidence
    columns = sorted(set(variables.tolist()))
    matrix = np.zeros((len(members), len(columns)))
    place_row = {row: i for i, row in enumerate(members)}
    place_column = {variable: i for i, variable in enumerate(columns)}
    for row, variable, number in zip(rows.tolist(), variables.tolist(), numbers.tolist(), strict=True):
        matrix[place_row[row], place_column[variable]] += number
    matrix /= np.maximum(np.max(np.abs(matrix), axis=1, keepdims=True, initial=0.0), 1e-300)
    keys = [_reluctance(reduced, variable) for variable in columns]
    free_rows, free_columns, picked = set(range(len(members))), set(range(len(columns))), []
    for threshold in (SAFE, 1e-12):
        for key in sorted(set(keys)):
            same = [c for c in range(len(columns)) if keys[c] == key]
            picked += _pivot(matrix, free_rows, [c for c in same if c in free_columns], free_columns, threshold)
    if free_rows:
        names = ", ".join(table.row_name(members[i]) for i in sorted(free_rows))
        raise StructureError(
            f"No states can be chosen: at the start values, the constraints {names} do not determine a derivative. "
            "They contradict or repeat others, or the mechanism starts in a singular position; change the start values."
        )
    return [columns[c] for c in picked]


def _reluctance(reduced: Reduced, variable: int) -> tuple[int, int]:
    """Sort key: variables that become dummies first have the smallest."""
    flat = reduced.incidence.flat
    leaf = flat.leaf_of_node[reduced.incidence.variables[variable]]
    return flat.leaves[leaf].declaration.select, -int(reduced.orders[variable])


def _pivot(
    matrix: np.ndarray, free_rows: set[int], columns: list[int], free_columns: set[int], threshold: float
) -> list[int]:
    """Eliminate with pivots from `columns` while they are larger than `threshold`; later columns go first on a tie."""
    picked: list[int] = []
    while columns and free_rows:
        rows = sorted(free_rows)
        block = np.abs(matrix[np.ix_(rows, columns)])
        scale = np.maximum(np.max(np.abs(matrix[rows]), axis=1, keepdims=True), 1e-300)
        relative = block / scale
        row, reverse = np.unravel_index(np.argmax(np.round(relative, 9)[:, ::-1]), relative.shape)
        column = len(columns) - 1 - int(reverse)
        if relative[row, column] <= threshold or block[row, column] <= 1e-12:
            return picked
        r, c = rows[int(row)], columns[column]
        free_rows.remove(r)
        for other in free_rows:
            matrix[other] -= matrix[other, c] / matrix[r, c] * matrix[r]
        free_columns.remove(c)
        columns = [item for item in columns if item != c]
        picked.append(c)
    return picked
