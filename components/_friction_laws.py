"""Friction laws as plain functions, used both for torque over angular speed and for force over speed."""

import jax.numpy as jnp

from acausal import Energy, Scalar

STEEP = 50.0  # bound on the exponent; the stages of an accepted step never lie so far beyond rest


def stribeck(speed: Scalar, sliding: Scalar, static: Scalar, stribeck_speed: Scalar) -> Scalar:
    """Friction level, from `static` at rest down to `sliding`: sliding + (static - sliding) exp(-(v/vs)^2)."""
    return sliding + (static - sliding) * jnp.exp(-((speed / stribeck_speed) ** 2))


def tustin(
    speed: Scalar, F_prop: Scalar, F_Coulomb: Scalar, F_Stribeck: Scalar, fexp: Scalar, moving: Scalar
) -> Scalar:
    """Friction at a speed above zero, F_prop v + F_Coulomb + F_Stribeck exp(-fexp v).

    The law continues smoothly below zero, where the stages of a step that ends at rest can lie. If the integration
    error takes a body there that has broken away but is not `moving` yet, the last term decreases instead, so that the
    body is driven onward.
    """
    x = fexp * speed
    falls = (speed < 0.0) & (moving < 0.5)
    return F_prop * speed + F_Coulomb + F_Stribeck * jnp.exp(jnp.where(falls, x, jnp.minimum(-x, STEEP)))


def bristle_slip(size: Scalar, z: Scalar, stiffness: Scalar, level: Scalar) -> Scalar:
    """Slip speed of bristles with the deflection z; `size` is the absolute relative speed of the bodies."""
    return stiffness * size * z / level


def bristle_force(
    speed: Scalar, slip: Scalar, z: Scalar, *, stiffness: Scalar, damping: Scalar, viscous: Scalar
) -> Scalar:
    """sigma_0 z + sigma_1 dz/dt + sigma_2 v, with dz/dt = v - slip."""
    return stiffness * z + damping * (speed - slip) + viscous * speed


def bristle_energy(speed: Scalar, slip: Scalar, z: Scalar, *, stiffness: Scalar, force: Scalar) -> Energy:
    """Energy account of the bristles: they store energy as a spring does and dissipate the rest."""
    return Energy(stored=0.5 * stiffness * z**2, dissipated=force * speed - stiffness * z * (speed - slip))
