"""Elastic contact with damping that is limited to the size of the elastic part, so that contact never pulls."""

from typing import Any

import jax.numpy as jnp

from acausal import Events, Scalar

from . import _pieces as pieces


def damping(proposed: Scalar, most: Scalar, piece: Scalar, touches: Any) -> Scalar:
    """The damping in contact, within -most .. most by the `piece` that holds, and none without contact."""
    return jnp.where(touches, pieces.limited(proposed, piece, -most, most), 0.0)


def limits(proposed: Scalar, most: Scalar, piece: Scalar, touches: Any) -> Events:
    """That the limits are reached, which changes the discrete variable `damped`."""
    return pieces.passes(proposed, piece, -most, most, name="damped", only=touches)
