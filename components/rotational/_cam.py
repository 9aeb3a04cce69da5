"""Cams with a translating follower, and their contact, derived from the lift: pressure angle, curvature, undercut."""

import abc
from typing import NamedTuple, Self

import jax
import jax.numpy as jnp
from jax import Array

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Record,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from ..translational import Flange as Rod
from ._cam_profiles import CamProfile
from ._interfaces import Flange


class Cam(Component):
    """A cam that lifts an axially guided follower by s = l(phi).

    The contact is permanent and frictionless. By virtual work, the follower force F on the cam loads the shaft with
    F l'(phi): J dw/dt = tau + f l'(phi), where f = -F is the force into the follower's flange (Norton, `Cam Design
    and Manufacturing Handbook`). Not modelled: lift-off, friction, elasticity, mass of the follower.
    """

    profile: CamProfile
    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia about the shaft
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    slope: Var[Scalar, "m/rad"] = 0.0  # l'(phi)
    torque: Var[Scalar, "N.m"] = 0.0  # F l'(phi), load of the follower on the shaft
    shaft: Flange = Flange()
    follower: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            lift=eq(self.follower.s, self.profile.lift(self.shaft.phi)),
            speed=eq(self.w, d.shaft.phi),
            slope=eq(self.slope, self.profile.slope(self.shaft.phi)),
            virtual_work=eq(self.torque, -self.follower.f * self.slope),
            newton=eq(self.J * d.w, self.shaft.tau - self.torque),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2)


STEEL = 113.2e9  # Pa, E/(2 (1 - nu^2)) for a pair of steel, E = 206 GPa, nu = 0.3
_SAMPLES = 2048  # samples for the coarse search of the minimum radius
_NEWTON = 5  # iterations that refine it


class CamContact(NamedTuple):
    """Result of `Follower.contact` at given angles."""

    pressure_angle: Array  # angle between the contact normal and the follower's axis, in rad
    radius: Array  # radius of curvature of the cam, in m; see `Follower.radius` for its sign
    normal_force: Array  # in N
    hertz_pressure: Array  # maximum contact pressure, in Pa; NaN without contact


class Follower(Record, partial=True):
    """A translating follower. Its lift s over the cam angle, with the derivatives s' and s'', determines the cam shape.

    Norton, `Cam Design and Manufacturing Handbook`, ch. 7; Hertzian contact of two cylinders.
    """

    base_radius: Param[Scalar, "m", positive]  # radius of the cam at zero lift
    width: Param[Scalar, "m", positive] = 10e-3  # width of the line contact
    modulus: Param[Scalar, "Pa", positive] = STEEL  # E', 1/E' = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2

    @abc.abstractmethod
    def pressure_angle(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Angle between contact normal and direction of travel in rad, positive on the rise of a centred follower."""

    @abc.abstractmethod
    def radius(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Radius of curvature of the cam's surface in m.

        Under a flat face it is negative if the cam is undercut; under a roller, if the cam is undercut or concave.
        """

    @abc.abstractmethod
    def relative_curvature(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Sum of the curvatures of cam and follower in 1/m, negative if the cam is undercut."""

    @abc.abstractmethod
    def sharpness(self, profile: CamProfile, angle: Scalar) -> Scalar:
        """Measure of the proximity to undercut; its maximum is at the minimum radius."""

    def hertz_pressure(self, profile: CamProfile, angle: Scalar, force: Scalar) -> Scalar:
        """Maximum contact pressure in Pa under an axial force F in N: sqrt(F E' k/(pi b)/cos(pressure angle)).

        k is the relative curvature, b the width of the contact. NaN if the follower does not bear on the cam, because
        a negative force lifts it off or because the cam is undercut.
        """
        normal = force / jnp.cos(self.pressure_angle(profile, angle))
        load = normal * self.modulus * self.relative_curvature(profile, angle) / (jnp.pi * self.width)
        is_loaded = load > 0.0
        return jnp.where(is_loaded, jnp.sqrt(jnp.where(is_loaded, load, 1.0)), jnp.where(load == 0.0, 0.0, jnp.nan))

    def contact(self, profile: CamProfile, angles: Vector, forces: Vector) -> CamContact:
        """Contact at angles in rad under axial forces in N; from a solution: `cam.shaft.phi`, `-cam.follower.f`."""

        def at(angle: Scalar, force: Scalar) -> CamContact:
            alpha = self.pressure_angle(profile, angle)
            radius, pressure = self.radius(profile, angle), self.hertz_pressure(profile, angle, force)
            return CamContact(*map(jnp.asarray, (alpha, radius, force / jnp.cos(alpha), pressure)))

        return jax.vmap(at)(jnp.asarray(angles, float), jnp.asarray(forces, float))

    def least_radius(self, profile: CamProfile, first: Scalar = 0.0, last: Scalar = 2.0 * jnp.pi) -> Scalar:
        """Minimum radius of curvature in m of the cam surface between two angles. At 0 or below, the cam is undercut.

        Under a roller only convex parts of the cam count. Infinite if the cam is concave throughout.
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
        """Minimum radius in m, given the angle at which the cam is sharpest."""


def _derivatives(profile: CamProfile, angle: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """s, s' and s''."""
    angle = jnp.asarray(angle, dtype=float)
    slope, second = jax.jvp(profile.slope, (angle,), (jnp.ones_like(angle),))
    return profile.lift(angle), slope, second


class FlatFollower(Follower):
    """A flat face across the axis: zero pressure angle, radius = R_b + s + s''. The face must reach s' to either side.

    R_b is the base radius. The cam is undercut if the radius is not positive: a flat face bears on convex cams only.
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
    """A roller that travels along a line offset from the cam axis: tan(alpha) = (s' - o)/(s + D).

    alpha is the pressure angle and D = sqrt((R_b + r)^2 - o^2), with the base radius R_b. The roller centre follows the
    pitch curve, whose radius is (Y^2 + (s' - o)^2)^1.5/(Y^2 + (s' - o)(2 s' - o) - Y s'') with Y = s + D; the radius of
    the cam is smaller by r. A knife edge is a roller with r near 0.
    """

    roller: Param[Scalar, "m", positive] = 5e-3  # r, radius of the roller
    offset: Param[Scalar, "m"] = 0.0  # o, towards the side that reduces the pressure angle on the rise

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
        """Curvature of the pitch curve in 1/m: above 1/r the cam is undercut, below 0 it is concave."""
        s, slope, second = _derivatives(profile, angle)
        y, x = self._height(s), slope - self.offset
        return (y**2 + x * (slope + x) - y * second) / (y**2 + x**2) ** 1.5

    def least(self, profile: CamProfile, sharpest: Scalar) -> Scalar:
        curvature = self.sharpness(profile, sharpest)
        is_convex = curvature > 0.0
        return jnp.where(is_convex, 1.0 / jnp.where(is_convex, curvature, 1.0) - self.roller, jnp.inf)
