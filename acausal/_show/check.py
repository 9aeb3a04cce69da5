"""`check`: every error of a model."""

import dataclasses
import functools as ft
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from .._declare.component import Component
from .._declare.fields import join
from .._declare.layout import complete_leaves
from .._declare.node import check_is_node, nodes_of
from .._declare.node_requirements import broken
from .._declare.past import past_of
from .._errors import ModelError, SimulationError, collecting
from .._evaluate.building import build, system_of
from .._evaluate.diagnosis import first_not_finite
from .._evaluate.initial import checked_names, initial_state
from .._evaluate.singular import linear_blocks, singular_blocks
from .._evaluate.system import System
from .._indices import joined
from .._integrate.results.failure import about_block, about_range
from .._integrate.start.initialise import initialised_leaves, needs_search
from .._reduce.flatten import flatten
from .._reduce.stated import initial_templates, templates
from .free_ports import free_ports
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
    pair = first_not_finite(system, jnp.asarray(0.0), y, inputs)
    if pair is not None:
        said = f"{name_of(pair)} is infinite or not a number at the start."
        return [f"{said}{about_range(system, pair)}{about_block(system, pair)}"]
    singular = joined(singular_blocks(system, system.evaluate_all(jnp.asarray(0.0), y, inputs), inputs))
    pairs = [pair for pair, is_singular in zip(linear_blocks(system), np.asarray(singular), strict=True) if is_singular]
    return [f"{name_of(pair)} is determined by rounding errors only.{about_block(system, pair)}" for pair in pairs]
