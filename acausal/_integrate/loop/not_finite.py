"""The first saved point of a run at which a variable is not finite."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..._evaluate.observe import pairs_of
from ..._numbers import Numbers, Truth
from ..setup.field import RunArgs
from ..setup.settings import Settings
from .carry import Carry


class SavedPoint(NamedTuple):
    """A time, the vector for evaluating the equations there, and whether the solution shows the point."""

    t: Numbers
    y: Array
    is_shown: Truth


class NotFinite(NamedTuple):
    """Whether there is a non-finite point, and this point; if there is none, the last point checked."""

    exists: Truth
    point: SavedPoint


def first_saved_not_finite(settings: Settings, args: RunArgs, end: Carry) -> NotFinite:
    """The first saved point at which a variable is not finite, excluding the end of the run.

    Parameters and discrete variables are not checked: an infinite time may mean "never".
    """
    args, end = jax.lax.stop_gradient((args, end))
    system, forward = settings.system, args.forward
    none = NotFinite(jnp.asarray(False), SavedPoint(forward * end.t, end.y[settings.layout.point], jnp.asarray(True)))
    if settings.save == "end":
        return none
    pairs = pairs_of(system, system.flat.variable_leaves)
    n, point_at = (_of_times if end.record is None else _of_steps)(settings, forward, end)

    def goes_on(carry: tuple[Array, NotFinite]) -> Array:
        return (carry[0] < n) & ~carry[1].exists

    def look(carry: tuple[Array, NotFinite]) -> tuple[Array, NotFinite]:
        point = point_at(carry[0])
        values = system.evaluate(point.t, point.y, args.inputs, pairs, anew=True)
        return carry[0] + 1, NotFinite(point.is_shown & ~values.is_finite(), point)

    return jax.lax.while_loop(goes_on, look, (jnp.asarray(0), none))[1]


Points = tuple[Array, Callable[[Array], SavedPoint]]  # number of points, and the point of an index


def _of_times(settings: Settings, forward: Array, end: Carry) -> Points:
    """The points at the requested times."""
    rows, here = end.rows, settings.layout.point
    assert rows is not None

    def row(i: Array) -> SavedPoint:
        return SavedPoint(forward * rows.ts[i], rows.ys[i, here], jnp.asarray(True))

    # The times are padded with the last requested one, up to the number that the program is compiled for.
    return jnp.minimum(rows.n, 1 + jnp.sum(rows.ts < rows.ts[rows.n - 1])), row


def _of_steps(settings: Settings, forward: Array, end: Carry) -> Points:
    """The points at the recorded steps, and just before events."""
    record, here = end.record, settings.layout.point
    assert record is not None

    def row(i: Array) -> SavedPoint:
        return SavedPoint(forward * record.ts[i], record.ys[i, here], jnp.asarray(True))

    n = record.n + 1

    def point(i: Array) -> SavedPoint:
        j = jnp.maximum(i - n, 0)
        is_shown = jnp.isfinite(record.moments[j]) & (record.moments[j] > record.ts[0])
        before = SavedPoint(forward * record.moments[j], record.befores[j, here], is_shown)
        return jax.tree.map(lambda a, b: jnp.where(i < n, a, b), row(i), before)

    return n + record.n, point
