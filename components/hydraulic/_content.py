"""Liquid content V r(p) of a volume with rigid or elastic walls, V = volume (1 + wall p)."""

import jax.numpy as jnp

from acausal import Energy, Scalar

from ._liquids import AnyLiquid

EMPTY = "only vapour is left in the volume: limit the flow drawn from it, or refill it"


def capacity(liquid: AnyLiquid, volume: Scalar, p: Scalar, wall: Scalar) -> Scalar:
    """Hydraulic capacity C in m3/Pa, the inflow q over dp/dt; volume in m3 at atmospheric pressure, wall in 1/Pa."""
    return volume * ((1.0 + wall * p) * liquid.compressibility(p) + wall * liquid.relative_density(p))


def account(liquid: AnyLiquid, volume: Scalar, p: Scalar, wall: Scalar, inflow: Scalar) -> Energy:
    """Energy account of liquid and walls together, for one volume or an array of volumes."""
    growth = volume * wall * inflow / capacity(liquid, volume, p, wall)
    of_liquid = liquid.account(p, volume * (1.0 + wall * p), inflow, growth)
    return of_liquid._replace(stored=of_liquid.stored + jnp.sum(0.5 * volume * wall * p**2))
