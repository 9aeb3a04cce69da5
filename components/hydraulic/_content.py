"""What a volume with rigid or yielding walls takes up of a liquid: V = volume (1 + wall p), content V r(p)."""

import jax.numpy as jnp

from acausal import Energy, Scalar

from ._liquids import AnyLiquid

EMPTY = "nothing is left there of its liquid but vapour: limit what is drawn from it, or let it be filled again"


def capacity(liquid: AnyLiquid, volume: Scalar, p: Scalar, wall: Scalar) -> Scalar:
    """C in m3/Pa, the inflow q over dp/dt, with volume in m3 at atmospheric pressure and wall in 1/Pa."""
    return volume * ((1.0 + wall * p) * liquid.compressibility(p) + wall * liquid.relative_density(p))


def account(liquid: AnyLiquid, volume: Scalar, p: Scalar, wall: Scalar, inflow: Scalar) -> Energy:
    """Energy account of liquid and walls together, for numbers or arrays of volumes."""
    growth = volume * wall * inflow / capacity(liquid, volume, p, wall)
    of_liquid = liquid.account(p, volume * (1.0 + wall * p), inflow, growth)
    return of_liquid._replace(stored=of_liquid.stored + jnp.sum(0.5 * volume * wall * p**2))
