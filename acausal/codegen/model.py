"""The sorted system of a model as calls of C functions on numbered values."""

import dataclasses
import functools as ft
from collections.abc import Iterable

import numpy as np

from .._evaluate.groups import Group
from .._evaluate.program import Program
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._reduce.incidence import Pair, Ranges, ranges_of_pair
from .calls import Call, Solve
from .expressions import Names, identifier
from .functions import CFunction, Direct, Implicit, Source, is_direct
from .layout import Numbering, Places, Quantity
from .values import Tables

PUBLIC = "start violation step outputs rates evaluate along initialise events indicators next_time".split()


@dataclasses.dataclass(frozen=True)
class Output:
    """A scalar variable of the model, read from the values."""

    name: str
    unit: str
    places: Places


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CModel:
    """A model with known numbers as C functions and their calls, ready to be written.

    `rates` compute the derivatives of the states, and `rest` all other values; both in order of evaluation.
    """

    name: str
    system: System
    inputs: Inputs
    layout: Numbering
    tables: Tables
    parameters: list[Quantity]
    discrete: list[Quantity]
    states: list[Quantity]
    outputs: list[Output]
    start_guess: np.ndarray
    t0: float

    def __repr__(self) -> str:
        return f"<CModel {self.name}: {self.n_states} states, {len(self.outputs)} outputs>"

    @property
    def n_states(self) -> int:
        return len(self.system.nominals)

    @ft.cached_property
    def rate_places(self) -> np.ndarray:
        """The position of the derivative of each element of the state vector."""
        plan = self.system.plan
        own = [self.layout.place(pair) + np.arange(plan.size(pair[0])) for pair in self.system.rates]
        return np.concatenate([np.zeros(0, int), *own])

    @property
    def state_ranges(self) -> list[tuple[Ranges, np.ndarray]]:
        """The declared ranges of states, and the positions of these states."""
        table, plan = self.system.ordered.table, self.system.plan
        found: dict[Ranges, list[np.ndarray]] = {}
        for pair in self.system.states:
            found.setdefault(ranges_of_pair(table, pair), []).append(plan.elements(pair))
        return [(ranges, np.concatenate(places)) for ranges, places in found.items() if ranges]

    @ft.cached_property
    def rates(self) -> list[Call | Solve]:
        return [self._evaluation(group) for group in self.groups(self.system.rates)]

    @ft.cached_property
    def rest(self) -> list[Call | Solve]:
        return [self._evaluation(group) for group in self.groups_of_rest]

    @property
    def groups_of_rest(self) -> list[Group]:
        """The groups that no rate needs."""
        done = {group.first_segment for group in self.groups(self.system.rates)}
        return [group for group in self.system.plan.groups if group.first_segment not in done]

    def groups(self, pairs: Iterable[Pair]) -> list[Group]:
        """The groups that compute some values, in order."""
        plan = self.system.plan
        return plan.needed({plan.places[pair].segment for pair in pairs})

    # Programs as functions

    @ft.cached_property
    def names(self) -> Names:
        """The names of the functions of equations, which differ from those of the public functions."""
        names = Names()
        for word in PUBLIC:
            names.new(f"{self.name}_{word}")
        return names

    @ft.cached_property
    def _sources(self) -> dict[Program, Source]:
        return {}

    @ft.cached_property
    def _code(self) -> dict[Program, Direct | Implicit]:
        return {}

    def source(self, group: Group) -> Source:
        """The program of a group with the shapes of its inputs."""
        program = group.program
        if program not in self._sources:
            holders = self.system.flat.holders
            self._sources[program] = Source(
                program,
                self.names.new(_function_name(program)),
                " and ".join(self._equation_names(group)[:3]) + f" of the {self.system.name}",
                tuple(holders[kind].kind.sizes[slot] for kind, slot in program.params),
                tuple(self.system.plan.shapes[variable] for variable, _ in group.uses[0].values),
                self.tables,
                self.names,
                _comment(program),
            )
        return self._sources[program]

    def code(self, group: Group) -> Direct | Implicit:
        """The functions of the program of a group."""
        program, source = group.program, self.source(group)
        if program not in self._code:
            self._code[program] = source.direct() if is_direct(program) else source.implicit()
        return self._code[program]

    @property
    def functions(self) -> list[CFunction]:
        """All functions of the equations."""
        found: list[CFunction] = []
        for code in self._code.values():
            found += [code.function] if isinstance(code, Direct) else [code.equations, code.unknowns]
        return found

    def operands(self, group: Group) -> list[Places]:
        """The inputs of the program of a group: its parameters, values, and the time."""
        layout = self.layout
        own = [layout.members(key, members) for key, members in zip(group.program.params, group.members, strict=True)]
        own += [layout.values([use.values[i] for use in group.uses]) for i in range(len(group.uses[0].values))]
        return [*own, Places("t", np.zeros(len(group.uses), int))]

    def sizes(self, group: Group) -> list[int]:
        """The number of elements of each input."""
        return [int(np.prod(shape)) for shape in self.source(group).shapes]

    def _evaluation(self, group: Group) -> Call | Solve:
        code, operands = self.code(group), self.operands(group)
        results = tuple(
            self.layout.values([use.gives[i] for use in group.uses]) for i in range(len(group.program.shapes))
        )
        if isinstance(code, Direct):
            return Call(results, self._comments(group), code.function, tuple(operands[i] for i in code.reads))
        tears = range(len(group.program.steps), len(group.program.shapes))
        guesses = (
            () if code.is_linear else tuple(self.layout.memory([use.gives[i] for use in group.uses]) for i in tears)
        )
        inputs = tuple(zip(operands, self.sizes(group), strict=True))
        return Solve(results, self._comments(group), code, inputs, tuple(guesses))

    # Comments

    @ft.cached_property
    def _equations(self) -> dict[Pair, list[str]]:
        """The names of the equations of the block that determines each unknown."""
        table, unknowns = self.system.ordered.table, self.system.ordered.unknowns
        return {
            unknowns[unknown]: [table.row_name(row) for row in torn.rows]
            for torn in self.system.torn
            for unknown in torn.unknowns
        }

    def _equation_names(self, group: Group) -> list[str]:
        gives = group.uses[0].gives
        return self._equations[gives[0]]

    def _comments(self, group: Group) -> tuple[str, ...]:
        uses = group.uses
        lines = []
        for i, pair in enumerate(uses[0].gives):
            last = f" to {self._variable(uses[-1].gives[i])}" if len(uses) > 1 else ""
            lines.append(f"{self._variable(pair)}{last} [{self.unit(pair)}]")
        return (", ".join(lines) + " from " + ", ".join(self._equation_names(group)),)

    def _variable(self, pair: Pair) -> str:
        return self.system.ordered.table.variable_name(*pair)

    def unit(self, pair: Pair) -> str:
        """The unit of a variable or of its derivative."""
        unit = self.layout.unit(pair[0])
        return unit if not pair[1] else f"{unit}/s" if pair[1] == 1 else f"{unit}/s{pair[1]}"


def _function_name(program: Program) -> str:
    steps = program.steps + program.residuals
    if len(steps) > 1:
        return "block"
    (template,) = (step.template for step in steps)
    owner = "sum_of" if template.owner is None else template.owner.cls.__name__
    order = f"_rate{'' if template.level == 1 else template.level}" if template.level else ""
    return identifier(f"{owner}_{template.name}{order}")


def _comment(program: Program) -> str:
    names = []
    for step in program.steps + program.residuals:
        owner = "" if step.template.owner is None else f"{step.template.owner.cls.__name__}."
        names.append(f"{'d/dt ' * step.template.level}{owner}{step.template.name}")
    method = "" if program.method == "explicit" else f", {program.method}"
    return ", ".join(names) + method
