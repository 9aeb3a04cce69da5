"""The synchronous language elements as equations and events (Modelica 3.6, chapter 16).

Between the ticks of its clock, a clocked variable keeps its value, so clocked equations hold at all times. Only the
operators need more. A value just before the tick, as in `sample` and `previous`, is a discrete variable that the event
of the tick sets. A value of another clock is a variable that takes it over while the clock is the one that ticked last.
"""

import dataclasses
from collections.abc import Hashable
from typing import Any

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation, FlatModelica, FlatVariable, equality
from .._syntax.visits import nodes
from .clock_inference import OPERATORS, Clock, Inference
from .clock_operators import Operators, Tick, discrete
from .statements import Values, assertions, before, branches_of, chosen, targets_of, together


@dataclasses.dataclass(frozen=True)
class Clocked:
    """What clocks add to a flat model: discrete variables that events set, and the events."""

    stored: frozenset[str] = frozenset()
    ticks: tuple[Tick, ...] = ()


def without_clocks(flat: FlatModelica) -> tuple[FlatModelica, Clocked]:
    """The flat model without synchronous elements. Raises `ModelError` for clocks that contradict each other."""
    return _Rewriting(flat).rewritten() if _has_clocks(flat) else (flat, Clocked())


def _has_clocks(flat: FlatModelica) -> bool:
    if any(variable.type == "Clock" for variable in flat.variables.values()):
        return True
    found: list[Any] = [*(x.residual for x in flat.equations), *flat.whens, *(a.body for a in flat.algorithms)]
    found += [variable.binding for variable in flat.variables.values() if variable.binding is not None]
    builtins = (b for b in nodes(tuple(found)) if isinstance(b, e.Builtin))
    return any(b.name in OPERATORS or (b.name == "Sample" and len(b.args) == 1) for b in builtins)


class _Rewriting:
    """Takes up all clocks, and then rewrites the equations."""

    def __init__(self, flat: FlatModelica) -> None:
        self.flat = flat
        self.inference = Inference(flat)
        self.equations: list[tuple[FlatEquation, Hashable]] = []  # with the nodes of their clocks
        self.algorithms: list[tuple[Algorithm, Hashable]] = []
        self.asserts: list[tuple[e.Assert, Hashable]] = []
        self.operators: Operators

    def rewritten(self) -> tuple[FlatModelica, Clocked]:
        flat = self.flat
        whens = [when for when in flat.whens if not self._read_when(when)]
        self._read()
        self.inference.partitions.solve()
        variables = {v.name: self._variable(v) for v in flat.variables.values() if v.type != "Clock"}
        operators = self.operators = Operators(self.inference, variables)
        for variable in list(variables.values()):
            if variable.binding is not None and variable.variability not in ("constant", "parameter"):
                binding = operators.of(variable.binding, self._clock(variable.name))
                variables[variable.name] = dataclasses.replace(variable, binding=binding)
        equations = [self._of(equation, node) for equation, node in self.equations]
        algorithms = [self._algorithm(algorithm, node) for algorithm, node in self.algorithms]
        asserts = [self._assert(demand, node) for demand, node in self.asserts]
        whens = [operators.of(when, None) for when in whens]
        ticks = [tick for grid in operators.grids.values() for tick in grid.ticks()]
        ticks = [dataclasses.replace(t, of=operators.of(t.of, None)) if t.kind == "when" else t for t in ticks]
        flat = dataclasses.replace(
            flat,
            variables=variables,
            equations=(*equations, *operators.equations),
            algorithms=tuple(algorithms),
            asserts=tuple(asserts),
            whens=tuple(whens),
        )
        return flat, Clocked(frozenset(operators.stored), tuple(ticks))

    # Taking up

    def _read_when(self, when: e.WhenClause) -> bool:
        """Takes up the body of a when-clause with a clock as equations."""
        (condition, body), *others = when.blocks
        if not self.inference.is_clock(condition):
            return False
        if others:
            raise ModelError("a clocked when-clause has no elsewhen.")
        node = self.inference.clock(condition)
        self.inference.partitions.mark(node)
        for targets, value in _assigned(body).items():
            self._take(equality(together(targets), value, "when"), node)
        for demand in assertions(body):
            self.inference.read(demand, node)
            self.asserts.append((demand, node))
        return True

    def _take(self, equation: FlatEquation, node: Hashable) -> None:
        self.inference.read(equation.residual, node)
        self.equations.append((equation, node))

    def _read(self) -> None:
        inference, partitions = self.inference, self.inference.partitions
        for equation in self.flat.equations:
            x = equation.residual
            if isinstance(x, e.Binary) and inference.is_clock(x.left):
                inference.equal_clocks(x.left, x.right)
            else:
                self._take(equation, partitions.fresh())
        for variable in self.flat.variables.values():
            if variable.binding is not None and variable.type == "Clock":
                inference.equal_clocks(e.Ref(variable.name), variable.binding)
            elif variable.binding is not None and variable.variability not in ("constant", "parameter"):
                inference.read(variable.binding, variable.name)
        for algorithm in self.flat.algorithms:
            self._read_algorithm(algorithm)
        for demand in self.flat.asserts:
            node = partitions.fresh()
            inference.read(demand, node)
            self.asserts.append((demand, node))

    def _read_algorithm(self, algorithm: Algorithm) -> None:
        node = self.inference.partitions.fresh()
        for s in algorithm.body:
            self.inference.read(s, node)
        for name in targets_of(algorithm.body):
            if name in self.flat.variables:
                self.inference.partitions.join(name, node)
        self.algorithms.append((algorithm, node))

    # Rewriting

    def _clock(self, node: Hashable) -> Clock | None:
        return self.inference.partitions.clock(node)

    def _variable(self, variable: FlatVariable) -> FlatVariable:
        if variable.variability in ("constant", "parameter") or self._clock(variable.name) is None:
            return variable
        return dataclasses.replace(discrete(variable), binding=variable.binding)

    def _of(self, equation: FlatEquation, node: Hashable) -> FlatEquation:
        return dataclasses.replace(equation, residual=self.operators.of(equation.residual, self._clock(node)))

    def _assert(self, demand: e.Assert, node: Hashable) -> e.Assert:
        clock = self._clock(node)
        condition = self.operators.of(demand.condition, clock)
        if clock is not None:
            begun = self.operators.grids[clock.base].has_begun(clock)
            condition = e.Binary("Or", e.Unary("Not", begun), condition)
        return dataclasses.replace(demand, condition=condition)

    def _algorithm(self, algorithm: Algorithm, node: Hashable) -> Algorithm:
        """An algorithm. Variables that a clocked one sets have their previous values at first."""
        clock, body = self._clock(node), algorithm.body
        if clock is not None:
            names = [name for name in targets_of(body) if name in self.flat.variables]
            first = (e.Assign((e.Target(name),), e.Builtin("Previous", (e.Ref(name),))) for name in names)
            body = (*first, *body)
        return dataclasses.replace(algorithm, body=tuple(self.operators.of(s, clock) for s in body))


def _assigned(body: e.Body) -> Values:
    """The values that the equations of a clocked when-clause give to variables."""
    found: Values = {}
    for s in body:
        match s:
            case e.Assign():
                found[s.targets] = s.value
            case e.IfStatement():
                found |= chosen(s, [_assigned(branch) for _, branch in branches_of(s)], before("Previous"))
            case e.Assert():
                pass
            case _:
                raise ModelError(f"a {type(s).__name__.lower()} in a clocked when-clause is not supported.")
    return found
