"""The energy that each component stores in each mode."""

import functools as ft

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._integrate.results.energy import stored
from .._integrate.setup.user_function import UserFunction, trace
from .._interpret.in_parts import in_parts
from .._reduce.jaxpr import slice_output
from .eigenmodes import Shares
from .operating_point import OperatingPoint, invariants_at
from .redundant import curvature

NOTHING = 1e-22  # share of the energy of other modes that counts as rounding


def energy_shares(point: OperatingPoint, poles: Array, shapes: Array, independent: tuple[int, ...]) -> Shares:
    """The share of each component with stored energy in each mode; `shapes` are directions of all states.

    With a mode shape v and the Hessian H of a component's stored energy as a function of the states, v^H H v is twice
    its energy in that mode, averaged over a period. The shares are relative to the sum of absolute values.
    """
    quantity, constants = trace(stored, point.system.flat, "energy")
    values = _second_variations(quantity, independent, constants, point, shapes)
    total = jnp.sum(jnp.abs(values), axis=0)
    total = jnp.where(total > NOTHING * jnp.max(total, initial=0.0), total, jnp.inf)
    names = jax.tree_util.tree_unflatten(quantity.tree, range(quantity.n_outputs))
    stores = {name: i for name, i in names.items() if _depends(quantity, len(constants), i)}
    shares = (values / total)[np.array(list(stores.values()), int)]
    return Shares(shares, poles, tuple(stores), "energy")


def _depends(quantity: UserFunction, n_constants: int, output: int) -> bool:
    """Whether a component's stored energy depends on any variable, such as that of a mass."""
    return any(position >= n_constants for position in slice_output(quantity.closed, output).used)


@ft.partial(in_parts, static_argnums=(0, 1))
def _second_variations(
    quantity: UserFunction, independent: tuple[int, ...], constants: list[Array], point: OperatingPoint, v: Array
) -> Array:
    """v^H H v for each output of `quantity` (down) and each column of `v` (across), along the invariants."""
    invariants = invariants_at(point)

    def energies(y: Array) -> Array:
        values = quantity(constants, point.read(quantity.leaves, y))
        return jnp.stack(values) if values else jnp.zeros(0)

    def along(direction: Array) -> Array:
        def slope(y: Array) -> Array:
            return jax.jvp(energies, (y,), (direction,))[1]

        second = jax.jvp(slope, (point.y,), (direction,))[1]
        if invariants is None:
            return second
        bend = curvature(invariants, point.y, direction, np.array(independent))
        return second + jax.jvp(energies, (point.y,), (bend,))[1]

    return jax.vmap(lambda column: along(column.real) + along(column.imag), in_axes=1, out_axes=1)(v)
