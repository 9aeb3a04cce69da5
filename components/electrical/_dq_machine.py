"""Parameters of a permanent-magnet synchronous machine, and its optimal currents within the limits of an inverter."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from acausal import Param, Record, Scalar, ifelse, nonnegative, positive

_ANGLES = 48  # voltage angles in the coarse search of the maximum torque
_HALVINGS = 40  # bisection steps
_ROUNDING = 1e-9  # tolerance of the squared current, relative to its limit
_NEWTON = 6  # steps; one suffices for the value, and one more for each order of derivatives


class DqCurrents(NamedTuple):
    """Peak values of the currents in A, in rotor coordinates."""

    d: Scalar
    q: Scalar


class _Ellipse(NamedTuple):
    """Currents at a constant voltage amplitude over its angle: i = centre + cos(angle) cosine + sin(angle) sine."""

    centre: DqCurrents
    cosine: DqCurrents
    sine: DqCurrents

    def at(self, angle: Scalar | Array) -> tuple[DqCurrents, DqCurrents]:
        """Currents and their derivatives with respect to the angle."""
        c, s = jnp.cos(angle), jnp.sin(angle)
        i = DqCurrents(*(m + c * a + s * b for m, a, b in zip(*self, strict=True)))
        return i, DqCurrents(*(c * b - s * a for _, a, b in zip(*self, strict=True)))


class _Look(NamedTuple):
    """Excess of torque and squared current over their bounds at a voltage angle, each relative to its maximum: torque
    with two derivatives, squared current with one.
    """

    torque: Scalar
    rise: Scalar
    bend: Scalar
    current: Scalar
    growth: Scalar


class DqMachine(Record):
    """A sinusoidal synchronous machine without saturation, in rotor coordinates; d is the magnet axis.

    In steady state, with the electrical speed w: v_d = Rs i_d - w Lq i_q, v_q = Rs i_q + w (Ld i_d + psi), and the
    torque is 3/2 p (psi i_q + (Ld - Lq) i_d i_q). Voltages and currents are phase peak values (amplitude-invariant
    transformation), so the power is 3/2 (v_d i_d + v_q i_q) (Schroeder, `Elektrische Antriebe - Regelung`).
    """

    p: Param[Scalar, "1", positive]  # number of pole pairs
    psi: Param[Scalar, "Wb", positive]  # flux linkage of the magnets: no-load voltage per electrical speed
    Ld: Param[Scalar, "H", positive]  # d-axis inductance
    Lq: Param[Scalar, "H", positive]  # q-axis inductance, larger than Ld for buried magnets
    Rs: Param[Scalar, "ohm", nonnegative] = 0.0  # phase resistance

    def torque(self, i: DqCurrents) -> Scalar:
        """Torque in N.m."""
        return 1.5 * self.p * (self.psi + (self.Ld - self.Lq) * i.d) * i.q

    def voltages(self, i: DqCurrents, w: Scalar) -> tuple[Scalar, Scalar]:
        """Steady-state v_d and v_q in V at the electrical speed w in rad/s."""
        return self.Rs * i.d - w * self.Lq * i.q, self.Rs * i.q + w * (self.Ld * i.d + self.psi)

    def voltage(self, i: DqCurrents, w: Scalar) -> Scalar:
        """Voltage amplitude in V."""
        return jnp.hypot(*self.voltages(i, w))

    def most_per_ampere(self, size: Scalar) -> DqCurrents:
        """Currents of maximum torque for a given current amplitude in A (maximum torque per ampere, MTPA)."""
        s = self.Ld - self.Lq
        i_d = 2.0 * s * size**2 / (self.psi + jnp.sqrt(self.psi**2 + 8.0 * (s * size) ** 2))
        return DqCurrents(i_d, jnp.sqrt(size**2 - i_d**2))

    def least_for(self, torque: Scalar) -> DqCurrents:
        """Smallest currents for a torque >= 0 in N.m without a voltage limit: those of MTPA."""
        s, k = self.Ld - self.Lq, 0.75 * self.p

        def root(i_q: Scalar) -> Scalar:
            return jnp.sqrt(self.psi**2 + (2.0 * s * i_q) ** 2)

        def excess(i_q: Scalar) -> tuple[Scalar, Scalar]:
            r = root(i_q)
            return k * i_q * (self.psi + r) - torque, k * (self.psi + r + (2.0 * s * i_q) ** 2 / r)

        # The torque over i_q is convex, so that Newton's method converges from above. It starts from the current for
        # the magnet torque alone or the reluctance torque alone, whichever is less.
        by_magnets, salient = torque / (2.0 * k * self.psi), s != 0.0
        square = torque / (2.0 * k * jnp.abs(jnp.where(salient, s, 1.0)))
        start = jnp.where(salient & (square < by_magnets**2), jnp.sqrt(square), by_magnets)
        i_q = _root(excess, jax.lax.stop_gradient(start))
        return DqCurrents(2.0 * s * i_q**2 / (self.psi + root(i_q)), i_q)

    def currents(self, torque: Scalar, w: Scalar, v_max: Scalar, i_max: Scalar) -> DqCurrents:
        """Smallest currents for a torque in N.m, or for the largest torque possible, within the inverter limits.

        Up to the corner speed they are those of MTPA. Above it the field is weakened at the voltage limit, and the
        torque is limited by the current or by the voltage (MTPV; Morimoto et al., `Expansion of operating limits for
        permanent magnet motor`, IEEE Trans. Ind. Appl. 26, 1990). If the two limits exclude each other at high speed,
        the voltage limit holds, which an inverter cannot exceed, with the smallest currents for any torque: they are
        above i_max, and the machine brakes. A drive must not run at such speeds. w is the electrical speed in rad/s.
        """
        sign = ifelse(torque < 0.0, -1.0, 1.0)  # reversing torque and speed reverses only i_q
        most = self.most_per_ampere(i_max)
        asked, possible = sign * torque, self.torque(most)
        wanted = ifelse(asked < possible, asked, possible)
        easy = self.least_for(wanted)
        weakened = self._at_voltage(wanted, sign * w, v_max, i_max)
        fits = self.voltage(easy, sign * w) <= v_max
        return DqCurrents(ifelse(fits, easy.d, weakened.d), sign * ifelse(fits, easy.q, weakened.q))

    def _of_voltage(self, w: Scalar, v: Scalar) -> _Ellipse:
        """Currents at v_d = -v sin(angle), v_q = v cos(angle)."""
        square = self.Rs**2 + w**2 * self.Ld * self.Lq
        det = jnp.where(square > 0.0, square, 1.0)
        r, x, drive = self.Rs / det, w / det, w * self.psi
        return _Ellipse(
            DqCurrents(-x * self.Lq * drive, -r * drive),
            DqCurrents(x * self.Lq * v, r * v),
            DqCurrents(-r * v, x * self.Ld * v),
        )

    def _idle_angle(self, w: Scalar, v: Scalar) -> tuple[Scalar, Scalar]:
        """Voltage angle for zero i_q with the larger of two i_d, and whether it exists."""
        square, half = self.Rs**2 + (w * self.Ld) ** 2, w**2 * self.Ld * self.psi
        a = jnp.where(square > 0.0, square, 1.0)
        root = half**2 - a * ((w * self.psi) ** 2 - v**2)
        exists = root > 0.0
        i_d = (jnp.sqrt(jnp.where(exists, root, 1.0)) - half) / a
        return jnp.arctan2(-self.Rs * i_d, w * (self.Ld * i_d + self.psi)), exists

    def _at_voltage(self, torque: Scalar, w: Scalar, v: Scalar, i_max: Scalar) -> DqCurrents:
        """Currents at the voltage amplitude v for a torque >= 0, or for the largest torque within i_max.

        From the angle of zero torque, the torque increases up to that of MTPV. Bisection without derivatives brackets
        the last angle at which torque and current are below their bounds, and traced Newton steps correct it. A machine
        braked at a voltage near a short circuit has no angle of zero torque; the search then starts at minimum torque.
        Currents above i_max are reduced along the ellipse, at most to the smallest.
        """
        held, scale = jax.lax.stop_gradient, self.torque(self.most_per_ampere(i_max))
        at = _AtVoltage(self, self._of_voltage(w, v), torque, scale, i_max)
        idle, exists = self._idle_angle(w, v)
        circle = jnp.linspace(-jnp.pi, jnp.pi, 2 * _ANGLES)
        lowest = _root(at.turning, held(circle[jnp.argmin(at.look(circle).torque)]))
        idle = jnp.where(exists, idle, lowest)
        least = held(idle)
        angles = least + jnp.linspace(0.0, jnp.pi, _ANGLES)
        at_least, at_angles = at.look(least), at.look(angles)
        best = _root(at.turning, held(angles[jnp.argmax(at_angles.torque)]))
        # At low speed, zero torque at this voltage can need a larger current than a positive torque.
        sizes = jnp.where(angles <= best, at_angles.current, jnp.inf)
        low = held(jnp.where(at_least.current < 0.0, least, angles[jnp.argmin(sizes)]))
        bound = at.bound(low, best)
        angle = jnp.where((at.look(low).current >= 0.0) | (at_least.torque >= 0.0), idle, bound)
        shortest = _root(at.lengthening, held(circle[jnp.argmin(at.look(circle).current)]))
        too_much = at.look(angle).current > _ROUNDING
        return at.ellipse.at(jnp.where(too_much, at.shortened(angle, shortest), angle))[0]


@dataclasses.dataclass(frozen=True)
class _AtVoltage:
    """Currents of a machine at a constant voltage amplitude, compared with a required torque and a current limit."""

    machine: DqMachine
    ellipse: _Ellipse
    torque: Scalar
    scale: Scalar  # maximum torque at i_max
    i_max: Scalar

    def look(self, angle: Scalar | Array) -> _Look:
        m, (i, rate) = self.machine, self.ellipse.at(angle)
        s, k = m.Ld - m.Lq, 1.5 * m.p / self.scale
        bend_d, bend_q = (centre - one for centre, one in zip(self.ellipse.centre, i, strict=True))
        flux = m.psi + s * i.d
        return _Look(
            k * flux * i.q - self.torque / self.scale,
            k * (s * rate.d * i.q + flux * rate.q),
            k * (s * (bend_d * i.q + 2.0 * rate.d * rate.q) + flux * bend_q),
            (i.d**2 + i.q**2) / self.i_max**2 - 1.0,
            2.0 * (i.d * rate.d + i.q * rate.q) / self.i_max**2,
        )

    def turning(self, angle: Scalar) -> tuple[Scalar, Scalar]:
        """Derivative of the torque with respect to the angle, zero at an extremum, and its derivative."""
        here = self.look(angle)
        return here.rise, here.bend

    def lengthening(self, angle: Scalar) -> tuple[Scalar, Scalar]:
        """Derivative of half the squared current with respect to the angle, and its derivative."""
        i, rate = self.ellipse.at(angle)
        bend_d, bend_q = (centre - one for centre, one in zip(self.ellipse.centre, i, strict=True))
        return i.d * rate.d + i.q * rate.q, rate.d**2 + rate.q**2 + i.d * bend_d + i.q * bend_q

    def shortened(self, angle: Scalar, shortest: Scalar) -> Scalar:
        """First angle between `angle`, where the current is too large, and `shortest` with the current at its limit."""
        held = jax.lax.stop_gradient
        way = held(jnp.mod(angle - shortest + jnp.pi, 2.0 * jnp.pi) - jnp.pi)

        def halved(_: int, bracket: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
            low, high = bracket
            middle = 0.5 * (low + high)
            is_within = self.look(held(shortest) + middle * way).current < 0.0
            return jnp.where(is_within, middle, low), jnp.where(is_within, high, middle)

        ends = jnp.zeros_like(way), jnp.ones_like(way)
        share = jax.lax.fori_loop(0, _HALVINGS, halved, ends)[0]

        def excess(angle: Scalar) -> tuple[Scalar, Scalar]:
            here = self.look(angle)
            return here.current, here.growth

        is_possible = self.look(shortest).current < 0.0
        return jnp.where(is_possible, _root(excess, held(shortest) + share * way), shortest)

    def bound(self, low: Scalar, best: Scalar) -> Scalar:
        """First angle above `low` at which torque or current reaches its bound, or `best` if neither does."""
        held = jax.lax.stop_gradient
        high = held(jax.lax.fori_loop(0, _HALVINGS, self._halved, (low, held(best)))[1])
        at_high = self.look(high)
        is_enough, is_much = at_high.torque >= 0.0, at_high.current >= 0.0

        def excess(angle: Scalar) -> tuple[Scalar, Scalar]:
            """Excess over the bound reached first, and its derivative."""
            here = self.look(angle)
            value = jnp.where(is_enough, here.torque, here.current)
            return value, jnp.where(is_enough, here.rise, here.growth)

        return jnp.where(is_enough | is_much, _root(excess, high), best)

    def _halved(self, _: int, bracket: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
        low, high = bracket
        middle = 0.5 * (low + high)
        here = self.look(middle)
        below = (here.torque < 0.0) & (here.current < 0.0)
        return jnp.where(below, middle, low), jnp.where(below, high, middle)


def _root(function: Callable[[Scalar], tuple[Scalar, Scalar]], x: Scalar) -> Scalar:
    """Root near x by traced Newton steps of a function that returns value and slope; x if the slope is zero."""

    def step(_: int, x: Scalar) -> Scalar:
        value, slope = function(x)
        flat = slope == 0.0
        return x - jnp.where(flat, 0.0, value / jnp.where(flat, 1.0, slope))

    return jax.lax.fori_loop(0, _NEWTON, step, jnp.asarray(x, dtype=float))
