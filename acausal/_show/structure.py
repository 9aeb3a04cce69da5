"""`structure`: a report of the structural analysis of a model."""

import dataclasses

import numpy as np

from .._declare.component import Component
from .._evaluate.building import system_of
from .._evaluate.system import System
from .._extras import Axes, given_or_new
from .._integrate.setup.pattern import pattern_of_rates
from .._reduce.aliases import TIME, ZERO
from .._reduce.sort import Sorted
from .._reduce.tear import Torn
from .._unit_check.model_units import unchecked_equations


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


_COLOURS = {"explicit": "tab:blue", "linear": "tab:orange", "nonlinear": "tab:red"}


def plot_structure(system: System, ax: Axes | None) -> Axes:
    """Incidence of the sorted equations, with outlined blocks and marked tearing variables and residuals."""
    ordered = system.ordered
    rows = [row for torn in system.torn for row in torn.rows]
    unknowns = [unknown for torn in system.torn for unknown in torn.unknowns]
    column_of = {unknown: i for i, unknown in enumerate(unknowns)}
    side = min(4.0 + 0.14 * len(rows), 12.0)
    ax = given_or_new(ax, side + 1.5, side)
    points = [
        (column_of[int(ordered.column[entry])], i)
        for i, row in enumerate(rows)
        for entry in ordered.entries_of_row[row]
        if ordered.column[entry] >= 0
    ]
    x, y = np.array(points).reshape(-1, 2).T
    ax.plot(x, y, ".", color="0.35", markersize=max(2.0, 7.0 - len(rows) / 25))
    _outline(system, ax)
    ax.set_xlim(-0.7, len(rows) - 0.3)
    ax.set_ylim(len(rows) - 0.3, -0.7)
    ax.set_aspect("equal")
    if len(rows) <= 60:
        ax.set_xticks(range(len(rows)), [ordered.unknown_name(u) for u in unknowns], rotation=90, fontsize=6)
        ax.set_yticks(range(len(rows)), [_short(equation_name(ordered, row)) for row in rows], fontsize=6)
    ax.set_xlabel("unknowns")
    ax.set_ylabel("equations")
    return ax


def equation_name(ordered: Sorted, row: int) -> str:
    """The name of an equation, with its number of differentiations."""
    level, name = ordered.table.place(row)[0].template.level, ordered.table.row_name(row)
    return name if level == 0 else f"d/dt {name}" if level == 1 else f"d{level}/dt{level} {name}"


def _short(name: str) -> str:
    """A label: only the first of the ports at a connection."""
    return name.replace("sum of flows at the connection of ", "flows at ").partition(",")[0]


def _outline(system: System, ax: Axes) -> None:
    from matplotlib.patches import Patch, Rectangle

    start = 0
    for torn in system.torn:
        size = len(torn.rows)
        ax.add_patch(Rectangle((start - 0.5, start - 0.5), size, size, alpha=0.25, color=_COLOURS[torn.method]))
        if torn.tears and size > 1:
            inner = len(torn.steps)
            ax.add_patch(
                Rectangle((start + inner - 0.5, start + inner - 0.5), len(torn.tears), len(torn.tears), fill=False,
                          linewidth=1.5, edgecolor="k")
            )  # fmt: skip
        start += size
    kinds = list(dict.fromkeys(torn.method for torn in system.torn))
    handles = [Patch(color=_COLOURS[kind], alpha=0.4, label=kind) for kind in kinds]
    ax.legend(handles=handles, loc="upper right", fontsize="small", title="blocks")
