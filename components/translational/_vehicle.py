"""A vehicle in its direction of travel, a driver who follows a speed, and a drive cycle to follow."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer, unbounded

from .._limit import absolute, positive_part
from ..blocks import Input, LimitedController, Output, TimeSeries
from ._interfaces import Flange


class Vehicle(Component):
    """A vehicle with its driving resistances, m dv/dt = f - F_roll - F_air - m g sin(slope) (MSL `Vehicle`).

    F_roll = c_r m g cos(slope) tanh(v/v_0), with the coefficient of rolling resistance that ISO 28580 measures for a
    tyre (passenger cars 0.006 to 0.012), and F_air = 1/2 rho c_d area v |v| in still air. (Mitschke, Wallentowitz,
    `Dynamik der Kraftfahrzeuge`, Fahrwiderstaende.) The flange moves with the body: connect an `IdealRollingWheel` or
    a `Tyre` of `rotational`, whose shafts carry the inertia of the wheels.

    Without the port `grade` the road is level. Give `grade=Input()` to connect tan(slope), the rise over the horizontal
    distance, positive uphill. Below the speed v_0 the rolling resistance fades out: it brakes a vehicle to rest, but
    does not hold it on a slope.
    """

    m: Param[Scalar, "kg", positive]  # mass with its load
    area: Param[Scalar, "m2", nonnegative]  # frontal area
    c_d: Param[Scalar, "1", nonnegative]  # drag coefficient
    c_r: Param[Scalar, "1", nonnegative]  # coefficient of rolling resistance
    rho: Param[Scalar, "kg/m3", nonnegative] = 1.2  # density of the air
    g: Param[Scalar, "m/s2", nonnegative] = 9.80665  # acceleration of gravity
    v_0: Param[Scalar, "m/s", positive] = 0.1  # width of the transition through rest
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    altitude: Var[Scalar, "m"] = 0.0  # height climbed, from its start value
    rolling: Var[Scalar, "N"] = 0.0  # rolling resistance
    drag: Var[Scalar, "N"] = 0.0  # air drag
    flange: Flange = Flange()
    grade: Input | None = None

    def _directions(self) -> tuple[Scalar, Scalar]:
        """Cosine and sine of the slope."""
        tangent = 0.0 if self.grade is None else self.grade.value
        cosine = 1.0 / jnp.sqrt(1.0 + tangent**2)
        return cosine, tangent * cosine

    def equations(self, d: Self) -> Equations:
        (cosine, sine), weight = self._directions(), self.m * self.g
        return dict(
            speed=eq(self.v, d.flange.s),
            climb=eq(d.altitude, self.v * sine),
            rolling=eq(self.rolling, self.c_r * weight * cosine * jnp.tanh(self.v / self.v_0)),
            drag=eq(self.drag, 0.5 * self.rho * self.c_d * self.area * self.v * absolute(self.v)),
            newton=eq(self.m * d.v, self.flange.f - self.rolling - self.drag - weight * sine),
        )

    def energy(self) -> Energy:
        return Energy(
            stored=0.5 * self.m * self.v**2 + self.m * self.g * self.altitude,
            dissipated=(self.rolling + self.drag) * self.v,
        )


# Speed in km/h over time in s: UNECE Regulations 83 and 101, part two of the operating cycle, with constant speed while
# the gear is changed.
EUDC = {
    0: 0, 20: 0, 25: 15, 27: 15, 36: 35, 38: 35, 46: 50, 48: 50, 61: 70, 111: 70, 119: 50, 188: 50, 201: 70, 251: 70,
    286: 100, 316: 100, 336: 120, 346: 120, 362: 80, 370: 50, 380: 0, 400: 0,
}  # fmt: skip


class Driver(LimitedController):
    """A driver who follows a speed: PI control, divided into traction and brake.

    y = k (wp u_s - u_m + x), limited to -1 .. 1, with the setpoint u_s and the speed u_m in m/s and the anti-windup of
    `LimitedController`; traction = y and brake = 0 if y > 0, otherwise traction = 0 and brake = -y (longitudinal driver
    of MathWorks Powertrain Blockset; Guzzella, Sciarretta, `Vehicle Propulsion Systems`, forward models). Connect the
    outputs through a `Gain` with the greatest torque or force of motor and brake. The road load over the greatest force
    is a suitable feed-forward. Not modelled: reaction time, preview.
    """

    y_max: Param[Scalar, "", unbounded] = 1.0  # upper limit of y: full traction
    y_min: Param[Scalar, "", unbounded] = -1.0  # lower limit of y: full brake
    traction: Output = Output()  # command from 0 to 1
    brake: Output = Output()  # command from 0 to 1

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            law=eq(self.y_unlimited, self._wanted()),
            traction=eq(self.traction.value, positive_part(self.y.value)),
            brake=eq(self.brake.value, positive_part(-self.y.value)),
        )


def eudc() -> TimeSeries:
    """The extra-urban drive cycle of UNECE Regulations 83 and 101: speed in m/s over 400 s and 6.955 km.

    For another cycle, give its table to a `blocks.TimeSeries` with `smooth=False`.
    """
    return TimeSeries(times=[float(t) for t in EUDC], values=[v / 3.6 for v in EUDC.values()], smooth=False)
