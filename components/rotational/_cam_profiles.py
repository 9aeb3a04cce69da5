"""Follower lift over the cam angle."""

import abc
from typing import Any

import jax
import jax.numpy as jnp

from acausal import (
    Param,
    Record,
    Requirements,
    Scalar,
    Vector,
    magnitude,
    positive,
    require,
)

from .._checks import increasing, numbers
from .._tables import cubic, interval, periodic_spline


class CamProfile(Record, partial=True):
    """Follower lift l in m as a smooth function of the cam angle in rad."""

    @abc.abstractmethod
    def lift(self, angle: Scalar) -> Scalar:
        """l(angle) in m."""

    def slope(self, angle: Scalar) -> Scalar:
        """l'(angle) in m/rad."""
        angle = jnp.asarray(angle, dtype=float)
        return jax.jvp(self.lift, (angle,), (jnp.ones_like(angle),))[1]


class LinearLift(CamProfile):
    """l = rate angle: an Archimedean spiral, or the linearisation of any cam."""

    rate: Param[Scalar, "m/rad"]  # lift per angle

    def lift(self, angle: Scalar) -> Scalar:
        return self.rate * angle


class EccentricDisc(CamProfile):
    """An eccentric disc with a knife-edge or roller follower in line with the axis of rotation.

    l = -e cos(angle) + sqrt(R^2 - e^2 sin^2(angle)) - (R - e): zero at the lowest point, angle = 0, and 2 e half a
    turn later. It is a slider-crank with crank e and connecting rod R. For a flat follower see `FlatEccentricDisc`.
    """

    eccentricity: Param[Scalar, "m", positive]  # e, smaller than the radius
    radius: Param[Scalar, "m", positive]  # R, radius of the disc plus that of the roller

    def requirements(self) -> Requirements:
        return (require(self.eccentricity < self.radius, "eccentricity must be smaller than radius"),)

    def lift(self, angle: Scalar) -> Scalar:
        e, radius = self.eccentricity, self.radius
        return -e * jnp.cos(angle) + jnp.sqrt(radius**2 - (e * jnp.sin(angle)) ** 2) - (radius - e)


class FlatEccentricDisc(CamProfile):
    """An eccentric disc with a flat follower: l = e (1 - cos(angle)), a harmonic motion."""

    eccentricity: Param[Scalar, "m", positive]  # e

    def lift(self, angle: Scalar) -> Scalar:
        return self.eccentricity * (1.0 - jnp.cos(angle))


def _continue(ends: Vector, starts: Vector) -> Any:
    """Whether each interval of a periodic function begins at the end value of the previous one."""
    return jnp.max(jnp.abs(ends - jnp.roll(starts, -1))) <= 1e-6 * jnp.max(jnp.abs(starts))


class TabulatedLift(CamProfile):
    """A periodic cubic spline through given lifts: `TabulatedLift(angles=..., lifts=...)`; l'' is continuous.

    `angles` in rad increase over one period; the lifts, in m, are equal at its two ends. The profile stores the spline
    coefficients: to vary the lifts or to differentiate with respect to them, build a new profile from the lifts.
    """

    angles: Param[Vector, "rad"]  # knots
    coefficients: Param[Vector, "m"]  # coefficients of the powers 0 to 3 of the angle (rows) on each interval (columns)

    def __init__(
        self,
        *,
        angles: Param[Vector, "rad"],  # increasing, over one period
        lifts: Param[Vector, "m"],  # lifts at these angles, equal at both ends
    ) -> None:
        self.angles = numbers(self, "angles", magnitude(angles, "rad", "TabulatedLift.angles"))
        lifts = numbers(self, "lifts", magnitude(lifts, "m", "TabulatedLift.lifts"))
        self.coefficients = periodic_spline(self.angles, lifts)

    def requirements(self) -> Requirements:
        angles, (c0, c1, c2, c3) = self.angles, self.coefficients
        h = jnp.diff(angles)
        end, slope = jnp.asarray(cubic(self.coefficients, h)), c1 + h * (2.0 * c2 + h * 3.0 * c3)
        return (
            require(increasing(angles), "angles must be increasing"),
            require(abs(end[-1] - c0[0]) < 1e-9, "lifts must be equal at both ends"),
            require(
                _continue(end, c0) & _continue(slope, c1),
                "coefficients must be those of the spline over angles: build a new profile from the lifts",
            ),
        )

    def lift(self, angle: Scalar) -> Scalar:
        first, last = self.angles[0], self.angles[-1]
        angle = first + jnp.mod(angle - first, last - first)
        i = interval(angle, self.angles)
        return cubic(self.coefficients[:, i], angle - self.angles[i])
