"""`structure`: a report of the structural analysis of a model."""

import dataclasses

from .._declare.component import Component
from .._evaluate.building import system_of
from .._evaluate.system import System
from .._extras import Axes
from .._integrate.setup.pattern import pattern_of_rates
from .._reduce.aliases import TIME, ZERO
from .._reduce.tear import Torn
from .._unit_check.model_units import unchecked_equations
from .structure_plot import equation_name


@dataclasses.dataclass(frozen=True)
class BlockReport:
    """A block of the sorted system: its equations, unknowns and method."""

    kind: str
    equations: tuple[str, ...]
    unknowns: tuple[str, ...]
    tearing: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Structure:
    """The structure of a model after all passes. `print` shows it, `plot()` draws it.

    - `variables`, `parameters`: numbers of scalar leaves (an array counts as one).
    - `aliases`: variables that equal another one up to the sign; `zeros`: those that vanish identically.
    - `differentiated`: differentiated equations, with the number of times.
    - `states` and `dummies`: the variables integrated, with the reason for each, and the derivatives that became
      algebraic.
    - `invariants`: equations onto which a run is projected, because no choice of fewer states suits every position.
    - `blocks`: the algebraic unknowns in the order in which they are computed.
    - `groups`: the number of separate computations, similar blocks together.
    - `steps`: the sparse Jacobian of a step, with its entries, colours and fill-in; empty if a step is dense.
    - `unchecked`: equations with `check_units=False`.
    """

    parameters: int
    variables: int
    aliases: int
    zeros: int
    equations: int
    differentiated: dict[str, int]
    states: dict[str, str]
    dummies: tuple[str, ...]
    invariants: tuple[str, ...]
    blocks: tuple[BlockReport, ...]
    groups: int
    steps: str
    unchecked: tuple[str, ...]
    system: System = dataclasses.field(repr=False, compare=False)

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the block-triangular incidence: equations down, unknowns across; returns the matplotlib axes."""
        from .structure_plot import plot_structure

        return plot_structure(self.system, ax)


def structure(model: Component | System) -> Structure:
    """Report the structure of a model, or of the result of `choose_states`."""
    system = model if isinstance(model, System) else system_of(model)
    flat, table = system.flat, system.reduced.incidence
    counts = system.reduced.differentiations
    zeros = int((system.merged.representative == ZERO).sum())
    known = zeros + int((system.merged.representative == TIME).sum())
    return Structure(
        parameters=sum(leaf.count for leaf in flat.leaves if leaf.declaration.role == "param"),
        variables=flat.n_nodes,
        aliases=flat.n_nodes - known - table.n_variables,
        zeros=zeros,
        equations=table.n_rows,
        differentiated={table.row_name(row): int(counts[row]) for row in counts.nonzero()[0].tolist()},
        states=_states(system),
        dummies=tuple(_dummies(system)),
        invariants=tuple(equation_name(system.ordered, row) for row in sorted(system.ordered.invariants)),
        blocks=tuple(_block(system, torn) for torn in system.torn),
        groups=len(system.plan.groups),
        steps=_steps(system),
        unchecked=tuple(unchecked_equations(flat)),
        system=system,
    )


_WISHES = {1: "declared prefer", 0: "", -1: "declared avoid, but needed"}


def _states(system: System) -> dict[str, str]:
    """The reason for each state."""
    table, ordered = system.ordered.table, system.ordered
    tied = {pair for group in system.constraints.groups for use in group.uses for pair in use.values}
    kept = {pair for group in system.invariants.groups for use in group.uses for pair in use.values}
    reasons = {}
    for pair, name in zip(ordered.states, system.state_names, strict=True):
        leaf = table.flat.leaves[table.flat.leaf_of_node[table.variables[pair[0]]]]
        role = "restricted by invariants" if pair in kept else "chosen among tied variables" if pair in tied else "free"
        reasons[name] = ", ".join(part for part in (role, _WISHES.get(leaf.declaration.select, "")) if part)
    return reasons


def _steps(system: System) -> str:
    """The sparse Jacobian of a step, as text."""
    pattern = pattern_of_rates(system)
    if pattern is None:
        return ""
    return f"sparse, {len(pattern.rows)} entries in {pattern.n_colours} colours; elimination fills in {pattern.fill_in}"


def _dummies(system: System) -> list[str]:
    table, chosen = system.reduced.incidence, system.chosen
    orders = chosen.reduced.orders
    return [
        table.variable_name(v, int(orders[v]) - k)
        for v in chosen.dummies.nonzero()[0].tolist()
        for k in range(int(chosen.dummies[v]))
    ]


def _block(system: System, torn: Torn) -> BlockReport:
    ordered = system.ordered
    names = [equation_name(ordered, row) for row in torn.rows]
    return BlockReport(
        torn.method,
        tuple(names),
        tuple(ordered.unknown_name(unknown) for unknown in torn.unknowns),
        tuple(ordered.unknown_name(unknown) for unknown in torn.tears),
    )


def _lines(report: Structure) -> list[str]:
    simultaneous = [block for block in report.blocks if len(block.equations) > 1 or block.tearing]
    lines = [
        f"{report.variables} variables, {report.parameters} parameters",
        f"  {report.aliases} variables are aliases, {report.zeros} vanish; {report.equations} equations remain",
        f"States ({len(report.states)}):" + ("" if report.states else " none"),
        *(f"  {name}: {reason}" for name, reason in report.states.items()),
    ]
    if report.invariants:
        lines.append(f"Invariants ({len(report.invariants)}), onto which each step is projected, since no choice of")
        lines.append("  fewer states is good in every position: " + ", ".join(report.invariants))
    if report.unchecked:
        lines.append(f"Units not checked ({len(report.unchecked)}): " + ", ".join(report.unchecked))
    if report.differentiated:
        lines.append(f"Differentiated equations ({len(report.differentiated)}):")
        lines += [
            f"  {name}" + (f", {times} times" if times > 1 else "") for name, times in report.differentiated.items()
        ]
        lines.append("Algebraic derivatives: " + ", ".join(report.dummies))
    lines.append(
        f"{len(report.blocks)} blocks in {report.groups} groups, {len(simultaneous)} of them simultaneous:"
        if simultaneous
        else f"{len(report.blocks)} blocks in {report.groups} groups, none of them simultaneous"
    )
    if report.steps:
        lines.append(f"Steps: {report.steps}")
    for block in simultaneous:
        if len(block.equations) == 1:
            lines.append(f"  one {block.kind} equation: {block.equations[0]}  ->  {block.unknowns[0]}")
            continue
        lines.append(f"  {block.kind}, {len(block.equations)} equations torn by {', '.join(block.tearing)}")
        pairs = zip(block.equations, block.unknowns, strict=True)
        lines += [f"    {equation}  ->  {unknown}" for equation, unknown in pairs]
    return lines
