"""Linear motors: synchronous, in coordinates of the magnets, and voice coil."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Energy,
    Equations,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    positive,
    prefer,
)

from ..translational import Flange as Rod
from ..translational import Mass
from ._interfaces import Pin
from ._machines import TranslationalEMF
from ._passive import Inductor, Resistor
from ._pmsm import DqPort


class LinearSynchronousMotor(Component):
    """Permanent-magnet linear motor in coordinates of the magnets, with a moving mass: m dv/dt = f_rod + force.

    With w = pi v/tau_p: v_d = Rs i_d + Ld di_d/dt - w Lq i_q, v_q = Rs i_q + Lq di_q/dt + w (Ld i_d + psi), and force =
    3/2 pi/tau_p (psi i_q + (Ld - Lq) i_d i_q) - cogging sin(2 pi s/tau_p) (Boldea, Nasar, `Linear Electric Actuators
    and Generators`; peak values as in `PMSM`). A data sheet states the force constant 3/2 pi/tau_p psi per peak
    current. Not modelled: end effects, saturation, iron loss.
    """

    tau_p: Param[Scalar, "m", positive]  # pole pitch, from north to south pole
    psi: Param[Scalar, "Wb", positive]  # flux linkage of the magnets
    Ld: Param[Scalar, "H", positive]  # d-axis inductance
    Lq: Param[Scalar, "H", positive]  # q-axis inductance
    m: Param[Scalar, "kg", positive]  # moving mass
    Rs: Param[Scalar, "ohm", nonnegative] = 0.0  # phase resistance
    cogging: Param[Scalar, "N", nonnegative] = 0.0  # peak cogging force
    i_d: Var[Scalar, "A", prefer] = 0.0  # d-axis current
    i_q: Var[Scalar, "A", prefer] = 0.0  # q-axis current, which produces the force
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed of the rod
    force: Var[Scalar, "N"] = 0.0  # electromagnetic force
    terminals: DqPort = DqPort()
    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        k = jnp.pi / self.tau_p
        flux_d, flux_q = self.Ld * self.i_d + self.psi, self.Lq * self.i_q
        return dict(
            current_d=eq(self.i_d, self.terminals.i_d),
            current_q=eq(self.i_q, self.terminals.i_q),
            voltage_d=eq(self.Ld * d.i_d, self.terminals.v_d - self.Rs * self.i_d + k * self.v * flux_q),
            voltage_q=eq(self.Lq * d.i_q, self.terminals.v_q - self.Rs * self.i_q - k * self.v * flux_d),
            force=eq(
                self.force,
                1.5 * k * (flux_d * self.i_q - flux_q * self.i_d) - self.cogging * jnp.sin(2.0 * k * self.rod.s),
            ),
            speed=eq(self.v, d.rod.s),
            newton=eq(self.m * d.v, self.rod.f + self.force),
        )

    def energy(self) -> Energy:
        k = jnp.pi / self.tau_p
        magnets = self.cogging / (2.0 * k) * (1.0 - jnp.cos(2.0 * k * self.rod.s))
        coils = 0.75 * (self.Ld * self.i_d**2 + self.Lq * self.i_q**2)
        return Energy(
            stored=coils + 0.5 * self.m * self.v**2 + magnets,
            dissipated=1.5 * self.Rs * (self.i_d**2 + self.i_q**2),
        )


class VoiceCoil(Component):
    """A coil that moves in a constant magnetic field: v = R i + L di/dt + k v_rod and m dv_rod/dt = k i + f_rod.

    `VoiceCoil(R=..., k=..., m=..., L=...)`. The magnet is the ground. Not modelled: force constant that falls towards
    the ends of the stroke, heating of the coil.
    """

    resistor: Resistor
    inductor: Inductor | None
    emf: TranslationalEMF
    coil: Mass
    p: Pin
    n: Pin
    rod: Rod

    def __init__(
        self,
        *,
        R: Param[Scalar, "ohm"],  # resistance of the coil
        k: Param[Scalar, "N/A"],  # force constant
        m: Param[Scalar, "kg"],  # moving mass
        L: Param[Scalar, "H"] | None = None,  # inductance; none by default
    ) -> None:
        self.resistor, self.emf, self.coil = Resistor(R=R), TranslationalEMF(k=k), Mass(m=m)
        self.inductor = None if L is None else Inductor(L=L)
        self.p, self.n, self.rod = Pin(), Pin(), Rod()

    def connections(self) -> Connections:
        if self.inductor is None:
            winding = (connect(self.resistor.n, self.emf.p),)
        else:
            winding = (connect(self.resistor.n, self.inductor.p), connect(self.inductor.n, self.emf.p))
        return (
            connect(self.p, self.resistor.p),
            *winding,
            connect(self.emf.n, self.n),
            connect(self.emf.rod, self.coil.a),
            connect(self.coil.b, self.rod),
        )
