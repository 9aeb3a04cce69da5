"""Three phases: port, source, series impedance, star of capacitors, star point, and connections to other ports."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Flow,
    Param,
    Port,
    Scalar,
    Time,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
)

from ..rotational import Flange
from ._interfaces import Pin
from ._pmsm import DqPort

PHASES = ("a", "b", "c")


def phase_angles(theta: Scalar) -> dict[str, Scalar]:
    """Angles of the phases, each a third of a turn behind the one before; theta is that of phase a."""
    return {x: theta - 2.0 * k * jnp.pi / 3.0 for k, x in enumerate(PHASES)}


class PhasePort(Port):
    """The conductors of three phases; the sum of v i is the power into the component."""

    v_a: Var[Scalar, "V"] = 0.0  # potential of phase a
    v_b: Var[Scalar, "V"] = 0.0  # potential of phase b
    v_c: Var[Scalar, "V"] = 0.0  # potential of phase c
    i_a: Flow[Scalar, "A"] = 0.0  # current of phase a, positive into the component
    i_b: Flow[Scalar, "A"] = 0.0  # current of phase b
    i_c: Flow[Scalar, "A"] = 0.0  # current of phase c

    def power(self, d: Self) -> Scalar:
        del d
        return self.v_a * self.i_a + self.v_b * self.i_b + self.v_c * self.i_c


class PhasePins(Component):
    """The three phases as single pins a, b and c."""

    phases: PhasePort = PhasePort()
    a: Pin = Pin()
    b: Pin = Pin()
    c: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(
            voltage_a=eq(self.phases.v_a, self.a.v),
            voltage_b=eq(self.phases.v_b, self.b.v),
            voltage_c=eq(self.phases.v_c, self.c.v),
            current_a=eq(self.phases.i_a + self.a.i),
            current_b=eq(self.phases.i_b + self.b.i),
            current_c=eq(self.phases.i_c + self.c.i),
        )


class StarPoint(Component):
    """Joins three phases in the pin n. Without a connection of n, the sum of the currents is zero."""

    phases: PhasePort = PhasePort()
    n: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(
            voltage_a=eq(self.phases.v_a, self.n.v),
            voltage_b=eq(self.phases.v_b, self.n.v),
            voltage_c=eq(self.phases.v_c, self.n.v),
            kirchhoff=eq(self.phases.i_a + self.phases.i_b + self.phases.i_c + self.n.i),
        )


class ThreePhaseSource(Component):
    """Three sines with a star point n: v_x - v_n = V cos(2 pi f t + phase - x 2 pi/3), x = 0, 1, 2.

    V is the peak of the phase voltage: sqrt(2/3) times the line-to-line voltage by which mains are named.
    """

    V: Param[Scalar, "V"]  # peak phase voltage
    f: Param[Scalar, "Hz", positive]  # frequency
    phase: Param[Scalar, "rad"] = 0.0  # angle of phase a at t = 0
    t: Time[Scalar, "s"] = 0.0
    phases: PhasePort = PhasePort()
    n: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        angle, port = 2.0 * jnp.pi * self.f * self.t + self.phase, self.phases
        return dict(
            source_a=eq(port.v_a - self.n.v, self.V * jnp.cos(angle)),
            source_b=eq(port.v_b - self.n.v, self.V * jnp.cos(angle - 2.0 * jnp.pi / 3.0)),
            source_c=eq(port.v_c - self.n.v, self.V * jnp.cos(angle + 2.0 * jnp.pi / 3.0)),
            kirchhoff=eq(port.i_a + port.i_b + port.i_c + self.n.i),
        )

    def energy(self) -> Energy:
        return Energy(supplied=-self.phases.power(self.phases) - self.n.v * self.n.i)


class PhaseImpedance(Component):
    """R and L in series in each phase, from p to n: v = R i + L di/dt. The filter of an inverter, a cable, a load."""

    R: Param[Scalar, "ohm", nonnegative]  # resistance of a phase
    L: Param[Scalar, "H", positive]  # inductance of a phase
    i_a: Var[Scalar, "A", prefer] = 0.0  # current of phase a from p to n
    i_b: Var[Scalar, "A", prefer] = 0.0  # current of phase b
    i_c: Var[Scalar, "A", prefer] = 0.0  # current of phase c
    p: PhasePort = PhasePort()
    n: PhasePort = PhasePort()

    def equations(self, d: Self) -> Equations:
        p, n = self.p, self.n
        return dict(
            current_a=eq(self.i_a, p.i_a),
            current_b=eq(self.i_b, p.i_b),
            current_c=eq(self.i_c, p.i_c),
            kirchhoff_a=eq(p.i_a + n.i_a),
            kirchhoff_b=eq(p.i_b + n.i_b),
            kirchhoff_c=eq(p.i_c + n.i_c),
            coil_a=eq(p.v_a - n.v_a, self.R * self.i_a + self.L * d.i_a),
            coil_b=eq(p.v_b - n.v_b, self.R * self.i_b + self.L * d.i_b),
            coil_c=eq(p.v_c - n.v_c, self.R * self.i_c + self.L * d.i_c),
        )

    def energy(self) -> Energy:
        square = self.i_a**2 + self.i_b**2 + self.i_c**2
        return Energy(stored=0.5 * self.L * square, dissipated=self.R * square)


class PhaseCapacitor(Component):
    """A capacitor from each phase to the star point n: C dv/dt = i. With a `PhaseImpedance`, an LC filter."""

    C: Param[Scalar, "F", positive]  # capacitance of a phase
    v_a: Var[Scalar, "V", prefer] = 0.0  # voltage of phase a to n
    v_b: Var[Scalar, "V", prefer] = 0.0  # voltage of phase b
    v_c: Var[Scalar, "V", prefer] = 0.0  # voltage of phase c
    phases: PhasePort = PhasePort()
    n: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        port = self.phases
        return dict(
            voltage_a=eq(self.v_a, port.v_a - self.n.v),
            voltage_b=eq(self.v_b, port.v_b - self.n.v),
            voltage_c=eq(self.v_c, port.v_c - self.n.v),
            charge_a=eq(port.i_a, self.C * d.v_a),
            charge_b=eq(port.i_b, self.C * d.v_b),
            charge_c=eq(port.i_c, self.C * d.v_c),
            kirchhoff=eq(port.i_a + port.i_b + port.i_c + self.n.i),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.C * (self.v_a**2 + self.v_b**2 + self.v_c**2))


class DqTerminals(Component):
    """The terminals of a machine in rotor coordinates as three phases without a neutral conductor (Park).

    v_d = 2/3 sum of v_x cos(theta - x 2 pi/3) and v_q = -2/3 sum of v_x sin(theta - x 2 pi/3), x = 0, 1, 2, with the
    electrical angle theta = p phi of the shaft; the currents in reverse. Their sum is zero. Lossless, without
    torque.
    """

    p: Param[Scalar, "1", positive]  # number of pole pairs of the machine
    v_star: Var[Scalar, "V"] = 0.0  # potential of the star point
    phases: PhasePort = PhasePort()
    machine: DqPort = DqPort()
    shaft: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        angles = phase_angles(self.p * self.shaft.phi)
        v = {x: getattr(self.phases, f"v_{x}") - self.v_star for x in PHASES}
        currents = {
            f"current_{x}": eq(
                getattr(self.phases, f"i_{x}"),
                -self.machine.i_d * jnp.cos(angles[x]) + self.machine.i_q * jnp.sin(angles[x]),
            )
            for x in PHASES
        }
        return currents | dict(
            star=eq(3.0 * self.v_star, self.phases.v_a + self.phases.v_b + self.phases.v_c),
            voltage_d=eq(1.5 * self.machine.v_d, sum(v[x] * jnp.cos(angles[x]) for x in PHASES)),
            voltage_q=eq(1.5 * self.machine.v_q, -sum(v[x] * jnp.sin(angles[x]) for x in PHASES)),
            no_torque=eq(self.shaft.tau),
        )
