"""Start values of a model whose components state initial equations."""

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.past import Past
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._tracing import is_traced
from ..setup.options import check_begun_late
from .no_start import report_no_start
from .problem import problem_of
from .start_search import search_start


def started(
    system: System, leaves: Sequence[Numbers | None], t0: Numbers, past: Past | None, *, throw: bool = True
) -> tuple[list[Numbers | None], Array | None]:
    """The leaves of a model with start values that satisfy its initial equations, and 1 if there are none, else 0.

    Discrete variables are in the modes that the start values imply, and past events have fired. If the search fails and
    the numbers are known, raises `SimulationError`. Traced, or with `throw=False`, the leaves are then unchanged.
    """
    system = system.solved or system
    check_begun_late(system, past, t0)
    problem, constants = problem_of(system, list(leaves))
    system.intake.check(leaves)
    params = system.intake.enforced(system.intake.parameters(leaves))
    t0 = jnp.asarray(t0, float)
    outcome, new = search_start(problem, params, None, system.intake.starts.pack(leaves), t0, constants, past)
    if throw and not is_traced(outcome.is_bad) and not np.ndim(outcome.is_bad):
        report_no_start(problem, outcome, leaves, new, t0)
    before = [_start(system, i, leaf) for i, leaf in enumerate(leaves)]
    found = [jnp.where(outcome.is_bad, before[i], new[i]) if i in new else leaf for i, leaf in enumerate(leaves)]
    return found, jnp.where(outcome.is_bad, 1.0, 0.0)


def _start(system: System, number: int, leaf: Any) -> Any:
    """The start value of a leaf, by default that of its class."""
    return system.flat.leaves[number].declaration.start if leaf is None else leaf
