"""Mass, stiffness, damping and the fixed point."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Events,
    Param,
    Record,
    Scalar,
    Var,
    eq,
    kink,
    nonnegative,
    positive,
    prefer,
)

from ._interfaces import Compliant, Flange


class Position(Record):
    """Where a flange is held."""

    s0: Param[Scalar, "m"]  # position


class Fixed(Component):
    """A flange held at the position s0, zero unless it is given (MSL `Fixed`).

    What is given is the parameter `place.s0`. What is not is no parameter, so that the flange drops out.
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


class Mass(Component):
    """A rigid body of no length, m dv/dt = f_a + f_b (MSL `Mass` with L = 0; a `SlidingMass` has a length).

    Its position is that of its flanges, and so is the one it starts from: `Mass(m=1.0, a=Flange(s=0.3))`.
    """

    m: Param[Scalar, "kg", positive]  # mass
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            rigid=eq(self.a.s, self.b.s),
            speed=eq(self.v, d.a.s),
            newton=eq(self.m * d.v, self.a.f + self.b.f),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.m * self.v**2)


class Rod(Component):
    """A rigid rod without mass, s_b = s_a + L (MSL `Rod`)."""

    L: Param[Scalar, "m"]  # length from a to b
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(rigid=eq(self.b.s, self.a.s + self.L), balance=eq(self.a.f + self.b.f))


class SlidingMass(Component):
    """A rigid body with a length, m dv/dt = f_a + f_b, s_a = s - L/2 and s_b = s + L/2 (MSL `Mass`).

    Where positions only matter as displacements, `Mass` has fewer equations.
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
    """A spring of two rates, f = c_1 x below the knee and c_1 knee + c_2 (x - knee) above; x = s_rel0 - s_rel pushes.

    The tension is -f. Two coil springs one inside the other, the second one shorter by `knee`, or one whose coils
    touch. It also pulls, with c_1. A spring of any curve against the housing is a `TabulatedSpring`, one with preload,
    such as a return spring, a `ClutchSpring`.
    """

    c_1: Param[Scalar, "N/m", nonnegative]  # stiffness up to the knee
    c_2: Param[Scalar, "N/m", nonnegative]  # and beyond it
    knee: Param[Scalar, "m", nonnegative]  # compression at which the stiffness changes
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position of the unloaded spring

    def _beyond(self) -> Scalar:
        x = self.s_rel0 - self.s_rel - self.knee
        return jnp.where(x > 0.0, x, 0.0)

    def equations(self, d: Self) -> Equations:
        x = self.s_rel0 - self.s_rel
        return super().equations(d) | dict(law=eq(self.f, -self.c_1 * x - (self.c_2 - self.c_1) * self._beyond()))

    def events(self) -> Events:
        return dict(_knee=kink(self.s_rel0 - self.s_rel - self.knee))

    def energy(self) -> Energy:
        x = self.s_rel0 - self.s_rel
        return Energy(stored=0.5 * self.c_1 * x**2 + 0.5 * (self.c_2 - self.c_1) * self._beyond() ** 2)
