"""Laws of friction as functions of numbers, for torques over angular speeds and forces over speeds alike."""

import jax.numpy as jnp

from acausal import Energy, Scalar

STEEP = 50.0  # no step that ends well has stages beyond rest where the law has grown by more than this power of e


def stribeck(speed: Scalar, sliding: Scalar, static: Scalar, stribeck_speed: Scalar) -> Scalar:
    """The level that falls from `static` at rest to `sliding`: sliding + (static - sliding) exp(-(v/vs)^2)."""
    return sliding + (static - sliding) * jnp.exp(-((speed / stribeck_speed) ** 2))


def tustin(
    speed: Scalar, F_prop: Scalar, F_Coulomb: Scalar, F_Stribeck: Scalar, fexp: Scalar, moving: Scalar
) -> Scalar:
    """Friction at a speed above zero, F_prop v + F_Coulomb + F_Stribeck exp(-fexp v).

    Below zero, where a step that leads to rest may have its stages, it goes on smoothly. Where what has broken away and
    is not `moving` yet comes there by the error of a step, the last part falls instead: it drives onward.
    """
    x = fexp * speed
    falls = (speed < 0.0) & (moving < 0.5)
    return F_prop * speed + F_Coulomb + F_Stribeck * jnp.exp(jnp.where(falls, x, jnp.minimum(-x, STEEP)))


def bristle_slip(size: Scalar, z: Scalar, stiffness: Scalar, level: Scalar) -> Scalar:
    """The speed at which bristles that are bent by z slide, where the bodies move with a speed of this size."""
    return stiffness * size * z / level


def bristle_force(
    speed: Scalar, slip: Scalar, z: Scalar, *, stiffness: Scalar, damping: Scalar, viscous: Scalar
) -> Scalar:
    """sigma_0 z + sigma_1 dz/dt + sigma_2 v, with dz/dt = v - slip."""
    return stiffness * z + damping * (speed - slip) + viscous * speed


def bristle_energy(speed: Scalar, slip: Scalar, z: Scalar, *, stiffness: Scalar, force: Scalar) -> Energy:
    """The bristles store energy as a spring; what else goes in is lost."""
    return Energy(stored=0.5 * stiffness * z**2, dissipated=force * speed - stiffness * z * (speed - slip))
