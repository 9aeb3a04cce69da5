"""Mass, spring, damper, rod and fixed flange."""

from collections.abc import Mapping
from typing import Any, Self

import jax.numpy as jnp

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
    magnitude,
    nonnegative,
    positive,
    prefer,
)

from .._checks import damping, numbers
from .._limit import positive_part
from .._starts import placed
from .._tables import monotone_cubic
from ._interfaces import Compliant, Flange


class Position(Record):
    """Position of a fixed flange."""

    s0: Param[Scalar, "m"]  # position


class Fixed(Component):
    """A flange fixed at the position s0, zero by default (MSL `Fixed`).

    If s0 is given, it is the parameter `place.s0`. Otherwise there is no parameter, and the flange is eliminated.
    """

    place: Position | None = None
    flange: Flange = Flange()

    def __init__(
        self,
        *,
        s0: Param[Scalar, "m"] | None = None,  # position of the flange
        flange: Flange | None = None,
    ) -> None:
        self.place = None if s0 is None else Position(s0=s0)
        self.flange = Flange() if flange is None else flange

    def equations(self, d: Self) -> Equations:
        return dict(held=eq(self.flange.s, 0.0 if self.place is None else self.place.s0))


class Length(Record):
    """Length of a body."""

    L: Param[Scalar, "m"]  # length from a to b


class Slope(Record):
    """Direction of the travel of a body, and gravity."""

    incline: Param[Scalar, "rad"]  # angle of s above the horizontal
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity


class Mass(Component):
    """A rigid body, m dv/dt = f_a + f_b, with its flanges at s - L/2 and s + L/2 (MSL `Mass`).

    With `incline`, s points upwards at this angle, and the weight acts: m dv/dt = f_a + f_b - m g sin(incline). A mass
    that hangs, or that is lifted, has an incline of pi/2. The parameters are `slope.incline` and `slope.g`.

    `Mass(m=..., L=..., s=..., v=...)` starts at the given position of its centre and speed. If L is given, it is the
    parameter `body.L`. Otherwise there is no parameter, and both flanges have the same position. s is not a separate
    variable: `mass.s` reads `mass.a.s` + L/2. The name in results and start values is `a.s`; see also `SlidingMass`.
    """

    m: Param[Scalar, "kg", positive]  # mass
    body: Length | None = None
    slope: Slope | None = None
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    a: Flange = Flange()
    b: Flange = Flange()

    def __init__(
        self,
        *,
        m: Param[Scalar, "kg"],
        L: Param[Scalar, "m"] | None = None,  # length from a to b
        incline: Param[Scalar, "rad"] | None = None,  # angle of s above the horizontal; None without weight
        s: Param[Scalar, "m"] | None = None,  # position of the centre at the start
        v: Any = None,
        a: Flange | None = None,
        b: Flange | None = None,
        nominal: Mapping[str, Any] | None = None,
    ) -> None:
        self.m, self.v = m, v
        self.nominal = {} if nominal is None else nominal
        self.body = None if L is None else Length(L=L)
        self.slope = None if incline is None else Slope(incline=incline)
        if s is not None and self.body is not None:
            s = numbers(self, "s", magnitude(s, "m", "Mass.s")) - self._half()
        self.a, self.b = placed(self, Flange, "s", s, a), Flange() if b is None else b

    def _half(self) -> Scalar:
        return 0.0 if self.body is None else 0.5 * self.body.L

    @property
    def s(self) -> Scalar:
        """Position of the centre in m."""
        return self.a.s + self._half()

    def equations(self, d: Self) -> Equations:
        rigid = eq(self.a.s, self.b.s) if self.body is None else eq(self.b.s, self.a.s + self.body.L)
        return dict(
            rigid=rigid,
            speed=eq(self.v, d.a.s),
            newton=eq(self.m * d.v, self.a.f + self.b.f - self.weight()),
        )

    def weight(self) -> Scalar:
        """Weight against the direction of s in N."""
        return 0.0 if self.slope is None else self.m * self.slope.g * jnp.sin(self.slope.incline)

    def energy(self) -> Energy:
        kinetic = 0.5 * self.m * self.v**2
        return Energy(stored=kinetic if self.slope is None else kinetic + self.weight() * self.s)


class Rod(Component):
    """A rigid massless rod, s_b = s_a + L (MSL `Rod`)."""

    L: Param[Scalar, "m"]  # length from a to b
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(rigid=eq(self.b.s, self.a.s + self.L), balance=eq(self.a.f + self.b.f))


