"""Choice of states by dummy derivatives."""

import dataclasses
from typing import NamedTuple

import numpy as np

from .._declare.annotations import never
from .._errors import StructureError
from .graph import sharing
from .incidence import Incidence, Pair
from .index import Reduced


class Entries(NamedTuple):
    """Coefficients of constraints: one number for each (row, variable), and its preference as a pivot.

    A `safe` one cannot vanish during a run, a `steady` one is constant. Numbers that are not `known` are stand-ins.
    """

    rows: np.ndarray
    variables: np.ndarray
    numbers: np.ndarray
    liking: np.ndarray
    safe: np.ndarray
    steady: np.ndarray
    known: np.ndarray

    def where(self, kept: np.ndarray) -> "Entries":
        return Entries(*(part[kept] for part in self))

    def without(self, peeled: dict[int, int]) -> "Entries":
        return self.where(~(np.isin(self.rows, list(peeled)) | np.isin(self.variables, list(peeled.values()))))


def connected_rows(entries: Entries, rows: list[int]) -> list[tuple[list[int], Entries]]:
    """Sets of rows that share variables, each with all its entries."""
    sets, label = sharing(rows, entries.rows, entries.variables)
    order = np.argsort(label, kind="stable")
    bounds = np.searchsorted(label[order], np.arange(len(sets) + 1))
    return [(members, entries.where(order[bounds[g] : bounds[g + 1]])) for g, members in enumerate(sets)]


class Elimination:
    """State of a Gaussian elimination: `rows` and `columns` are the unused ones."""

    def __init__(self, n_rows: int, n_columns: int) -> None:
        self.matrix, self.liking = np.zeros((n_rows, n_columns)), np.ones((n_rows, n_columns))
        self.safe, self.steady = np.ones((n_rows, n_columns), bool), np.ones((n_rows, n_columns), bool)
        self.rows, self.columns = set(range(n_rows)), set(range(n_columns))

    def put(self, row: int, column: int, number: float, liking: float, safe: bool, steady: bool) -> None:
        place = row, column
        self.matrix[place] += number
        self.liking[place] = min(self.liking[place], liking)
        self.safe[place] &= safe
        self.steady[place] &= steady

    def pivot(self, columns: list[int], threshold: float, any_pivot: bool) -> list[int]:
        """Eliminate with pivots from `columns` larger than `threshold`; among equal ones, the last goes first."""
        picked: list[int] = []
        while columns and self.rows:
            rows = sorted(self.rows)
            inside = np.ix_(rows, columns)
            block = np.abs(self.matrix[inside])
            relative = block / np.maximum(np.max(np.abs(self.matrix[rows]), axis=1, keepdims=True), 1e-300)
            fit = (relative > threshold) & (block > 1e-12) & (self.safe[inside] | any_pivot)
            if not np.any(fit):
                return picked
            score = np.round(np.where(fit, relative * self.liking[inside], 0.0), 9)
            row, reverse = np.unravel_index(np.argmax(score[:, ::-1]), score.shape)
            r, c = rows[int(row)], columns[len(columns) - 1 - int(reverse)]
            self._use(r, c)
            columns = [item for item in columns if item != c]
            picked.append(c)
        return picked

    def _use(self, row: int, column: int) -> None:
        self.rows.remove(row)
        self.columns.remove(column)
        touched = self.matrix[row] != 0
        for other in self.rows:
            factor = self.matrix[other, column] / self.matrix[row, column]
            if factor:
                self.matrix[other] -= factor * self.matrix[row]
                # New coefficients are computed from four old ones and get the lowest preference of these.
                least = min(self.liking[other, column], self.liking[row, column])
                mixed = np.minimum(np.minimum(self.liking[other], self.liking[row]), least)
                self.liking[other] = np.where(touched, mixed, self.liking[other])
                steady = self.steady[other] & self.steady[row] & self.steady[other, column] & self.steady[row, column]
                self.steady[other] = np.where(touched, steady, self.steady[other])
                # A difference of safe coefficients may vanish. A new one is safe only if it is steady: it
                # keeps its present value.
                self.safe[other] = np.where(touched, steady, self.safe[other])


SAFE = 0.05  # relative size of a good pivot; among those, the preference of the variable decides
# Stand-ins for unknown coefficients, by strength: a coefficient that may vanish must not be a pivot.
_GENERIC = np.array([1e-3, 1e-2, 0.7, 1.0])


@dataclasses.dataclass
class Chosen:
    """Choice of states: `dummies[v]` of the highest derivatives of variable v are algebraic; lower orders are states.

    A pair (variable, order) is a state if its derivative exists and is not a dummy. `moving` marks the equations
    without a choice that is good in every position: all their variables are states, and they are invariants.
    """

    reduced: Reduced
    dummies: np.ndarray
    moving: np.ndarray

    def states(self) -> list[Pair]:
        """(variable, order) of each state, variables in order of declaration."""
        orders, dummies = self.reduced.orders, self.dummies
        last = orders - dummies
        return [(v, k) for v in range(len(orders)) for k in range(int(last[v]))]


