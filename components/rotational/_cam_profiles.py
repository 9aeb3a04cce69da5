"""Lift of a cam's follower over the cam angle."""

import abc

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from acausal import Param, ParameterError, Record, Scalar, Vector, magnitude, positive

from .._checks import check, increasing
from .._tables import cubic, interval, periodic_spline


class CamProfile(Record, partial=True):
    """The follower's lift l in m as a smooth function of the cam angle in rad."""

    @abc.abstractmethod
    def lift(self, angle: Scalar) -> Scalar:
        """l(angle) in m."""

    def slope(self, angle: Scalar) -> Scalar:
        """l'(angle) in m/rad."""
        angle = jnp.asarray(angle, dtype=float)
        return jax.jvp(self.lift, (angle,), (jnp.ones_like(angle),))[1]


class LinearLift(CamProfile):
    """l = rate angle: an Archimedean spiral, or any cam linearised."""

    rate: Param[Scalar, "m/rad"]  # lift per angle

    def lift(self, angle: Scalar) -> Scalar:
        return self.rate * angle


class EccentricDisc(CamProfile):
    """A disc turning about a point off its centre, with a follower in line with that point.

    l = -e cos(angle) + sqrt(R^2 - e^2 sin^2(angle)) - (R - e): zero at the lowest point, angle = 0, and 2 e half a
    turn on. It is the slider-crank with crank e and connecting rod R.
    """

    eccentricity: Param[Scalar, "m", positive]  # e, smaller than the radius
    radius: Param[Scalar, "m", positive]  # R, of the disc, plus that of the follower's roller

    def __check_init__(self) -> None:
        if not isinstance(self.radius, Tracer):
            radius = np.asarray(self.radius)
            check(self, "eccentricity", lambda value: value < radius, f"smaller than the radius {radius}")

    def lift(self, angle: Scalar) -> Scalar:
        e, radius = self.eccentricity, self.radius
        return -e * jnp.cos(angle) + jnp.sqrt(radius**2 - (e * jnp.sin(angle)) ** 2) - (radius - e)


class TabulatedLift(CamProfile):
    """A periodic cubic spline through given lifts: `TabulatedLift(angles=..., lifts=...)`; l'' is continuous.

    `angles` in rad increase and span one period, at whose two ends the lifts, in m, agree. The profile stores the
    spline's coefficients: to vary the lifts, or to differentiate with respect to them, build it from them.
    """

    angles: Param[Vector, "rad"]  # knots
    coefficients: Param[Vector, "m"]  # of the powers 0 to 3 (rows) of the angle on each interval (columns)

    def __init__(self, *, angles: Vector, lifts: Vector) -> None:
        self.angles = jnp.asarray(magnitude(angles, "rad", "TabulatedLift.angles"), dtype=float)
        lifts = jnp.asarray(magnitude(lifts, "m", "TabulatedLift.lifts"), dtype=float)
        check(self, "angles", increasing, "increasing")
        if not isinstance(lifts, Tracer):
            first, last = np.asarray(lifts)[[0, -1]]
            if not np.isclose(first, last, rtol=0.0, atol=1e-9):
                raise ParameterError(f"TabulatedLift needs equal lifts at both ends, got {first} and {last} m.")
        self.coefficients = periodic_spline(self.angles, lifts)

    def lift(self, angle: Scalar) -> Scalar:
        first, last = self.angles[0], self.angles[-1]
        angle = first + jnp.mod(angle - first, last - first)
        i = interval(angle, self.angles)
        return cubic(self.coefficients[:, i], angle - self.angles[i])
