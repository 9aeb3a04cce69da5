"""Tearing: a sequence that solves the equations of a block one by one once a few unknowns are known."""

import dataclasses
from typing import Literal

from .sort import Block, Sorted

SolutionMethod = Literal["explicit", "linear", "nonlinear"]
EXHAUSTIVE = 60  # block size up to which every unknown is a candidate, beyond it only the most frequent ones


@dataclasses.dataclass
class Torn:
    """A block in solvable order.

    `steps` are (row, unknown) pairs, each solved for its unknown from known ones and the tearing variables `tears`.
    `residuals` are the rows that then determine the tearing variables, by `method`; "explicit" if there are none.
    """

    steps: list[tuple[int, int]]
    tears: list[int]
    residuals: list[int]
    method: SolutionMethod
    level: int

    @property
    def rows(self) -> list[int]:
        return [row for row, _ in self.steps] + self.residuals

    @property
    def unknowns(self) -> list[int]:
        return [unknown for _, unknown in self.steps] + self.tears


def tear(ordered: Sorted, block: Block) -> Torn:
    """Choose tearing variables greedily: each time the one that makes the most equations solvable.

    Only coefficients that cannot vanish are divided by; equations without one become residuals. In a linear block they
    must be constant too: others, such as that of a switch, may become small, and elimination with pivots then keeps
    the accuracy. Among equals, the unknown that enters the most equations nonlinearly is chosen, because Newton's
    method works well if a function is evaluated in its natural direction, such as a diode's current from its voltage;
    then the one that needs the fewest divisions by parameters.
    """
    if len(block.rows) == 1:
        return _single(ordered, block)
    inside = set(block.unknowns)
    is_linear = _is_linear(ordered, block.rows, inside)
    entries = {row: _entries(ordered, row, inside, is_linear) for row in block.rows}
    opened = {row: set(found) for row, found in entries.items()}
    state = _State(entries, opened, [], [], set(), _nonlinear(ordered, block.rows))
    state.propagate()
    while state.open_rows_with_unknowns() and len(state.steps) + len(state.tears) < len(block.unknowns):
        state.take(state.best_tear())
        state.propagate()
    tears = state.tears + sorted(inside - {u for _, u in state.steps} - set(state.tears))
    residuals = [row for row in block.rows if row not in state.done]
    method = "explicit" if not tears else "linear" if is_linear else "nonlinear"
    return Torn(state.steps, tears, residuals, method, block.level)


def _single(ordered: Sorted, block: Block) -> Torn:
    """One equation with one unknown."""
    (row,), (unknown,) = block.rows, block.unknowns
    entry = next(e for e in ordered.entries_of_row[row].tolist() if ordered.column[e] == unknown)
    table = ordered.table
    if table.matchable[entry] and (table.strength[entry] >= 2 or _has_inverse(ordered, row, unknown)):
        return Torn([(row, unknown)], [], [], "explicit", block.level)
    method = "linear" if _is_linear(ordered, [row], {unknown}) else "nonlinear"
    return Torn([], [unknown], [row], method, block.level)


def _has_inverse(ordered: Sorted, row: int, unknown: int) -> bool:
    """Whether inverse operations solve the equation for an unknown that enters nonlinearly."""
    positions = _positions(ordered, row, {unknown})
    return len(positions) == 1 and positions <= ordered.table.place(row)[0].template.explicit.keys()


def _entries(ordered: Sorted, row: int, inside: set[int], only_steady: bool) -> dict[int, int]:
    """The block's unknowns in an equation: 1 if it can be solved for one, 2 if without a division, otherwise 0."""
    table = ordered.table
    return {
        int(ordered.column[e]): max(int(table.strength[e]) - 1, 0)
        if table.matchable[e] and (table.steady[e] or not only_steady)
        else 0
        for e in ordered.entries_of_row[row]
        if int(ordered.column[e]) in inside
    }


def _nonlinear(ordered: Sorted, rows: list[int]) -> dict[int, int]:
    """The number of equations that each unknown enters nonlinearly."""
    count: dict[int, int] = {}
    for row in rows:
        for entry in ordered.entries_of_row[row]:
            if ordered.table.strength[entry] == 0:
                unknown = int(ordered.column[entry])
                count[unknown] = count.get(unknown, 0) + 1
    return count


@dataclasses.dataclass
class _State:
    entries: dict[int, dict[int, int]]
    open: dict[int, set[int]]  # the remaining unknowns of each row
    steps: list[tuple[int, int]]
    tears: list[int]
    done: set[int]
    nonlinear: dict[int, int]

    def copy(self) -> "_State":
        opened = {row: set(unknowns) for row, unknowns in self.open.items()}
        return _State(self.entries, opened, list(self.steps), list(self.tears), set(self.done), self.nonlinear)

    def open_rows_with_unknowns(self) -> bool:
        return any(unknowns for row, unknowns in self.open.items() if row not in self.done)

    def take(self, unknown: int) -> None:
        self.tears.append(unknown)
        self._know(unknown)

    def _know(self, unknown: int) -> None:
        for unknowns in self.open.values():
            unknowns.discard(unknown)

    def propagate(self) -> None:
        """Solve equations that have one unknown left, with a coefficient that cannot vanish."""
        progress = True
        while progress:
            progress = False
            for row, unknowns in self.open.items():
                if row in self.done or len(unknowns) != 1:
                    continue
                (unknown,) = unknowns
                if self.entries[row][unknown]:
                    self.steps.append((row, unknown))
                    self.done.add(row)
                    self._know(unknown)
                    progress = True

    def best_tear(self) -> int:
        frequency: dict[int, int] = {}
        for row, unknowns in self.open.items():
            if row not in self.done:
                for unknown in unknowns:
                    frequency[unknown] = frequency.get(unknown, 0) + 1
        candidates = sorted(frequency, key=lambda u: (-frequency[u], u))
        if len(self.entries) > EXHAUSTIVE:
            return candidates[0]
        return max(candidates, key=lambda u: self._merit(u, frequency[u]))

    def _merit(self, unknown: int, frequency: int) -> tuple[int, int, int, int, int]:
        trial = self.copy()
        trial.take(unknown)
        trial.propagate()
        divisions = sum(self.entries[row][solved] == 1 for row, solved in trial.steps)
        return len(trial.steps), self.nonlinear.get(unknown, 0), -divisions, frequency, -unknown


def _is_linear(ordered: Sorted, rows: list[int], inside: set[int]) -> bool:
    """Whether the equations are jointly linear in the unknowns: no coefficient depends on any of them."""
    for row in rows:
        family, _ = ordered.table.place(row)
        form = family.template.form
        positions = _positions(ordered, row, inside)
        for position in positions:
            coefficient = form.terms.get(position)
            if coefficient is None or coefficient.on & positions:
                return False
    return True


def _positions(ordered: Sorted, row: int, inside: set[int]) -> set[int]:
    """Inputs of the row's template that are unknowns of the block."""
    table = ordered.table
    family, member = table.place(row)
    by_node = {
        (int(table.variables[table.variable[e]]), int(table.order[e]))
        for e in ordered.entries_of_row[row]
        if int(ordered.column[e]) in inside
    }
    inputs = family.template.inputs
    return {
        i for i in family.template.unknowns if (int(family.nodes[member, i]), inputs[i].order) in by_node
    }  # fmt: skip