def select_states(reduced: Reduced, values: np.ndarray | None = None) -> Chosen:
    """Dummy derivatives (Mattsson and Söderlind, SIAM J. Sci. Comput. 14, 1993), or all candidates as states.

    In stage j, the equations differentiated at least j times make equally many derivatives algebraic, out of those of
    stage j - 1. The choice is a Gaussian elimination on the coefficients of the highest derivatives: `values`, one
    number for each entry of the incidence at the initial point, or stand-ins for unknown coefficients, so
    that it depends on the classes alone. Avoided variables become dummies first, preferred ones last.

    A pivot must not vanish during the run. If connected constraints offer no such pivots, all their variables become
    states, and the run is projected onto the constraints (Eich, SIAM J. Numer. Anal. 30, 1993), unless variables that
    are declared `never` force a choice.

    Raises `StructureError` if no states can be chosen except some that are declared `never`.
    """
    table = reduced.incidence
    chosen = Chosen(reduced, np.zeros(table.n_variables, int), np.zeros(table.n_rows, bool))
    if np.any(reduced.differentiations):
        entries = _entries(reduced, values)
        active = np.flatnonzero(reduced.differentiations).tolist()
        known: dict[tuple, _Choice] = {}
        for members, own in connected_rows(entries, active):
            _select_group(chosen, members, _with_generic_values(own), known)
    _check_never(chosen)
    return chosen


def _entries(reduced: Reduced, values: np.ndarray | None) -> Entries:
    """The coefficients of the highest derivatives in the differentiated equations."""
    table = reduced.incidence
    known = (table.strength == 3) | (values is not None)
    stand_ins = np.where(table.strength == 3, table.number, _GENERIC[table.strength])
    numbers = stand_ins if values is None else values * table.sizes[table.variable]
    # A constant coefficient, such as 1, avoids a division by a parameter.
    liking = np.where((table.strength == 3) | (values is None), 1.0, SAFE)
    top = table.matchable & (table.order + reduced.differentiations[table.row] == reduced.orders[table.variable])
    use = top & (reduced.differentiations[table.row] > 0) & (reduced.orders[table.variable] > 0)
    safe = (table.strength >= 2) | table.steady
    return Entries(
        table.row[use], table.variable[use], numbers[use], liking[use], safe[use], table.steady[use], known[use]
    )  # fmt: skip


_Choice = tuple[list[np.ndarray], np.ndarray]  # picked variables of each stage and remaining rows, by position


def _select_group(chosen: Chosen, members: list[int], entries: Entries, known: dict[tuple, _Choice]) -> None:
    """The dummies of one connected set of constraints, stage by stage. Equal sets, in `known`, get equal choices."""
    reduced, rows, variables = chosen.reduced, np.array(members), np.unique(entries.variables)
    places = np.searchsorted(rows, entries.rows), np.searchsorted(variables, entries.variables)
    parts = (
        *places,
        *entries[2:],
        reduced.differentiations[rows],
        reduced.orders[variables],
        reduced.incidence.selects[variables],
    )
    key = tuple(part.tobytes() for part in parts)
    if key not in known:
        picks, left = _stages(reduced, members, entries, only_safe=True)
        if left and _keeps_unwanted(reduced, entries, picks):
            picks, left = _stages(reduced, members, entries, only_safe=False)
        found = [np.searchsorted(variables, np.array(stage, int)) for stage in picks]
        known[key] = found, np.searchsorted(rows, np.array(left, int))
    stages, left_over = known[key]
    chosen.moving[rows[left_over]] = True
    for stage in stages:
        chosen.dummies[variables[stage]] += 1


def _keeps_unwanted(reduced: Reduced, entries: Entries, picks: list[list[int]]) -> bool:
    """Whether a variable that is declared `never` stays a state."""
    picked = [variable for stage in picks for variable in stage]
    return any(
        reduced.incidence.selects[variable] <= never.rank and picked.count(variable) < reduced.orders[variable]
        for variable in np.unique(entries.variables).tolist()
    )


def _stages(
    reduced: Reduced, members: list[int], entries: Entries, *, only_safe: bool
) -> tuple[list[list[int]], list[int]]:
    """The variables picked in each stage, and the rows without a safe pivot."""
    picked, left = _pick(reduced, members, entries, only_safe)
    picks, solved = [picked], set(members) - set(left)
    for stage in range(2, int(reduced.differentiations[members].max()) + 1):
        rows = [row for row in members if reduced.differentiations[row] >= stage and row in solved]
        use = np.isin(entries.rows, rows) & np.isin(entries.variables, picks[-1])
        use &= reduced.orders[entries.variables] >= stage
        picks.append([])
        for group, own in connected_rows(entries.where(use), rows):
            found, unsolved = _pick(reduced, group, own, only_safe)
            if unsolved:
                return [[]], members
            picks[-1] += found
    return picks, left


