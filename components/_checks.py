"""Requirements shared by several components."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from acausal import Component, ParameterError, Record, Requirements, require


def increasing(knots: Any) -> Any:
    """Whether each number exceeds the previous one."""
    return knots[1:] > knots[:-1]


def sampled(owner: Component | Record, values: str, *knots: str) -> Requirements:
    """Requires two or more increasing knots on each axis, and one value for each of them."""
    shapes = {name: jnp.shape(getattr(owner, name)) for name in knots}
    for name, shape in shapes.items():
        if len(shape) != 1 or shape[0] < 2:
            return (require(False, f"{name} must be two or more increasing numbers"),)
    wanted, found = tuple(shape[0] for shape in shapes.values()), jnp.shape(getattr(owner, values))
    if found != wanted:
        return (require(False, f"{values} must have shape {wanted}"),)
    return tuple(
        require(increasing(getattr(owner, name)), f"{name} must be two or more increasing numbers") for name in knots
    )


def damping(owner: Component | Record, efforts: str, speeds: str) -> Requirements:
    """Requires a sampled curve of efforts over speeds that passes through the origin and does not deliver power."""
    known, w, values = sampled(owner, efforts, speeds), getattr(owner, speeds), getattr(owner, efforts)
    if jnp.shape(w) != jnp.shape(values):
        return known
    return (
        *known,
        require(jnp.any(w == 0.0), f"{speeds} must include 0"),
        require(jnp.where(w == 0.0, values == 0.0, w * values >= 0.0), f"{efforts} must have the sign of {speeds}"),
    )


def ends_at(stop: Any, stroke: Any, name: str) -> Requirements:
    """Requires that a stop allows the travel from 0 to the stroke of the parts that it limits."""
    return (
        require(stop.s_min == 0.0, "stop.s_min must be 0"),
        require(stop.s_max == stroke, f"stop.s_max must equal {name}"),
    )


def numbers(owner: Component | Record, name: str, value: Any) -> Array:
    """Converts a value to an array of floats; raises `ParameterError` if this is impossible."""
    try:
        return jnp.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"{type(owner).__name__}.{name} must be a real number or an array of them, got {value!r}."
        ) from error


def check_shape(owner: Component | Record, name: str, shape: tuple[int, ...]) -> None:
    """Raises `ParameterError` unless the value has the given shape."""
    found = np.shape(getattr(owner, name))
    if found != shape:
        raise ParameterError(f"{type(owner).__name__}.{name} must have shape {shape}, got {found}.")
