"""A line without losses by the method of characteristics."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    ROW,
    Component,
    Discrete,
    Energy,
    Equations,
    Events,
    Nominal,
    Param,
    Requirements,
    Scalar,
    Time,
    Var,
    Vector,
    eq,
    nonnegative,
    positive,
    prefer,
    recall,
    remember,
    require,
    shape,
)

from ._interfaces import FluidPort
from ._liquids import AnyLiquid


class CharacteristicLine(Component):
    """A line without losses between two ports, exact for waves of any shape, by the method of characteristics.

    A wave w = p + Z q enters at each port and reaches the other one after T:

    - p_a - Z q_a = w_b(t - T) and p_b - Z q_b = w_a(t - T);
    - impedance Z = rho c/A, travel time T = length/c, speed of sound c with 1/c^2 = rho (dr/dp + r wall).

    rho is the density at atmospheric pressure, to which q refers, and r and dr/dp are the relative density of the
    liquid and its slope at the working pressure `pressure`. A liquid with a little air is far softer at atmospheric
    pressure: ISO VG 46 with 0.5 % of air has c = 180 m/s there and 1,438 m/s at 200 bar.

    Before the start of a run, the waves were constant, so p is uniform and the flow passes through; with
    `steady=False`, they were the start values of `before_a` and `before_b`. Linear: the liquid sustains tension. Add
    restrictions at the ends for friction, or use a `Pipe` for friction along the line, cavitation, heat or pressures
    that range widely. No step is longer than T, so a short line makes a long run slow: a `Line` is enough there.
    The restrictions of `FixedDelay` hold: such a model cannot be linearised, exported or run backwards (Wylie,
    Streeter, `Fluid Transients in Systems`, 1993, ch. 3; Krus, Jansson, Palmberg, Weddfelt 1990 for Hopsan).
    """

    length: Param[Scalar, "m", positive]
    diameter: Param[Scalar, "m", positive]  # inside diameter
    liquid: AnyLiquid
    pressure: Param[Scalar, "Pa"]  # working pressure, for the speed of sound
    wall: Param[Scalar, "1/Pa", nonnegative] = 0.0  # relative increase of the volume with pressure
    n: int = 64  # number of steps that the histories hold
    steady: bool = True  # the waves were constant before the start
    t: Time[Scalar, "s"] = 0.0
    since: Var[Scalar, "s"] = 0.0  # time at which the waves that arrive have entered
    w_a: Var[Scalar, "Pa"] = 0.0  # wave that enters at a
    w_b: Var[Scalar, "Pa"] = 0.0  # wave that enters at b
    before_a: Var[Scalar, "Pa", prefer] = 0.0  # w_a before the start
    before_b: Var[Scalar, "Pa", prefer] = 0.0  # w_b before the start
    stored: Var[Scalar, "J", prefer, Nominal(1.0)] = 0.0  # energy of the waves on their way, above that at the start
    past_a: Discrete[Vector, "", shape("n", ROW)] = -jnp.inf
    past_b: Discrete[Vector, "", shape("n", ROW)] = -jnp.inf
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def requirements(self) -> Requirements:
        return (require(self.n >= 2, "n must be 2 or more"),)

    @property
    def sound_speed(self) -> Scalar:
        """c in m/s at the working pressure."""
        of_walls = self.wall * self.liquid.relative_density(self.pressure)
        compliance = self.liquid.compressibility(self.pressure) + of_walls
        return 1.0 / jnp.sqrt(self.liquid.reference_density * compliance)

    @property
    def travel_time(self) -> Scalar:
        """T = length/c in s."""
        return self.length / self.sound_speed

    @property
    def impedance(self) -> Scalar:
        """Z = rho c/A in Pa.s/m3."""
        return self.liquid.reference_density * self.sound_speed / (0.25 * jnp.pi * self.diameter**2)

    def initial_equations(self, d: Any) -> Equations:
        if not self.steady:
            return {}
        return dict(steady_a=eq(self.before_a, self.w_a), steady_b=eq(self.before_b, self.w_b))

    def equations(self, d: Self) -> Equations:
        return dict(
            travel=eq(self.since, self.t - self.travel_time),
            entering_a=eq(self.w_a, self.a.p + self.impedance * self.a.q),
            entering_b=eq(self.w_b, self.b.p + self.impedance * self.b.q),
            leaving_a=eq(self.a.p - self.impedance * self.a.q, recall(self.past_b, self.since, self.before_b)),
            leaving_b=eq(self.b.p - self.impedance * self.b.q, recall(self.past_a, self.since, self.before_a)),
            constant_a=eq(d.before_a, 0.0),
            constant_b=eq(d.before_b, 0.0),
            waves=eq(d.stored, self.a.p * self.a.q + self.b.p * self.b.q),
        )

    def events(self) -> Events:
        return dict(
            from_a=remember(self.travel_time, past_a=self.w_a), from_b=remember(self.travel_time, past_b=self.w_b)
        )

    def energy(self) -> Energy:
        return Energy(stored=self.stored)