class SlidingMass(Component):
    """A `Mass` with its position s as a separate variable, under this name in results and start values.

    s_a = s - L/2, s_b = s + L/2, ds/dt = v, m dv/dt = f_a + f_b. The name is that of `Mass` in MSL 2. If only the
    positions of the flanges matter, `Mass` has fewer equations.
    """

    m: Param[Scalar, "kg", positive]  # mass
    L: Param[Scalar, "m"] = 0.0  # length from a to b
    s: Var[Scalar, "m", prefer] = 0.0  # position of the centre
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            front=eq(self.b.s, self.s + 0.5 * self.L),
            back=eq(self.a.s, self.s - 0.5 * self.L),
            speed=eq(self.v, d.s),
            newton=eq(self.m * d.v, self.a.f + self.b.f),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.m * self.v**2)


class Spring(Compliant):
    """Linear spring, f = c (s_rel - s_rel0)."""

    c: Param[Scalar, "N/m", nonnegative]  # stiffness
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position of the unloaded spring

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(hooke=eq(self.f, self.c * (self.s_rel - self.s_rel0)))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * (self.s_rel - self.s_rel0) ** 2)


class Damper(Compliant):
    """Linear damper, f = d v_rel."""

    d: Param[Scalar, "N.s/m", nonnegative]  # damping coefficient
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            damping=eq(self.f, self.d * self.v_rel),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.d * self.v_rel**2)


class SpringDamper(Compliant):
    """Spring and damper in parallel, f = c (s_rel - s_rel0) + d v_rel."""

    c: Param[Scalar, "N/m", nonnegative]  # stiffness
    d: Param[Scalar, "N.s/m", nonnegative]  # damping coefficient
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position of the unloaded spring
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            law=eq(self.f, self.c * (self.s_rel - self.s_rel0) + self.d * self.v_rel),
        )

    def energy(self) -> Energy:
        return Energy(
            stored=0.5 * self.c * (self.s_rel - self.s_rel0) ** 2,
            dissipated=self.d * self.v_rel**2,
        )


class DualRateSpring(Compliant):
    """A dual-rate spring: compression x = s_rel0 - s_rel, force c_1 x to the knee, then c_1 knee + c_2 (x - knee).

    This is the pushing force, -f. Two nested coil springs, the second shorter by `knee`, or one whose coils close. It
    also pulls, with the stiffness c_1. For a spring with any characteristic against the housing see `TabulatedSpring`;
    for one with preload, such as a return spring, see `ClutchSpring`.
    """

    c_1: Param[Scalar, "N/m", nonnegative]  # stiffness up to the knee
    c_2: Param[Scalar, "N/m", nonnegative]  # stiffness beyond the knee
    knee: Param[Scalar, "m", nonnegative]  # compression at which the stiffness changes
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position of the unloaded spring

    def _beyond(self) -> Scalar:
        x = self.s_rel0 - self.s_rel - self.knee
        return positive_part(x)

    def equations(self, d: Self) -> Equations:
        x = self.s_rel0 - self.s_rel
        return super().equations(d) | dict(law=eq(self.f, -self.c_1 * x - (self.c_2 - self.c_1) * self._beyond()))

    def energy(self) -> Energy:
        x = self.s_rel0 - self.s_rel
        return Energy(stored=0.5 * self.c_1 * x**2 + 0.5 * (self.c_2 - self.c_1) * self._beyond() ** 2)


class TabulatedDamper(Compliant):
    """A damper with a sampled characteristic f(v_rel), such as that of a shock absorber.

    A shock absorber has more force in rebound (extension) than in bump.

    Monotone cubic interpolation with continuous slope, without extrema between the samples (Fritsch, Butland 1984);
    linear extrapolation beyond them. The origin is a sample, because a damper at rest carries no force.
    """

    speeds: Param[Vector, "m/s"]  # relative speeds, increasing, with 0 among them
    forces: Param[Vector, "N"]  # forces at these speeds, with the sign of the speed
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def requirements(self) -> Requirements:
        return damping(self, "forces", "speeds")

    def force(self) -> Scalar:
        """Force at the current relative speed in N."""
        return monotone_cubic(self.v_rel, self.speeds, self.forces)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            characteristic=eq(self.f, self.force()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.force() * self.v_rel)
