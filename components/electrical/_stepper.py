"""Stepper motor."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ..rotational import Flange
from ._interfaces import Pin


class StepperMotor(Component):
    """Hybrid or permanent-magnet stepper motor with two phases A and B and rotor inertia.

    v_A = R i_A + L di_A/dt - k w sin(N phi), v_B = R i_B + L di_B/dt + k w cos(N phi), and J dw/dt = tau - k i_A
    sin(N phi) + k i_B cos(N phi) - detent sin(4 N phi) - C w (Kenjo, `Stepping Motors and Their Microprocessor
    Controls`; Simscape `Stepper Motor`). A full step is pi/(2 N) rad: N = 50 rotor teeth give 1.8 degrees. With the
    rated current I in both phases, the holding torque is sqrt(2) k I. The stator is the ground. Not modelled:
    saturation, iron loss, inductance that depends on the angle.
    """

    R: Param[Scalar, "ohm", nonnegative]  # resistance of a phase
    L: Param[Scalar, "H", positive]  # inductance of a phase
    k: Param[Scalar, "N.m/A", positive]  # torque constant: peak torque of a phase per current
    N: Param[Scalar, "1", positive]  # number of rotor teeth or pole pairs
    J: Param[Scalar, "kg.m2", positive]  # moment of inertia of the rotor
    detent: Param[Scalar, "N.m", nonnegative] = 0.0  # peak detent torque without current
    C: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # viscous friction coefficient
    i_A: Var[Scalar, "A", prefer] = 0.0  # current of phase A
    i_B: Var[Scalar, "A", prefer] = 0.0  # current of phase B
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    torque: Var[Scalar, "N.m"] = 0.0  # torque of currents and detent
    A_p: Pin = Pin()
    A_n: Pin = Pin()
    B_p: Pin = Pin()
    B_n: Pin = Pin()
    shaft: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        angle = self.N * self.shaft.phi
        sine, cosine = jnp.sin(angle), jnp.cos(angle)
        return dict(
            current_A=eq(self.i_A, self.A_p.i),
            current_B=eq(self.i_B, self.B_p.i),
            kirchhoff_A=eq(self.A_p.i + self.A_n.i),
            kirchhoff_B=eq(self.B_p.i + self.B_n.i),
            coil_A=eq(self.L * d.i_A, self.A_p.v - self.A_n.v - self.R * self.i_A + self.k * self.w * sine),
            coil_B=eq(self.L * d.i_B, self.B_p.v - self.B_n.v - self.R * self.i_B - self.k * self.w * cosine),
            torque=eq(
                self.torque,
                self.k * (self.i_B * cosine - self.i_A * sine) - self.detent * jnp.sin(4.0 * angle),
            ),
            speed=eq(self.w, d.shaft.phi),
            newton=eq(self.J * d.w, self.shaft.tau + self.torque - self.C * self.w),
        )

    def energy(self) -> Energy:
        magnets = self.detent / (4.0 * self.N) * (1.0 - jnp.cos(4.0 * self.N * self.shaft.phi))
        square = self.i_A**2 + self.i_B**2
        return Energy(
            stored=0.5 * self.L * square + 0.5 * self.J * self.w**2 + magnets,
            dissipated=self.R * square + self.C * self.w**2,
        )
