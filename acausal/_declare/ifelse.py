"""`ifelse`: an if-expression with a relation, whose truth is held between events."""

import jax
import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers, Truth


@jax.jit
def held_relation(condition: Array) -> Array:
    """Marks a condition in a traced program: there it is a call of this name, elsewhere it is the condition."""
    return condition


HELD = "held_relation"


def ifelse(condition: Truth, if_true: Numbers, if_false: Numbers) -> Array:
    """`if_true` where `condition` holds, else `if_false`, as in `ifelse(self.u.value > self.u_max, self.u_max, ...)`.

    In `equations`, the truth of the condition is held during a step, so that the equations are smooth up to its end and
    beyond. That it changes is an event, located like those of `when`. The condition is a relation between real numbers,
    or several joined by `&`, `|` and `~`; it may not read derivatives. A change counts only where the two sides of the
    relation differ by more than a 1e-12th of their nominal sizes, so that rounding does not cause events.

    Elsewhere, as in an energy account, it is `jnp.where`. So is a plain `jnp.where` in equations (Modelica's
    `noEvent`): steps go over its corner, which costs them their order.
    """
    return jnp.where(held_relation(jnp.asarray(condition)), if_true, if_false)


def segment(x: Numbers, knots: Numbers) -> Array:
    """How many of the `knots`, which do not decrease, x has passed: the piece of a table that it lies in.

    In `equations`, it is held as the truth of `ifelse` is: the curve of the piece goes on beyond its ends.
    """
    return jnp.sum(held_relation(x >= jnp.asarray(knots)))
