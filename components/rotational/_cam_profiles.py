"""Follower lift over the cam angle: profiles, and rise, dwell and return with standard motion laws."""

import abc
from typing import Any

import jax
import jax.numpy as jnp

from acausal import Param, Record, Requirements, Scalar, Vector, magnitude, nonnegative, positive, require

from .._checks import increasing, numbers
from .._limit import limited
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


_DEGREE = 5


class Motion(Record, partial=True):
    """A motion law: fraction f of the lift over the fraction u of the angle, from 0 to 1, at rest at both ends."""

    @abc.abstractmethod
    def share(self, u: Scalar) -> Scalar:
        """f(u) for 0 <= u <= 1."""


class Polynomial345(Motion):
    """f = 10 u^3 - 15 u^4 + 6 u^5; maximum f' 15/8, f'' 10/sqrt(3), f''' 60 (VDI 2143-1)."""

    def share(self, u: Scalar) -> Scalar:
        return u**3 * (10.0 - u * (15.0 - 6.0 * u))


class Cycloidal(Motion):
    """f = u - sin(2 pi u)/(2 pi) (Bestehorn sinoid); maximum f' 2, f'' 2 pi, f''' 4 pi^2 (VDI 2143-1)."""

    def share(self, u: Scalar) -> Scalar:
        return u - jnp.sin(2.0 * jnp.pi * u) / (2.0 * jnp.pi)


class ModifiedSine(Motion):
    """Quarter sine waves of acceleration in the outer eighths, a slower half wave between them (Neklutin; VDI 2143-1).

    With c = 1/(4 + pi): f = c (pi u - sin(4 pi u)/4) for u < 1/8, c (2 + pi u - 9/4 sin(pi/3 + 4 pi u/3)) up to 7/8 and
    c (4 + pi u - sin(4 pi u)/4) beyond. Maximum f' 4 pi/(4 + pi), f'' 4 pi^2/(4 + pi), f''' 16 pi^3/(4 + pi).
    """

    def share(self, u: Scalar) -> Scalar:
        outer = -0.25 * jnp.sin(4.0 * jnp.pi * u)
        middle = 2.0 - 2.25 * jnp.sin(jnp.pi / 3.0 + 4.0 * jnp.pi / 3.0 * u)
        share = jnp.where(u < 0.125, outer, jnp.where(u > 0.875, 4.0 + outer, middle))
        return (share + jnp.pi * u) / (4.0 + jnp.pi)


class BSplineMotion(Motion):
    """A B-spline of degree 5 with uniform knots, at rest at both ends; its free control values shape the motion.

    The control values are three zeros, `controls`, three ones, so that f, f' and f'' are 0, 0, 0 at the start and 1, 0,
    0 at the end, and f'''' is continuous in between (de Boor, `A Practical Guide to Splines`). If the control values
    increase, so does f. Without inner control values it would be the 3-4-5 polynomial.
    """

    controls: Param[Vector, "1"]  # inner control values, one or more

    def requirements(self) -> Requirements:
        return (require(jnp.ndim(self.controls) == 1 and jnp.size(self.controls) > 0, "controls must be a list"),)

    def share(self, u: Scalar) -> Scalar:
        values = jnp.concatenate([jnp.zeros(3), self.controls, jnp.ones(3)])
        intervals = len(values) - _DEGREE
        ends = jnp.zeros(_DEGREE), jnp.ones(_DEGREE)
        knots = jnp.concatenate([ends[0], jnp.linspace(0.0, 1.0, intervals + 1), ends[1]])
        at = _DEGREE + jnp.clip(jnp.floor(u * intervals).astype(int), 0, intervals - 1)
        basis = (jnp.arange(len(knots) - 1) == at).astype(float)
        for degree in range(1, _DEGREE + 1):
            left, right = knots[: -degree - 1], knots[degree + 1 :]
            rise, fall = knots[degree:-1] - left, right - knots[1:-degree]
            first = (u - left) / jnp.where(rise > 0.0, rise, 1.0) * basis[:-1]
            second = (right - u) / jnp.where(fall > 0.0, fall, 1.0) * basis[1:]
            basis = jnp.where(rise > 0.0, first, 0.0) + jnp.where(fall > 0.0, second, 0.0)
        return basis @ values


class RiseDwellReturn(CamProfile):
    """Rise by `height`, dwell, return by the same law, lower dwell for the rest of the turn: l = h [f(u) - f(u')].

    u = angle/rise and u' = (angle - rise - dwell)/fall, each limited to 0 .. 1, with the angle modulo one turn. The
    motions of the library have zero speed and acceleration at their ends, so that l'' is continuous.
    """

    motion: Motion
    height: Param[Scalar, "m", positive]  # h
    rise: Param[Scalar, "rad", positive]  # angle of the rise
    dwell: Param[Scalar, "rad", nonnegative]  # angle of the upper dwell
    fall: Param[Scalar, "rad", positive]  # angle of the return

    def requirements(self) -> Requirements:
        turn = self.rise + self.dwell + self.fall
        return (require(turn <= 2.0 * jnp.pi + 1e-9, "rise, dwell and fall must be within one turn"),)

    def lift(self, angle: Scalar) -> Scalar:
        angle = jnp.mod(angle, 2.0 * jnp.pi)
        up = limited(angle / self.rise, 0.0, 1.0)
        down = limited((angle - self.rise - self.dwell) / self.fall, 0.0, 1.0)
        return self.height * (self.motion.share(up) - self.motion.share(down))
