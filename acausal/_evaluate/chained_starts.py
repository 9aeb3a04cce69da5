"""Start values of dependent variables that follow from others one equation at a time."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._numbers import Numbers
from .._reduce.chain import chain, entries_of
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted
from .plan import Plan
from .program import chained_program_of
from .starts import Inputs
from .system import System


def chained(system: System, x: Float[Array, " elements"], given: np.ndarray, t: Numbers, inputs: Inputs) -> Array:
    """The start values x of the constrained pairs. A value that follows from others by a single equation replaces its
    guess.

    Values that are `given` have priority over the remaining states. The search for values that satisfy all constraints
    then starts near its solution, and not where derivatives do not exist, such as at a vector of zeros that is
    normalised.
    """
    pairs, ordered, size = system.constraints.pairs, system.ordered, system.plan.size
    ends = np.cumsum([size(variable) for variable, _ in pairs])
    held = [pair for pair, end in zip(pairs, ends.tolist(), strict=True) if given[end - 1]]
    steps = chain(ordered, ordered.constraints, held, ordered.states)
    levels = _levels(ordered, steps)
    uses = [(levels[step[1]], chained_program_of(ordered, [step], [], system.kind_index)) for step in steps]
    plan = Plan(uses, pairs, system.plan.shapes)
    found = plan.collect(plan.evaluate(x, t, inputs.params, system.starts.guess(inputs), pairs), pairs)
    return jnp.where(jnp.isfinite(found), found, x)


def _levels(ordered: Sorted, steps: Sequence[tuple[int, Pair]]) -> dict[Pair, int]:
    """The number of steps before each one on the longest path."""
    levels: dict[Pair, int] = {}
    for row, pair in steps:
        levels[pair] = 1 + max([levels.get(other, 0) for other in entries_of(ordered, row) if other != pair], default=0)
    return levels
