"""Step sizes that do not follow errors of rounding."""

from typing import Any

import diffrax
import jax.numpy as jnp

PER_OCTAVE = 4


class GriddedSteps(diffrax.PIDController):
    """Step sizes rounded to powers of 2^(1/4).

    Reverse mode computes steps once more, with other rounding than the first time, and its derivative is that of the
    run only if they are the same steps. A step size that varies in its last digits with the error estimate would go
    astray; on a grid it comes out the same, but for the rare one that lies half-way between two of its points.
    """

    def init(self, terms: Any, t0: Any, *others: Any, **named: Any) -> Any:
        t1, state = super().init(terms, t0, *others, **named)
        return on_grid(t0, t1), state

    def adapt_step_size(self, *args: Any, **named: Any) -> Any:
        keep, t0, t1, jump, state, result = super().adapt_step_size(*args, **named)
        return keep, t0, on_grid(t0, t1), jump, state, result


def on_grid(t0: Any, t1: Any) -> Any:
    """The end of a step that begins at t0 and is to end about t1."""
    width = jnp.maximum(t1 - t0, jnp.finfo(jnp.float64).tiny)
    return t0 + jnp.exp2(jnp.round(PER_OCTAVE * jnp.log2(width)) / PER_OCTAVE)
