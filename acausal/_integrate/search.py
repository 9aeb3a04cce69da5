"""The search for a point that satisfies conditions, near another one."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from .._evaluate.blocks import row_scale
from .._evaluate.constraints import CLOSE

ITERATIONS = 200
METHOD = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
STAGES = 20  # of a homotopy
# Singular values below this share of the largest count as zero: what moves a point no more than that is undetermined.
RANK = 1e-9


class Found(eqx.Module):
    """The point, and the largest `violation` of a condition there; the rest explains a failure.

    `residual` is relative to the size of each condition, `slopes` the matrix by which they depend on the unknowns.
    """

    x: Any
    violation: Any
    residual: Any
    slopes: Any


def find_start(
    residual: Callable[[Any, Any], Any], x0: Any, numbers: Any, easy: Any, sizes: np.ndarray, weight: np.ndarray
) -> Found:
    """The x nearest to x0, by `weight` and `sizes`, with residual(x, numbers) = 0; a weight of 0 lets nothing move.

    The derivative is implicit: with C the derivative of the residual by x, measured in `sizes` times the roots of the
    weights, dx = dx0 - C^+ (C dx0 + dr), C^+ being the pseudo-inverse.
    """
    scale = sizes * np.sqrt(weight)
    held = jax.lax.stop_gradient

    def measured(z: Any, args: Any) -> Any:
        x0, numbers, rows = args
        return residual(x0 + scale * z, numbers) / rows

    start, fixed, easy = held(x0), held(numbers), held(easy)
    rows = row_scale(jax.jacfwd(lambda z: residual(start + scale * z, fixed))(jnp.zeros_like(start)))
    z = held(_searched(measured, (start, fixed, rows), (start, easy, rows)))
    slopes = held(jax.jacfwd(lambda z: measured(z, (start, fixed, rows)))(z))
    inverse = jnp.linalg.pinv(slopes, rtol=RANK)
    moved = held(scale * (z - inverse @ measured(z, (start, fixed, rows))))
    x = x0 + moved
    last = residual(x, numbers) / rows
    x = x - scale * (inverse @ last)
    final = held(residual(x, numbers) / rows)
    violation = jnp.max(jnp.abs(final), initial=0.0)
    return Found(jnp.where(violation <= CLOSE, x, jnp.nan), violation, final, slopes)


def _searched(measured: Callable[[Any, Any], Any], args: Any, easy: Any) -> Any:
    """Directly, or in stages where that fails: from easy numbers to the real ones, conditions taken on bit by bit."""
    direct, missed = _least(measured, jnp.zeros_like(args[0]), args)

    def in_stages() -> Any:
        lacking = measured(jnp.zeros_like(args[0]), easy)
        is_easier = any(a is not b for a, b in zip(jax.tree.leaves(args), jax.tree.leaves(easy), strict=True))
        share = 0.0 if is_easier else 1.0

        def stage(z: Any, s: Any) -> tuple[Any, None]:
            between = jax.tree.map(lambda a, b: a + (1.0 - s) * (b - a), args, easy)
            found, _ = _least(lambda z, args: measured(z, args) - share * (1.0 - s) * lacking, z, between)
            return found, None

        first, _ = _least(measured, jnp.zeros_like(args[0]), easy) if is_easier else (jnp.zeros_like(args[0]), None)
        return jax.lax.scan(stage, first, jnp.linspace(0.0, 1.0, STAGES + 1)[1:])[0]

    return jax.lax.cond(missed <= CLOSE, lambda: direct, in_stages)


def _least(function: Callable[[Any, Any], Any], z: Any, args: Any) -> tuple[Any, Any]:
    found = optx.least_squares(function, METHOD, z, args, max_steps=ITERATIONS, throw=False).value
    return found, jnp.max(jnp.abs(function(found, args)), initial=0.0)
