"""A run that jax differentiates at known numbers, as one program: the start, the run, and the values at its end.

In parts, a run would have as many directions as its start has numbers. As a whole, it has those of the caller.
"""

import dataclasses
import functools as ft
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._interpret.known_derivatives import FEW, are_differentiated
from .._numbers import Numbers
from .._tracing import is_traced
from .programs.stored_program import result_of
from .results.solution import Solution
from .results.trajectories import trajectories
from .run import WholeRun, n_saved, run_args, solution_of_run, whole_run
from .setup.settings import STEPS, RunNumbers, Settings
from .start.initialise import initialised_leaves
from .step.derivative import LARGEST_JACOBIAN
from .stored_run import contents_of

Leaves = Sequence[Any]


def is_differentiated(settings: Settings, leaves: Leaves, numbers: RunNumbers) -> bool:
    """Whether jax differentiates a run at known numbers, with few enough derivatives for one program."""
    parts = jax.tree.leaves((leaves, numbers))
    shows_progress = not isinstance(settings.progress, diffrax.NoProgressMeter)
    if settings.adjoint is not None or shows_progress or not are_differentiated(parts):
        return False
    n = sum(np.size(leaf) for leaf in parts if is_traced(leaf))
    return n <= FEW and n * n_saved(settings, numbers) <= LARGEST_JACOBIAN


def run_differentiated(settings: Settings, leaves: Leaves, numbers: RunNumbers) -> Solution:
    """Integrate a model with these leaves, from its start on."""
    found: _Found = result_of(_DifferentiatedRun(settings), (list(leaves), numbers))
    params: dict[int, Any] = settings.system.intake.parameters(leaves).leaves | dict(found.discrete)
    return dataclasses.replace(solution_of_run(settings, found.run), _params=params, _final=found.final)


class _Found(NamedTuple):
    """The run, the discrete variables at its start, and the values of all variables at its end, by leaf number."""

    run: WholeRun
    discrete: Mapping[int, Numbers]
    final: dict[int, Array]


@dataclasses.dataclass(frozen=True)
class _DifferentiatedRun:
    """The whole run as a function of the leaves of a model and the numbers of the run."""

    settings: Settings

    @property
    def name(self) -> str:
        return "run"

    @ft.partial(jax.jit, static_argnums=0)
    def __call__(self, arguments: tuple[Leaves, RunNumbers]) -> _Found:
        (leaves, numbers), system = arguments, self.settings.system
        if self.settings.is_initialised:
            leaves, failed = initialised_leaves(system, leaves, numbers.t0, numbers.past, throw=False)
            numbers = dataclasses.replace(numbers, start_failed=failed)
        params, args = run_args(self.settings, leaves, numbers)
        run = whole_run(self.settings, args)
        discrete = {i: x for i, x in params.leaves.items() if system.flat.leaves[i].declaration.role == "discrete"}
        found = _Found(run, discrete, trajectories(system, 0, *run.ending.end, run.args.inputs))
        return jax.tree.map(lambda x: jnp.asarray(x, jnp.result_type(x)), found)

    def steps(self, arguments: tuple[Leaves, RunNumbers]) -> int:
        return min(self.settings.max_steps, STEPS)  # a run takes fewer steps than are permitted

    def contents(self, arguments: tuple[Leaves, RunNumbers]) -> list[object]:
        return contents_of(self.settings)
