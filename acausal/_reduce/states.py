"""Choice of states by dummy derivatives."""

import dataclasses
from typing import Any, NamedTuple

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
    # With a number for a coefficient, such as 1, no parameter is divided by.
    liking = np.where((table.strength == 3) | (values is None), 1.0, SAFE)
    candidates = reduced.orders >= 1
    for stage in range(1, int(reduced.differentiations.max()) + 1):
        candidates = candidates & (reduced.orders - stage + 1 >= 1)
        active = reduced.differentiations >= stage
        use = top & active[table.row] & candidates[table.variable]
        entries = _Entries(table.row[use], table.variable[use], numbers[use], liking[use])
        picked = _pick(reduced, entries, np.flatnonzero(active))
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


class _Entries(NamedTuple):
    """Coefficients of constraints: one number for each (row, variable), and how much it is liked as a pivot."""

    rows: np.ndarray
    variables: np.ndarray
    numbers: np.ndarray
    liking: np.ndarray

    def where(self, kept: Any) -> "_Entries":
        return _Entries(*(part[kept] for part in self))

    def without(self, peeled: dict[int, int]) -> "_Entries":
        return self.where(~(np.isin(self.rows, list(peeled)) | np.isin(self.variables, list(peeled.values()))))


def _pick(reduced: Reduced, entries: _Entries, active: np.ndarray) -> list[int]:
    """As many variables as there are active equations, so that the square matrix between them is regular."""
    n_rows, n_variables = reduced.incidence.n_rows, reduced.incidence.n_variables
    ends = (entries.rows, n_rows + entries.variables)
    links = coo_array((np.ones(len(entries.rows)), ends), shape=(n_rows + n_variables,) * 2)
    _, label = connected_components(links, directed=False)
    groups: dict[int, list[int]] = {}
    for row in active.tolist():
        groups.setdefault(int(label[row]), []).append(row)
    places: dict[int, list[int]] = {}
    for place, group in enumerate(label[entries.rows].tolist()):
        places.setdefault(group, []).append(place)
    picked: list[int] = []
    for group, members in groups.items():
        own = entries.where(np.array(places.get(group, []), dtype=int))
        peeled = _peel(reduced, members, own)
        rest = [row for row in members if row not in peeled]
        picked += [*peeled.values(), *_eliminate(reduced, rest, own.without(peeled))]
    return picked


def _peel(reduced: Reduced, members: list[int], entries: _Entries) -> dict[int, int]:
    """Constraints that have a variable to themselves, liked least of theirs as a state and safe to divide by.

    Taking them out needs no elimination, so that a long chain of constraints costs no more than its length.
    """
    of_row: dict[int, dict[int, float]] = {row: {} for row in members}
    users: dict[int, set[int]] = {}
    for row, variable, number, _ in zip(*(part.tolist() for part in entries), strict=True):
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


def _eliminate(reduced: Reduced, members: list[int], entries: _Entries) -> list[int]:
    columns = sorted(set(entries.variables.tolist()))
    matrix, liking = np.zeros((len(members), len(columns))), np.ones((len(members), len(columns)))
    place_row = {row: i for i, row in enumerate(members)}
    place_column = {variable: i for i, variable in enumerate(columns)}
    for row, variable, number, liked in zip(*(part.tolist() for part in entries), strict=True):
        place = place_row[row], place_column[variable]
        matrix[place] += number
        liking[place] = min(liking[place], liked)
    matrix /= np.maximum(np.max(np.abs(matrix), axis=1, keepdims=True, initial=0.0), 1e-300)
    keys = [_reluctance(reduced, variable) for variable in columns]
    work = _Elimination(matrix, liking, set(range(len(members))), set(range(len(columns))))
    picked: list[int] = []
    for threshold in (SAFE, 1e-12):
        for key in sorted(set(keys)):
            picked += work.pivot([c for c in range(len(columns)) if keys[c] == key and c in work.columns], threshold)
    if work.rows:
        names = ", ".join(reduced.incidence.row_name(members[i]) for i in sorted(work.rows))
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


@dataclasses.dataclass
class _Elimination:
    """Gaussian elimination under way: `rows` and `columns` are those not used yet."""

    matrix: np.ndarray
    liking: np.ndarray
    rows: set[int]
    columns: set[int]

    def pivot(self, columns: list[int], threshold: float) -> list[int]:
        """Eliminate with pivots from `columns` while larger than `threshold`; of equals, the last goes first."""
        picked: list[int] = []
        while columns and self.rows:
            rows = sorted(self.rows)
            block = np.abs(self.matrix[np.ix_(rows, columns)])
            relative = block / np.maximum(np.max(np.abs(self.matrix[rows]), axis=1, keepdims=True), 1e-300)
            fit = (relative > threshold) & (block > 1e-12)
            if not np.any(fit):
                return picked
            score = np.round(np.where(fit, relative * self.liking[np.ix_(rows, columns)], 0.0), 9)
            row, reverse = np.unravel_index(np.argmax(score[:, ::-1]), score.shape)
            r, c = rows[int(row)], columns[len(columns) - 1 - int(reverse)]
            self._use(r, c)
            columns = [item for item in columns if item != c]
            picked.append(c)
        return picked

    def _use(self, row: int, column: int) -> None:
        self.rows.remove(row)
        self.columns.remove(column)
        for other in self.rows:
            factor = self.matrix[other, column] / self.matrix[row, column]
            if factor:
                self.matrix[other] -= factor * self.matrix[row]
                # What an elimination with a parameter leaves behind holds that parameter.
                least = min(self.liking[other, column], self.liking[row, column])
                touched = self.matrix[row] != 0
                mixed = np.minimum(np.minimum(self.liking[other], self.liking[row]), least)
                self.liking[other] = np.where(touched, mixed, self.liking[other])