def _check_never(chosen: Chosen) -> None:
    table = chosen.reduced.incidence
    bad = [table.variable_name(*pair) for pair in chosen.states() if table.selects[pair[0]] <= never.rank]
    if bad:
        raise StructureError(
            f"{', '.join(bad)} must be a state although it is declared `never`: no constraint makes it depend on other "
            "states. Remove `never`."
        )


def _with_generic_values(entries: Entries) -> Entries:
    """Entries with different stand-ins for unknown numbers, so that they do not cancel by accident."""
    spread = 1.0 + 0.3 * np.modf(0.6180339887 * (1.0 + np.arange(len(entries.rows))))[0]
    return entries._replace(numbers=np.where(entries.known, entries.numbers, entries.numbers * spread))


def nominal_of(table: Incidence, pair: Pair) -> float:
    """The nominal size of a variable, or of its derivative: that of the variable per millisecond for each order."""
    variable, order = pair
    if order == 0:
        return float(table.sizes[variable])
    return float(table.rate_sizes[variable]) * 1e3 ** (order - 1)


def _pick(reduced: Reduced, members: list[int], entries: Entries, only_safe: bool) -> tuple[list[int], list[int]]:
    """As many variables as rows, with a regular matrix between them, and the remaining rows.

    Rows remain if all their pivots are unsafe.
    """
    hopeless: list[int] = []
    if only_safe:
        with_safe = set(entries.rows[entries.safe].tolist())
        hopeless = [row for row in members if row not in with_safe]
        members = [row for row in members if row in with_safe]
        entries = entries.where(np.isin(entries.rows, members))
    peeled = _peel(reduced, members, entries)
    rest = [row for row in members if row not in peeled]
    others, left = _eliminate(reduced, rest, entries.without(peeled), only_safe) if rest else ([], [])
    return [*peeled.values(), *others], hopeless + left


def _peel(reduced: Reduced, members: list[int], entries: Entries) -> dict[int, int]:
    """Constraints that can be solved immediately, each with its variable.

    No other constraint contains this variable, no variable in the constraint has a lower preference as a state, and its
    coefficient is safe to divide by. This needs no elimination, so the cost of a long chain is proportional to its
    length.
    """
    of_row: dict[int, dict[int, float]] = {row: {} for row in members}
    users: dict[int, set[int]] = {}
    safe = set(zip(entries.rows[entries.safe].tolist(), entries.variables[entries.safe].tolist(), strict=True))
    for row, variable, number in zip(*(part.tolist() for part in entries[:3]), strict=True):
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
        is_small = abs(row_entries[variable]) <= SAFE * largest
        if _reluctance(reduced, variable) > least or is_small or (row, variable) not in safe:
            continue
        peeled[row] = variable
        for other in row_entries:
            users[other].discard(row)
            if len(users[other]) == 1:
                queue.append(other)
    return peeled


def _eliminate(reduced: Reduced, members: list[int], entries: Entries, only_safe: bool) -> tuple[list[int], list[int]]:
    columns = sorted(set(entries.variables.tolist()))
    work = Elimination(len(members), len(columns))
    place_row = {row: i for i, row in enumerate(members)}
    place_column = {variable: i for i, variable in enumerate(columns)}
    for row, variable, *entry in zip(*(part.tolist() for part in entries[:-1]), strict=True):
        work.put(place_row[row], place_column[variable], *entry)
    work.matrix /= np.maximum(np.max(np.abs(work.matrix), axis=1, keepdims=True, initial=0.0), 1e-300)
    keys = [_reluctance(reduced, variable) for variable in columns]
    picked: list[int] = []
    for any_pivot in (False,) if only_safe else (False, True):
        for threshold in (SAFE, 1e-12):
            for key in sorted(set(keys)):
                left = [c for c in range(len(columns)) if keys[c] == key and c in work.columns]
                picked += work.pivot(left, threshold, any_pivot)
    if work.rows and not only_safe:
        names = ", ".join(reduced.incidence.row_name(members[i]) for i in sorted(work.rows))
        raise StructureError(
            f"No states can be chosen: at the start values, the constraints {names} do not determine a derivative. "
            "They contradict or repeat others, or the mechanism starts in a singular position. Change the start values."
        )
    return [columns[c] for c in picked], [members[i] for i in sorted(work.rows)]


def _reluctance(reduced: Reduced, variable: int) -> tuple[int, int]:
    """Sort key: variables that become dummies first have the smallest."""
    return int(reduced.incidence.selects[variable]), -int(reduced.orders[variable])
