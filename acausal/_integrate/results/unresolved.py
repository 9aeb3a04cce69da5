"""States so small that their errors are held by their nominal sizes, and add up to a good part of them."""

import math
import warnings
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._errors import ModelError, listed
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._reduce.jaxpr import slice_output
from ..._tracing import known
from ..setup.result import is_success

if TYPE_CHECKING:
    from .solution import Solution

SMALL = 0.01  # for a state that stays below this share of its nominal size, the tolerated error is large
NOISE = 1e-10  # a state that stays below this share of its nominal size is zero but for rounding
DOUBT = 0.01  # the errors of all steps together may be this share of a state's largest value
STEPS = 100  # or this many times rtol, where that is larger


class UnresolvedWarning(UserWarning):
    """Variables of a run are so small that the error tolerance means little for them."""


def are_unresolved(sizes: np.ndarray, rtol: Numbers, largest: Array, total: Array) -> Array:
    """Which states are unresolved, from their nominal sizes, their largest absolute values in a run, and the sums of
    the errors of all steps.
    """
    is_small = (largest < SMALL * sizes) & (largest > NOISE * sizes)
    return is_small & (total > jnp.maximum(DOUBT, STEPS * rtol) * largest)


def are_blurred(band: Array, back: Array, armed: Array, farthest: Array) -> Array:
    """How far the crossing functions of relations were from zero that have changed, and never were farther than the
    error of a run (`back`), though farther than rounding (`band`); zero for all others.
    """
    return jax.lax.stop_gradient(jnp.where(~armed & (farthest <= back) & (farthest > band), farthest, 0.0))


def unresolved(solution: "Solution") -> dict[str, float]:
    """The variables, with their largest absolute values; of a batch, those of any member.

    Raises `ModelError` within `jit` and `vmap`, where they are not known yet.
    """
    system = solution.system
    flags, largest, blurred = (known(x) for x in (solution._unresolved, solution._largest, solution._blurred))
    if flags is None or largest is None or blurred is None:
        raise ModelError(
            "Within jit and vmap, sol.unresolved is not known yet: return the solution, and look at it there."
        )
    found: dict[str, float] = {}
    for i, name in enumerate(_names(system)):
        if np.any(flags[..., i]):
            found[name] = max(found.get(name, 0.0), float(np.max(largest[..., i][flags[..., i]])))
    for i, names in enumerate(_compared(system) if np.any(blurred) else []):
        size = float(np.max(blurred[..., i]))
        found |= {name: max(found.get(name, 0.0), size) for name in names if size > 0.0}
    return found


def _compared(system: System) -> list[list[str]]:
    """The variables that each relation of the components reads."""
    assert system.events is not None
    margins, leaves, found = system.events.margins, system.flat.leaves, []
    for i, aval in enumerate(margins.closed.out_avals):
        read = [leaves[margins.leaves[place]] for place in slice_output(margins.closed, i).used]
        read = [leaf for leaf in read if leaf.declaration.is_variable]
        for member in range(math.prod(aval.shape)):
            found.append([leaf.name(member if leaf.count == math.prod(aval.shape) else 0) for leaf in read])
    return found


def _names(system: System) -> list[str]:
    """The variable behind each element of the state vector, a derivative being that of a variable."""
    table = system.ordered.table
    pairs = [*system.states, *system.algebraic]
    return [table.variable_name(variable) for variable, _ in pairs for _ in range(system.plan.size(variable))]


def warn_of_unresolved(solution: "Solution") -> None:
    """Tell of unresolved variables, where numbers are known."""
    flags, blurred = known(solution._unresolved), known(solution._blurred)
    fine = known(is_success(solution.result))
    if flags is None or blurred is None or fine is None or not (np.any(flags) or np.any(blurred)) or not np.any(fine):
        return
    found = unresolved(solution)
    said = listed([f"{name} (at most {size:.3g})" for name, size in found.items()])
    sizes = ", ".join(f"{name!r}: {size:.0e}" for name, size in list(found.items())[:12])
    message = (
        f"The error tolerance means little for {said}: they stay far below their nominal sizes, which their errors are "
        f"held to. Remedy: give theirs, as in simulate(..., nominal={{{sizes}}}), or reduce rtol."
    )
    warnings.warn(message, UnresolvedWarning, stacklevel=4)  # behind this, `simulate` and its decorator
