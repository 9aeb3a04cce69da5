"""Contact of a cam with its follower, from the lift: pressure angle, curvature, undercut, Hertz pressure."""

import abc
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from acausal import Param, Record, Requirements, Scalar, Vector, positive, require

from ._cam_profiles import CamProfile

STEEL = 113.2e9  # Pa, E/(2 (1 - nu^2)) for a pair of steel, E = 206 GPa, nu = 0.3
_SAMPLES = 2048  # in a turn, among which the least radius is looked for
_NEWTON = 5


class CamContact(NamedTuple):
    """What `Follower.contact` tells at given angles."""

    pressure_angle: Array  # between the normal of the contact and the follower's axis, in rad
    radius: Array  # of curvature of the cam, in m; see `Follower.radius` for its sign
    normal_force: Array  # in N
    hertz_pressure: Array  # largest pressure in the contact, in Pa; NaN without contact


class Follower(Record, partial=True):
    """A translating follower, whose lift s over the cam angle, with its derivatives s' and s'', shapes the cam.

    Norton, `Cam Design and Manufacturing Handbook`, ch. 7; the contact after Hertz, of two cylinders.
    """

    base_radius: Param[Scalar, "m", positive]  # of the cam where the lift is 0
    width: Param[Scalar, "m", positive] = 10e-3  # of the line of contact
    modulus: Param[Scalar, "Pa", positive] = STEEL  # E', 1/E' = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2

    @abc.abstractmethod
    def pressure_angle(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Angle between normal and direction of travel in rad, positive where it pushes sideways on the rise."""

    @abc.abstractmethod
    def radius(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Radius of curvature of the cam's surface in m.

        Under a flat face it is negative where the cam is undercut, under a roller where it is undercut or hollow.
        """

    @abc.abstractmethod
    def relative_curvature(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Sum of the curvatures of cam and follower in 1/m, negative where the cam is undercut."""

    @abc.abstractmethod
    def sharpness(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Measure of how close the cam is to an undercut: its greatest value is at the least radius."""

    def hertz_pressure(self, profile: CamProfile, angle: Scalar, force: Scalar) -> Scalar:
        """Largest pressure in Pa under an axial force in N: sqrt(F E' k/(pi b)/cos(pressure angle)).

        k is the relative curvature, b the width of the contact. NaN where the follower does not bear on the cam: under
        a negative force, which lifts it off, and where the cam is undercut.
        """
        normal = force / jnp.cos(self.pressure_angle(profile, angle))
        load = normal * self.modulus * self.relative_curvature(profile, angle) / (jnp.pi * self.width)
        is_loaded = load > 0.0
        return jnp.where(is_loaded, jnp.sqrt(jnp.where(is_loaded, load, 1.0)), jnp.where(load == 0.0, 0.0, jnp.nan))

    def contact(self, profile: CamProfile, angles: Vector, forces: Vector) -> CamContact:
        """What holds at angles in rad under axial forces in N, as of a solution: `cam.shaft.phi`, `-cam.follower.f`."""

        def at(angle: Scalar, force: Scalar) -> CamContact:
            alpha = self.pressure_angle(profile, angle)
            radius, pressure = self.radius(profile, angle), self.hertz_pressure(profile, angle, force)
            return CamContact(*map(jnp.asarray, (alpha, radius, force / jnp.cos(alpha), pressure)))

        return jax.vmap(at)(jnp.asarray(angles, float), jnp.asarray(forces, float))

    def least_radius(self, profile: CamProfile, first: Scalar = 0.0, last: Scalar = 2.0 * jnp.pi) -> Scalar:
        """Least radius of curvature of the surface between two angles in m: not above 0, the cam is undercut.

        Under a roller only convex parts of the cam count. Infinite if the cam is hollow throughout.
        """

        def sharp(angle: Scalar) -> Scalar:
            return self.sharpness(profile, angle)

        angles = jnp.linspace(first, last, _SAMPLES)
        angle = jax.lax.stop_gradient(angles[jnp.argmax(jax.vmap(sharp)(angles))])
        for _ in range(_NEWTON):
            slope, curve = jax.jvp(jax.grad(sharp), (angle,), (jnp.ones_like(angle),))
            bends = curve < 0.0
            angle = jnp.clip(angle - jnp.where(bends, slope / jnp.where(bends, curve, 1.0), 0.0), first, last)
        return self.least(profile, angle)

    @abc.abstractmethod
    def least(self, profile: CamProfile, sharpest: Scalar) -> Scalar:
        """The least radius in m, from the angle at which the cam is sharpest."""


def _derivatives(profile: CamProfile, angle: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """s, s' and s''."""
    angle = jnp.asarray(angle, dtype=float)
    slope, second = jax.jvp(profile.slope, (angle,), (jnp.ones_like(angle),))
    return profile.lift(angle), slope, second


class FlatFollower(Follower):
    """A flat face across the axis: no pressure angle, radius = R_b + s + s''; the face must reach s' to either side.

    R_b is the base radius. The cam is undercut where the radius is not above 0: a flat face bears on convex cams only.
    """

    def pressure_angle(self, profile: CamProfile, angle: Scalar) -> Scalar:
        return 0.0 * profile.lift(angle) / self.base_radius

    def radius(self, profile: CamProfile, angle: Scalar) -> Scalar:
        s, _, second = _derivatives(profile, angle)
        return self.base_radius + s + second

    def relative_curvature(self, profile: CamProfile, angle: Scalar) -> Scalar:
        return 1.0 / self.radius(profile, angle)

    def sharpness(self, profile: CamProfile, angle: Scalar) -> Scalar:
        return -self.radius(profile, angle)

    def least(self, profile: CamProfile, sharpest: Scalar) -> Scalar:
        return self.radius(profile, sharpest)


class RollerFollower(Follower):
    """A roller whose axis passes the cam's at the distance `offset`: tan(alpha) = (s' - o)/(s + D).

    D = sqrt((R_b + r)^2 - o^2), with the base radius R_b; alpha is the pressure angle. The centre of the roller runs on
    the pitch curve, with Y = s + D of radius (Y^2 + (s' - o)^2)^1.5/(Y^2 + (s' - o)(2 s' - o) - Y s''); the cam's is
    less by r. Without a roller, r near 0, it is a knife edge.
    """

    roller: Param[Scalar, "m", positive] = 5e-3  # r
    offset: Param[Scalar, "m"] = 0.0  # o, to the side that lessens the pressure angle on the rise

    def requirements(self) -> Requirements:
        return (require(jnp.abs(self.offset) < self.base_radius + self.roller, "offset must be below R_b + r"),)

    def _height(self, s: Scalar) -> Scalar:
        return s + jnp.sqrt((self.base_radius + self.roller) ** 2 - self.offset**2)

    def pressure_angle(self, profile: CamProfile, angle: Scalar) -> Scalar:
        s, slope, _ = _derivatives(profile, angle)
        return jnp.arctan((slope - self.offset) / self._height(s))

    def radius(self, profile: CamProfile, angle: Scalar) -> Scalar:
        return 1.0 / self.sharpness(profile, angle) - self.roller

    def relative_curvature(self, profile: CamProfile, angle: Scalar) -> Scalar:
        return 1.0 / self.radius(profile, angle) + 1.0 / self.roller

    def sharpness(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Curvature of the pitch curve in 1/m: above 1/r the cam is undercut, below 0 it is hollow."""
        s, slope, second = _derivatives(profile, angle)
        y, x = self._height(s), slope - self.offset
        return (y**2 + x * (slope + x) - y * second) / (y**2 + x**2) ** 1.5

    def least(self, profile: CamProfile, sharpest: Scalar) -> Scalar:
        curvature = self.sharpness(profile, sharpest)
        is_convex = curvature > 0.0
        return jnp.where(is_convex, 1.0 / jnp.where(is_convex, curvature, 1.0) - self.roller, jnp.inf)
