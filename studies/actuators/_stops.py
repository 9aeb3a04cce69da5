"""Elastic end stops of a rod and of a shaft."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Requirements, Scalar, eq, nonnegative, positive, require
from components import rotational, translational


def _pressed(x: Scalar, width: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Smoothed indentation of a stop at a distance x beyond it, its integral over x, and its slope.

    The indentation is x^2/(2 width) up to the width, and x - width/2 beyond. Force and slope are continuous, and zero
    without contact.
    """
    inside, beyond = jnp.clip(x, 0.0, width), jnp.maximum(x - width, 0.0)
    indentation = 0.5 * inside**2 / width + beyond
    integral = inside**3 / (6.0 * width) + 0.5 * beyond * (beyond + width)
    return indentation, integral, inside / width


class RodStops(translational.ToGround):
    """Elastic stops that push a rod back into s_min <= s <= s_max, f = c (x_max - x_min) + d slope v.

    x is the smoothed indentation of a stop at a distance s beyond it: s^2/(2 w) up to the width w, and s - w/2 beyond.
    The damping grows with the indentation and vanishes without contact. It dissipates energy, and may pull at the rod
    as it leaves the stop.
    """

    s_min: Param[Scalar, "m"]
    s_max: Param[Scalar, "m"]
    c: Param[Scalar, "N/m", positive] = 1e7
    d: Param[Scalar, "N.s/m", nonnegative] = 2e3
    w: Param[Scalar, "m", positive] = 1e-5

    def requirements(self) -> Requirements:
        return (require(self.s_min < self.s_max, "s_min must be smaller than s_max"),)

    def equations(self, d: Self) -> Equations:
        (low, _, slope_low), (high, _, slope_high) = self._ends()
        force = self.c * (high - low) + self.d * (slope_low + slope_high) * self.v
        return super().equations(d) | dict(contact=eq(self.flange.f, force))

    def energy(self) -> Energy:
        (_, low, slope_low), (_, high, slope_high) = self._ends()
        return Energy(stored=self.c * (low + high), dissipated=self.d * (slope_low + slope_high) * self.v**2)

    def _ends(self) -> tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]:
        s = self.flange.s
        return _pressed(self.s_min - s, self.w), _pressed(s - self.s_max, self.w)


class ShaftStops(rotational.ToGround):
    """Elastic stops that push a shaft back into phi_min <= phi <= phi_max, with the law of `RodStops`."""

    phi_min: Param[Scalar, "rad"]
    phi_max: Param[Scalar, "rad"]
    c: Param[Scalar, "N.m/rad", positive] = 500.0
    d: Param[Scalar, "N.m.s/rad", nonnegative] = 0.5
    width: Param[Scalar, "rad", positive] = 1e-3

    def requirements(self) -> Requirements:
        return (require(self.phi_min < self.phi_max, "phi_min must be smaller than phi_max"),)

    def equations(self, d: Self) -> Equations:
        (low, _, slope_low), (high, _, slope_high) = self._ends()
        torque = self.c * (high - low) + self.d * (slope_low + slope_high) * self.w
        return super().equations(d) | dict(contact=eq(self.flange.tau, torque))

    def energy(self) -> Energy:
        (_, low, slope_low), (_, high, slope_high) = self._ends()
        return Energy(stored=self.c * (low + high), dissipated=self.d * (slope_low + slope_high) * self.w**2)

    def _ends(self) -> tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]:
        phi = self.flange.phi
        return _pressed(self.phi_min - phi, self.width), _pressed(phi - self.phi_max, self.width)
