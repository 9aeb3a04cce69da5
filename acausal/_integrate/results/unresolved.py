"""States that are too small for the absolute tolerance, which their nominal sizes set."""

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

SMALL = 0.01  # below this fraction of the nominal size of a state, the tolerated error is large
NOISE = 1e-10  # below this fraction of the nominal size, a state is zero to within rounding
DOUBT = 0.01  # permitted sum of the errors of all steps, as a fraction of the largest value of a state
STEPS = 100  # the same as a multiple of rtol; the larger of both applies


class UnresolvedWarning(UserWarning):
    """Some variables of a run are too small for the error tolerance, so their values are inaccurate."""


def are_unresolved(sizes: np.ndarray, rtol: Numbers, largest: Array, total: Array) -> Array:
    """Mask of unresolved states, given their nominal sizes, their largest absolute values in a run, and the sums of the
    errors of all steps.
    """
    is_small = (largest < SMALL * sizes) & (largest > NOISE * sizes)
    return is_small & (total > jnp.maximum(DOUBT, STEPS * rtol) * largest)


def are_blurred(band: Array, back: Array, armed: Array, farthest: Array) -> Array:
    """The largest event indicator of each relation that has changed and stayed within the error of the run (`back`)
    but beyond rounding (`band`); zero for all others.
    """
    return jax.lax.stop_gradient(jnp.where(~armed & (farthest <= back) & (farthest > band), farthest, 0.0))


def unresolved(solution: "Solution") -> dict[str, float]:
    """The unresolved variables with their largest absolute values; in a batch, those of any member.

    Raises `ModelError` within `jit` and `vmap`, where the values are not known yet.
    """
    system = solution.system
    flags, largest, blurred = (known(x) for x in (solution._unresolved, solution._largest, solution._blurred))
    if flags is None or largest is None or blurred is None:
        raise ModelError(
            "Within jit and vmap, sol.unresolved is not known yet: return the solution and read it outside."
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
    indicators, leaves, found = system.events.indicators, system.flat.leaves, []
    for i, aval in enumerate(indicators.closed.out_avals):
        read = [leaves[indicators.leaves[place]] for place in slice_output(indicators.closed, i).used]
        read = [leaf for leaf in read if leaf.declaration.is_variable]
        for member in range(math.prod(aval.shape)):
            found.append([leaf.name(member if leaf.count == math.prod(aval.shape) else 0) for leaf in read])
    return found


def _names(system: System) -> list[str]:
    """The variable of each element of the state vector; for a derivative, the variable itself."""
    table = system.ordered.table
    pairs = [*system.states, *system.algebraic]
    return [table.variable_name(variable) for variable, _ in pairs for _ in range(system.plan.size(variable))]


def warn_of_unresolved(solution: "Solution") -> None:
    """Warn of unresolved variables if their values are known."""
    flags, blurred = known(solution._unresolved), known(solution._blurred)
    fine = known(is_success(solution.result))
    if flags is None or blurred is None or fine is None or not (np.any(flags) or np.any(blurred)) or not np.any(fine):
        return
    found = unresolved(solution)
    said = listed([f"{name} (at most {size:.3g})" for name, size in found.items()])
    sizes = ", ".join(f"{name!r}: {size:.0e}" for name, size in list(found.items())[:12])
    message = (
        f"The error tolerance is too coarse for {said}: they stay far below their nominal sizes, which set it. Remedy: "
        f"pass smaller nominal sizes, as in simulate(..., nominal={{{sizes}}}), or reduce rtol."
    )
    warnings.warn(message, UnresolvedWarning, stacklevel=4)  # skips this function, `simulate` and its decorator
