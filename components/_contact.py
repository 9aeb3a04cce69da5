"""Elastic contact with damping that is limited to the size of the elastic part, so that contact never pulls."""

import jax.numpy as jnp
from jax import Array

from acausal import Events, Scalar

from . import _pieces as pieces
from ._stick_slip import REST

SLACK = 1e-13  # m or rad by which what touches has to go apart: rounding does not part it


def damping(proposed: Scalar, most: Scalar, piece: Scalar, touches: Array | bool) -> Scalar:
    """The damping in contact, within -most .. most by the `piece` that holds, and none without contact."""
    return jnp.where(touches, pieces.limited(proposed, piece, -most, most), 0.0)


def limits(d: Scalar, speed: Scalar, most: Scalar, piece: Scalar, touches: Array | bool) -> Events:
    """That the damping d speed reaches its limits, which changes the discrete variable `damped`.

    What touches without a speed has none to be limited: both sizes are zero but for rounding there.
    """
    moves = (piece != 1.0) | (jnp.abs(speed) > REST)
    return pieces.passes(d * speed, piece, -most, most, name="damped", only=touches & moves)
