"""`check`: every error of a model, and the ports at which nothing takes up the flow.

The flow of a port without a connection is zero, and so is that of a port connected only to sensors, whose own equations
set their flow to zero. That is right at the open end of a shaft. In a gear, however, each torque is a multiple of the
others, so one free port takes the load off all of them. The search for such ports is structural: an equation that is
linear in one remaining variable, and has no other part, makes it zero.
"""

import collections
import dataclasses
import functools as ft
from collections.abc import Callable, Iterator, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from .._declare.component import Component
from .._declare.fields import join
from .._declare.history import past_of
from .._declare.layout import complete_leaves
from .._declare.node import check_is_node, nodes_of
from .._declare.node_requirements import broken
from .._errors import ModelError, SimulationError, collecting
from .._evaluate.building import build, system_of
from .._evaluate.diagnosis import insolvable
from .._evaluate.initial import checked_names, initial_state
from .._evaluate.system import System
from .._integrate.results.failure import about_block, about_range
from .._integrate.start.initialise import initialised_leaves, needs_search
from .._reduce.aliases import Family, by_zero_factors, component_families
from .._reduce.class_equations import initial_templates, templates
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import flatten
from .structure import structure


@dataclasses.dataclass(frozen=True)
class Check:
    """The errors of a model. `print` shows them. It is true if there are none.

    `notes` are about parts of a correct model that may be unintended: free ports that take the load off a part, and
    parts on which nothing acts.
    """

    problems: tuple[str, ...]
    summary: str
    notes: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return not self.problems

    def __str__(self) -> str:
        if not self.problems and not self.notes:
            return f"No problems found.\n{self.summary}"
        if not self.problems:
            return "\n".join(["No errors found, but:", *(f"- {note}" for note in self.notes), self.summary])
        count = f"{len(self.problems)} problem" + ("s" if len(self.problems) > 1 else "")
        numbered = [f"{i}. {problem}" for i, problem in enumerate(self.problems, start=1)]
        return "\n".join([f"{count} found.", *numbered, *(f"- {note}" for note in self.notes), self.summary])


def check(model: Component) -> Check:
    """Every error of a model, rather than the first: shapes, connections, equations, ranges of parameters, units,
    structure, and whether its equations can be solved at the start values. Notes name ports at which nothing takes up
    the flow, if other variables of their component then vanish, and components on which nothing acts.

    Steps that need a correct earlier one are skipped, and the summary says so.
    """
    check_is_node(model)
    problems = [*_declared(model), *_parameters(model)]
    if problems:
        return Check(tuple(problems), "The structure was not analysed: correct these first.")
    problems = _raised(lambda: build(model))
    if problems:
        return Check(tuple(problems), "The start was not computed: correct these first.")
    system = system_of(model)
    return Check(tuple(_start(system, model)), str(structure(system)), tuple(free_ports(system.flat)))


def _raised(function: Callable[[], object]) -> list[str]:
    """The errors of one step."""
    with collecting() as found:
        try:
            function()
        except ModelError as error:
            found.append(error)
    return [str(error) for error in found]


def _declared(model: Component) -> list[str]:
    """Shapes, connections and the equations of each class."""
    problems = _raised(lambda: flatten(model))
    if not problems:
        flat = flatten(model)
        for instances in flat.instances:
            problems += _raised(ft.partial(templates, instances.kind))
        for instances in flat.starters:
            problems += _raised(ft.partial(initial_templates, instances.kind))
    return problems


def _parameters(model: Component) -> list[str]:
    """Violated requirements and ranges, which `eqx.tree_at` and arithmetic on models do not check."""
    return [join(path, sentence) for path, node in nodes_of(model) for sentence in broken(node)]


def _start(system: System, model: Component) -> list[str]:
    """Contradictions among start values, and equations without a solution there."""
    leaves, _ = complete_leaves(model)
    if needs_search(system, leaves):
        try:
            leaves = initialised_leaves(system, leaves, 0.0, past_of(model))[0]
        except SimulationError as error:
            return [str(error)]
    inputs = system.intake.inputs_of(leaves)
    y, bad = initial_state(system, jnp.asarray(0.0), inputs)
    names = sorted(
        {name for name, is_bad in zip(checked_names(system, inputs.given), np.asarray(bad), strict=False) if is_bad}
    )
    if names:
        return [f"{', '.join(names)}: the start values contradict the equations. Omit some of them."]
    name_of = lambda pair: system.ordered.table.variable_name(*pair)  # noqa: E731
    not_finite, singular = insolvable(system, jnp.asarray(0.0), y, inputs)
    if not_finite:
        pair = not_finite[0]
        said = f"{name_of(pair)} is infinite or not a number at the start."
        return [f"{said}{about_range(system, pair)}{about_block(system, pair)}"]
    return [f"{name_of(pair)} is determined by rounding errors only.{about_block(system, pair)}" for pair in singular]


