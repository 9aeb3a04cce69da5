"""Powell's step: along the steepest descent and then towards Newton's step, up to the edge of a trust region."""

import jax.numpy as jnp
from jax import Array


def powell_step(value: Array, slopes: Array, newton: Array, radius: Array) -> Array:
    """The step that reduces |value + slopes step| on the dogleg path (Nocedal and Wright, Numerical Optimization, 2006,
    section 4.1). The path ends at the minimum along the steepest descent if Newton's step is not finite.
    """
    gradient = value @ slopes
    image = slopes @ gradient
    descent = -(gradient @ gradient) / (image @ image) * gradient
    end = jnp.where(jnp.all(jnp.isfinite(newton)), newton, descent)
    rest = end - descent
    first, last = jnp.linalg.norm(descent), jnp.linalg.norm(end)
    a, b, c = rest @ rest, descent @ rest, radius**2 - descent @ descent
    share = c / (b + jnp.sqrt(jnp.maximum(b**2 + a * c, 0.0)))
    across = descent + jnp.where(jnp.isfinite(share), share, 0.0) * rest
    return jnp.where(last <= radius, end, jnp.where(first >= radius, radius / first * descent, across))
