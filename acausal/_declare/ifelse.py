"""`ifelse`: an if-expression whose relation is held between events."""

import jax
import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers, Truth


@jax.jit
def held_relation(condition: Array) -> Array:
    """Marks a condition in a traced program by a call of this name. The value is the condition."""
    return condition


HELD = "held_relation"


def ifelse(condition: Truth, if_true: Numbers, if_false: Numbers) -> Array:
    """`if_true` if `condition` holds, otherwise `if_false`: `ifelse(self.u.value > self.u_max, self.u_max, ...)`.

    In `equations`, the truth of the condition is held during a step, so that the equations are smooth across its end. A
    change of the condition is an event, located like those of `when`. The condition is a relation between real numbers,
    or several joined by `&`, `|` and `~`; it must not read derivatives. A change counts only if the two sides of the
    relation differ by more than 1e-12 of their nominal sizes, so rounding does not cause events.

    In other methods, such as `energy`, it is `jnp.where`. A plain `jnp.where` in equations (Modelica's `noEvent`) is
    not an event: steps across its kink lose their order.
    """
    return jnp.where(held_relation(jnp.asarray(condition)), if_true, if_false)


def segment(x: Numbers, knots: Numbers) -> Array:
    """The number of `knots`, in nondecreasing order, up to x: the segment of a table that contains x.

    In `equations`, it is held like the truth of `ifelse`: the curve of the segment continues beyond its ends.
    """
    return jnp.sum(held_relation(x >= jnp.asarray(knots)))
