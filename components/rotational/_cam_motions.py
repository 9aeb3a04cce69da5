"""Rise, dwell and return of a cam follower with standard motion laws."""

import abc

import jax.numpy as jnp

from acausal import Param, Record, Requirements, Scalar, Vector, nonnegative, positive, require

from .._limit import limited
from ._cam_profiles import CamProfile

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
