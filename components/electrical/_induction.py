"""Induction machine in stator coordinates."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ..rotational import Flange
from ._three_phase import PhasePort


class InductionMachine(Component):
    """Induction machine with a squirrel cage, in stator coordinates (MSL `IM_SquirrelCage`): J dw/dt = tau + torque.

    With space vectors, whose real part is phase a: v = Rs i + dPsi/dt, 0 = Rr i_r + dPsi_r/dt - j p w Psi_r, Psi = (Lm
    + Lssigma) i + Lm i_r, Psi_r = (Lm + Lrsigma) i_r + Lm i, and torque = 3/2 p Im(conj(Psi) i), in peak values, with
    rotor quantities referred to the stator (Schroeder, `Elektrische Antriebe - Grundlagen`, ch. 5). The winding is a
    star without neutral conductor; for a delta, divide its resistances and inductances by 3. Without Rs, the torque
    over the slip s is that of Kloss: 2 T_k / (s/s_k + s_k/s), see `pull_out`. Not modelled: saturation, skin effect,
    iron loss.
    """

    p: Param[Scalar, "1", positive]  # number of pole pairs
    Rr: Param[Scalar, "ohm", positive]  # rotor resistance of a phase
    Lm: Param[Scalar, "H", positive]  # main inductance of a phase, for three currents
    Lssigma: Param[Scalar, "H", positive]  # stator leakage inductance of a phase
    Lrsigma: Param[Scalar, "H", positive]  # rotor leakage inductance of a phase
    J: Param[Scalar, "kg.m2", positive]  # moment of inertia of the rotor
    Rs: Param[Scalar, "ohm", nonnegative] = 0.0  # stator resistance of a phase
    psi_re: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage of the stator, real part
    psi_im: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage of the stator, imaginary part
    psi_r_re: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage of the rotor, real part
    psi_r_im: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage of the rotor, imaginary part
    i_re: Var[Scalar, "A"] = 0.0  # stator current, real part
    i_im: Var[Scalar, "A"] = 0.0  # stator current, imaginary part
    i_r_re: Var[Scalar, "A"] = 0.0  # rotor current, real part
    i_r_im: Var[Scalar, "A"] = 0.0  # rotor current, imaginary part
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    torque: Var[Scalar, "N.m"] = 0.0  # electromagnetic torque
    phases: PhasePort = PhasePort()
    shaft: Flange = Flange()

    def _inductances(self) -> tuple[Scalar, Scalar, Scalar]:
        """Inductances of stator and rotor, and their product less the square of the main inductance."""
        stator, rotor = self.Lm + self.Lssigma, self.Lm + self.Lrsigma
        return stator, rotor, self.Lm * self.Lssigma + stator * self.Lrsigma

    def pull_out(self, V: Scalar, f: Scalar) -> tuple[Scalar, Scalar]:
        """Torque in N.m and slip of Kloss's formula, without Rs, for the peak phase voltage V and the frequency f."""
        w = 2.0 * jnp.pi * f
        stator, _, square = self._inductances()
        slip = self.Rr * stator / (w * square)
        return 0.75 * self.p * (V / w * self.Lm) ** 2 / (stator * square), slip

    def equations(self, d: Self) -> Equations:
        stator, rotor, square = self._inductances()
        port, w_el = self.phases, self.p * self.w
        return dict(
            current_re=eq(square * self.i_re, rotor * self.psi_re - self.Lm * self.psi_r_re),
            current_im=eq(square * self.i_im, rotor * self.psi_im - self.Lm * self.psi_r_im),
            cage_re=eq(square * self.i_r_re, stator * self.psi_r_re - self.Lm * self.psi_re),
            cage_im=eq(square * self.i_r_im, stator * self.psi_r_im - self.Lm * self.psi_im),
            stator_re=eq(3.0 * (d.psi_re + self.Rs * self.i_re), 2.0 * port.v_a - port.v_b - port.v_c),
            stator_im=eq(jnp.sqrt(3.0) * (d.psi_im + self.Rs * self.i_im), port.v_b - port.v_c),
            rotor_re=eq(d.psi_r_re + self.Rr * self.i_r_re + w_el * self.psi_r_im),
            rotor_im=eq(d.psi_r_im + self.Rr * self.i_r_im - w_el * self.psi_r_re),
            phase_a=eq(port.i_a, self.i_re),
            phase_b=eq(2.0 * port.i_b, -self.i_re + jnp.sqrt(3.0) * self.i_im),
            phase_c=eq(2.0 * port.i_c, -self.i_re - jnp.sqrt(3.0) * self.i_im),
            torque=eq(self.torque, 1.5 * self.p * (self.psi_re * self.i_im - self.psi_im * self.i_re)),
            speed=eq(self.w, d.shaft.phi),
            newton=eq(self.J * d.w, self.shaft.tau + self.torque),
        )

    def energy(self) -> Energy:
        stator = self.psi_re * self.i_re + self.psi_im * self.i_im
        rotor = self.psi_r_re * self.i_r_re + self.psi_r_im * self.i_r_im
        lost = self.Rs * (self.i_re**2 + self.i_im**2) + self.Rr * (self.i_r_re**2 + self.i_r_im**2)
        return Energy(stored=0.75 * (stator + rotor) + 0.5 * self.J * self.w**2, dissipated=1.5 * lost)