SHOWN = 3  # variables in a sentence


def free_ports(flat: FlatModel) -> Iterator[str]:
    """Sentences about free ports that make other variables of their component vanish, and about components on which
    nothing acts. The ports of the model itself count as connected.
    """
    families = list(component_families(flat))
    alone = _vanishing(families, np.zeros(flat.n_nodes, bool))  # in any model
    free = _unloaded(flat, alone) & ~alone
    lost = _vanishing(families, alone | free) & ~alone & ~free
    flows, others = collections.defaultdict(list), collections.defaultdict(list)
    for instances in flat.instances:
        nodes = flat.nodes(instances)
        for row in range(len(nodes)) if np.any(free[nodes[nodes >= 0]]) else ():
            name = instances.name(row)
            own = _elements(flat, nodes[row])
            flows[name] = [node for node in own if _is_flow(flat, node) and not alone[node]]
            others[name] = [node for node in own if lost[node]]
    for name, own in flows.items():
        ends = [node for node in own if free[node]]
        if not name or not ends:
            continue
        if others[name]:
            vanish = [flat.node_name(node).removeprefix(f"{name}.") for node in others[name]]
            more = ["..."] if len(vanish) > SHOWN else []
            yield (
                f"{_are_free(flat, ends, f' of {name}')}: nothing takes up {_flow(flat, ends[0])} there, so "
                f"{', '.join([*vanish[:SHOWN], *more])} {'is' if len(vanish) == 1 else 'are'} zero."
            )
        elif len(ends) == len(own):
            yield f"Nothing acts on {name}: {_are_free(flat, ends)}."


def _elements(flat: FlatModel, firsts: np.ndarray) -> list[int]:
    """The nodes of the variables of a component."""
    found = []
    for first in firsts[firsts >= 0].tolist():
        leaf = flat.leaves[flat.leaf_of_node[first]]
        found += range(first, first + (leaf.count if flat.split and not leaf.stack else 1))
    return found


def _is_flow(flat: FlatModel, node: int) -> bool:
    leaf = flat.leaves[flat.leaf_of_node[node]]
    return leaf.in_port and leaf.declaration.role == "flow"


def _are_free(flat: FlatModel, nodes: Sequence[int], of: str = "") -> str:
    """The clause that names the free ports of some flows, such as "a and b are free"."""
    ports = dict.fromkeys(flat.node_name(node).rpartition(".")[0].rpartition(".")[2] for node in nodes)
    return f"{' and '.join(ports)}{of} {'is' if len(ports) == 1 else 'are'} free"


def _flow(flat: FlatModel, node: int) -> str:
    """The noun of a flow: its comment up to the first comma, such as "torque"."""
    from .._declare.class_card import comment_of  # reads sources, which an import does not need

    leaf = flat.leaves[flat.leaf_of_node[node]]
    name = leaf.path.rpartition(".")[2]
    noun = comment_of(leaf.port, name).partition(",")[0].partition(";")[0] if leaf.port is not None else ""
    return f"the {noun}" if noun else name


def _is_port_of_model(flat: FlatModel, nodes: Sequence[int]) -> bool:
    """Whether a set of flows is that of a port of the model itself without a connection."""
    return len(nodes) == 1 and flat.node_name(nodes[0]).count(".") == 1


def _unloaded(flat: FlatModel, zero: Bool[np.ndarray, " nodes"]) -> Bool[np.ndarray, " nodes"]:
    """Marks flows that are zero because all others of their connection are."""
    zero, sets = zero.copy(), [nodes for nodes, _ in flat.flow_sets if not _is_port_of_model(flat, nodes)]
    while True:
        left = [[node for node in nodes if not zero[node]] for nodes in sets]
        news = [nodes[0] for nodes in left if len(nodes) == 1]
        if not news:
            return zero
        zero[news] = True


def _vanishing(families: Sequence[Family], zero: Bool[np.ndarray, " nodes"]) -> Bool[np.ndarray, " nodes"]:
    """Marks the given nodes and those that the equations of components then make zero."""
    zero, n = zero.copy(), -1
    while n != np.sum(zero):
        n = np.sum(zero)
        for part in (part for family in families for part in by_zero_factors(family, zero)):
            form = part.template.form
            terms = [i for i in form.terms if part.template.inputs[i].source == "var"]
            if form.has_rest or len(terms) < len(form.terms) or not terms:
                continue
            vanish = (part.nodes >= 0) & zero[part.nodes]
            is_linear = np.all(vanish[:, sorted(form.nonlinear)], axis=1)
            remain = ~vanish[:, terms]
            for place, i in enumerate(terms):
                if part.template.inputs[i].order == 0 and form.terms[i].elementwise:
                    rows = is_linear & remain[:, place] & (np.sum(remain, axis=1) == 1)
                    zero[part.nodes[rows, i]] = True
    return zero
