"""Operational amplifier and comparator with limited output."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
    unbounded,
    when,
)

from .._limit import limited
from ._interfaces import Pin


class Amplifier(Component, partial=True):
    """A stage with two inputs without current and one output between v_min and v_max; the supply is not modelled."""

    v_max: Param[Scalar, "V"]  # upper limit of the output, somewhat below the positive supply
    v_min: Param[Scalar, "V"]  # lower limit of the output
    R_out: Param[Scalar, "ohm", nonnegative] = 0.0  # output resistance
    p: Pin = Pin()  # non-inverting input
    n: Pin = Pin()  # inverting input
    out: Pin = Pin()

    def requirements(self) -> Requirements:
        return (require(self.v_min < self.v_max, "v_min must be smaller than v_max"),)

    def inner(self) -> Scalar:
        """Output voltage in V before the output resistance."""
        raise NotImplementedError

    def equations(self, d: Any) -> Equations:
        return dict(
            no_current_p=eq(self.p.i),
            no_current_n=eq(self.n.i),
            output=eq(self.out.v, self.inner() + self.R_out * self.out.i),
        )

    def energy(self) -> Energy:
        return Energy(supplied=-self.inner() * self.out.i, dissipated=self.R_out * self.out.i**2)


class OpAmp(Amplifier):
    """Operational amplifier with one pole, slew rate and limited output.

    dx/dt = 2 pi f_t [v_p - v_n - x/gain - (x - v)], limited to +-slew, and v = x limited to v_min .. v_max. The output
    is v + R_out i with the current i into it. Within the limits the gain is gain / (1 + j f gain/f_t); at a limit the
    last term stops x at the distance v_p - v_n beyond it, and the return takes at least the time |v_p - v_n|/slew. A
    circuit of amplifiers with static gain has jumps at which no solution exists, such as a multivibrator: the pole
    decides where it goes (macromodel of Boyle et al., IEEE J. Solid-State Circuits 9, 1974, without currents and offset
    at its inputs; MSL `OpAmpDetailed`). Without limits and poles see `IdealOpAmp`.
    """

    gain: Param[Scalar, "1", positive] = 1e5  # open-loop gain at low frequency
    f_t: Param[Scalar, "Hz", positive] = 1e6  # gain-bandwidth product, transit frequency
    slew: Param[Scalar, "V/s", positive, unbounded] = jnp.inf  # slew rate; 1 V/us is 1e6 V/s
    x: Var[Scalar, "V", prefer] = 0.0  # voltage of the pole

    def inner(self) -> Scalar:
        return limited(self.x, self.v_min, self.v_max)

    def equations(self, d: Self) -> Equations:
        drive = self.p.v - self.n.v - self.x / self.gain - (self.x - self.inner())
        return super().equations(d) | dict(
            pole=eq(d.x, limited(2.0 * jnp.pi * self.f_t * drive, -self.slew, self.slew))
        )


class VoltageComparator(Amplifier):
    """The output is v_max if v_p - v_n exceeds band/2, and v_min if it falls below -band/2; both changes are events.

    Within the band it keeps its state, initially `is_high`. A Schmitt trigger has a wide band; a comparator without
    delay and feedback in between also needs one, above its noise.
    """

    band: Param[Scalar, "V", positive]  # hysteresis of v_p - v_n
    is_high: Discrete[Scalar, "1"] = 0.0  # 1 while the output is v_max

    def inner(self) -> Scalar:
        return jnp.where(self.is_high > 0.5, self.v_max, self.v_min)

    def events(self) -> Events:
        above, half, is_high = self.p.v - self.n.v, 0.5 * self.band, self.is_high > 0.5
        return dict(
            rise=when(~is_high & (above > half), is_high=1.0),
            fall=when(is_high & (above < -half), is_high=0.0),
        )
