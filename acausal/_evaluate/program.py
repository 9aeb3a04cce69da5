"""A block as a small program without references to components, so that similar blocks share it."""

import dataclasses
import functools as ft
from typing import Literal, NamedTuple

import numpy as np

from .._reduce.aliases import TIME, ZERO
from .._reduce.incidence import Pair, Ranges, ranges_of_pair
from .._reduce.sort import Sorted, Steps
from .._reduce.states import nominal_of
from .._reduce.tear import SolutionMethod, Torn
from .._reduce.template import Template

MANY = 16  # number of values above which their sum is one operation on an array


class Arg(NamedTuple):
    """The source of an input of an equation: a parameter, a known value, an unknown of the block, or a constant."""

    source: Literal["param", "value", "unknown", "time", "zero", "one"]
    number: int = 0
    sign: int = 1


class Step(NamedTuple):
    """One equation; `solved` is the block's unknown that it determines, None for a residual."""

    template: Template
    args: tuple[Arg, ...]
    solved: int | None


@dataclasses.dataclass(frozen=True)
class Program:
    """Steps and residuals of a torn block. Unknowns are numbered: those solved by steps, then the tearing variables."""

    steps: tuple[Step, ...]
    residuals: tuple[Step, ...]
    shapes: tuple[tuple[int, ...], ...]  # of the unknowns
    sizes: tuple[float, ...]  # nominal sizes of the tearing variables of a nonlinear block
    ranges: tuple[Ranges, ...]  # of the unknowns
    method: SolutionMethod
    params: tuple[tuple[int, int], ...]  # (component kind, slot) of each parameter it reads
    timed: tuple[tuple[int, str], ...]  # (component kind, name) of each equation that reads the time

    @property
    def n_tears(self) -> int:
        return len(self.shapes) - len(self.steps)

    @ft.cached_property
    def weights(self) -> np.ndarray | None:
        """The weight of each value in the result, if this is a sum of many flows, such as the current of a ground. Such
        a program reads its values as one array.
        """
        if len(self.steps) != 1 or self.residuals or self.method != "explicit":
            return None
        (step,) = self.steps
        terms = step.template.form.terms
        own = [i for i, arg in enumerate(step.args) if arg.source in ("value", "unknown")]
        if step.template.owner is not None or len(own) <= MANY or any(a.source in ("time", "one") for a in step.args):
            return None
        sums = np.zeros(len(own))  # of the unknown, then of each value
        for i in own:
            arg = step.args[i]
            sums[0 if arg.source == "unknown" else 1 + arg.number] += arg.sign * (terms[i].number or 0.0)
        return -sums[1:] / sums[0]

    @property
    def is_elementwise(self) -> bool:
        """Whether each unknown can be eliminated element by element."""
        steps = self.steps + self.residuals
        return len({step.template.shape for step in steps} | set(self.shapes)) == 1 and all(
            step.template.form.terms[i].elementwise
            for step in steps
            for i, arg in enumerate(step.args)
            if arg.source == "unknown" and i in step.template.form.terms
        )


class Use(NamedTuple):
    """One block computed by a program: the pairs that it reads, the members of its parameters and of its
    timed equations, its output pairs.
    """

    program: Program
    values: tuple[Pair, ...]
    members: tuple[int, ...]
    timed: tuple[int, ...]
    gives: tuple[Pair, ...]


def residual_program_of(ordered: Sorted, rows: list[int], kind_index: dict[int, int]) -> Use:
    """Equations as a program without unknowns: their residuals from known values."""
    return chained_program_of(ordered, [], rows, kind_index)


def chained_program_of(ordered: Sorted, steps: Steps, rows: list[int], kind_index: dict[int, int]) -> Use:
    """Equations that determine pairs one by one, and the residuals of others."""
    torn = Torn([(row, i) for i, (row, _) in enumerate(steps)], [], rows, "explicit", 0)
    return _Writer(ordered, torn, kind_index, tuple(pair for _, pair in steps)).write()


def program_of(ordered: Sorted, torn: Torn, kind_index: dict[int, int]) -> Use:
    """A torn block as a program, and the inputs of this block."""
    return _Writer(ordered, torn, kind_index, tuple(ordered.unknowns[unknown] for unknown in torn.unknowns)).write()


class _Writer:
    def __init__(self, ordered: Sorted, torn: Torn, kind_index: dict[int, int], gives: tuple[Pair, ...]) -> None:
        self.table = ordered.table
        self.torn = torn
        self.kind_index = kind_index
        self.gives = gives
        self.unknown = {pair: i for i, pair in enumerate(self.gives)}
        self.values: dict[Pair, int] = {}
        self.params: dict[tuple[int, int, int], int] = {}
        self.timed: dict[tuple[int, str, int], int] = {}

    def write(self) -> Use:
        steps = tuple(self._step(row, i) for i, (row, _) in enumerate(self.torn.steps))
        residuals = tuple(self._step(row, None) for row in self.torn.residuals)
        flat = self.table.flat
        shapes = tuple(flat.leaves[flat.leaf_of_node[self.table.variables[v]]].sizes for v, _ in self.gives)
        slots = tuple((kind, slot) for kind, slot, _ in self.params)
        searched = self.gives[len(steps) :] if self.torn.method == "nonlinear" else ()
        sizes = tuple(nominal_of(self.table, pair) for pair in searched)
        ranges = tuple(ranges_of_pair(self.table, pair) for pair in self.gives)
        timed = tuple((kind, name) for kind, name, _ in self.timed)
        program = Program(steps, residuals, shapes, sizes, ranges, self.torn.method, slots, timed)
        members, own = (tuple(member for _, _, member in keys) for keys in (self.params, self.timed))
        return Use(program, tuple(self.values), members, own, self.gives)

    def _step(self, row: int, solved: int | None) -> Step:
        family, inside = self.table.place(row)
        kind, member = self.kind_index.get(id(family.instances), -1), int(family.members[inside])
        args = []
        for position, item in enumerate(family.template.inputs):
            is_used = position in family.template.form.inputs
            node, sign = int(family.nodes[inside, position]) if is_used else ZERO, int(family.signs[inside, position])
            if item.source in ("param", "discrete"):
                args.append(Arg("param", self.params.setdefault((kind, item.slot, member), len(self.params))))
            elif item.source == "time" or (node == TIME and item.order == 0):
                timed = (kind, family.template.name, member)
                args.append(Arg("time", self.timed.setdefault(timed, len(self.timed)), sign))
            else:
                args.append(self._variable(node, item.order, sign))
        # Inverse operations solve for an unknown of a step that enters nonlinearly.
        nonlinear = family.template.form.nonlinear if solved is not None else ()
        own = [i for i in nonlinear if args[i].source == "unknown" and args[i].number == solved]
        return Step(family.template.explicit[own[0]] if own else family.template, tuple(args), solved)

    def _variable(self, node: int, order: int, sign: int) -> Arg:
        if node < 0:
            return Arg("zero") if node == ZERO or order > 1 else Arg("one", 0, sign)
        pair = (self.table.number_of_node[node], order)
        if pair in self.unknown:
            return Arg("unknown", self.unknown[pair], sign)
        return Arg("value", self.values.setdefault(pair, len(self.values)), sign)
