"""Learned friction, damping and stiffness, passive for all weights."""

from typing import Self

import jax
import jax.numpy as jnp

from acausal import Energy, Equations, Param, Requirements, Scalar, Var, eq, positive, require

from ..blocks import Curve, MonotoneCurve
from ._dry_friction import ShaftFriction
from ._interfaces import Compliant, ToGround


def _scalar(network: Curve) -> Requirements:
    said = "network must map a number to a number, as Network.of(8, key) does"
    return (require(network.is_scalar, said),)


class LearnedFriction(ShaftFriction):
    """Dry friction with a learned level, which sticks: |tau| = T softplus(n(|w|/ws)) while it slides, n a network.

    The level is positive for all weights, so the friction dissipates. The break-away torque is the level at rest.
    """

    network: Curve  # n, from speed over `ws` to a number
    T: Param[Scalar, "N.m", positive]  # scale of the torque
    ws: Param[Scalar, "rad/s", positive]  # scale of the speed, such as its largest value

    def requirements(self) -> Requirements:
        return _scalar(self.network)

    def sliding(self, speed: Scalar) -> Scalar:
        return self.T * jax.nn.softplus(self.network(speed / self.ws))


class SmoothLearnedFriction(ToGround):
    """Friction with a learned level, smoothed at rest: tau = T softplus(n(s)) tanh(w/w0), s = sqrt(w^2 + w0^2)/ws.

    The level is positive for all weights of the network n, so tau w >= 0: the friction dissipates. It is odd in w. It
    creeps where `LearnedFriction` sticks, and costs no events.
    """

    network: Curve  # n, from s to a number
    T: Param[Scalar, "N.m", positive]  # scale of the torque
    ws: Param[Scalar, "rad/s", positive]  # scale of the speed, such as its largest value
    w0: Param[Scalar, "rad/s", positive]  # width of the transition through rest

    def requirements(self) -> Requirements:
        return _scalar(self.network)

    def torque(self, w: Scalar) -> Scalar:
        """Friction torque at a speed."""
        s = jnp.sqrt(w**2 + self.w0**2) / self.ws
        return self.T * jax.nn.softplus(self.network(s)) * jnp.tanh(w / self.w0)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(friction=eq(self.flange.tau, self.torque(self.w)))

    def energy(self) -> Energy:
        return Energy(dissipated=self.torque(self.w) * self.w)


class LearnedDamper(Compliant):
    """Damper with a learned characteristic: tau = T m(w_rel/w0), where m rises and m(0) = 0 for all weights.

    So it dissipates, and so does the difference of two motions: (tau_1 - tau_2) (w_1 - w_2) >= 0.
    """

    curve: MonotoneCurve  # m, from relative speed over `w0` to torque over `T`
    T: Param[Scalar, "N.m", positive]  # scale of the torque
    w0: Param[Scalar, "rad/s", positive]  # scale of the speed
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self.T * self.curve(self.w_rel / self.w0)),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.T * self.curve(self.w_rel / self.w0) * self.w_rel)


class LearnedSpring(Compliant):
    """Spring with a learned energy E = T phi0 softplus(n(phi_rel/phi0)), n a network: tau = dE/dphi_rel.

    The torque is the gradient of an energy that is positive for all weights, as in a port-Hamiltonian system, so the
    spring can return no more energy than it stores.
    """

    network: Curve  # n, from phi_rel over `phi0` to a number
    T: Param[Scalar, "N.m", positive]  # scale of the torque
    phi0: Param[Scalar, "rad", positive]  # scale of the angle

    def requirements(self) -> Requirements:
        return _scalar(self.network)

    def stored(self, x: Scalar) -> Scalar:
        """E / (T phi0) at a relative angle over `phi0`."""
        return jax.nn.softplus(self.network(x))

    def equations(self, d: Self) -> Equations:
        x = self.phi_rel / self.phi0
        slope = jax.jvp(self.stored, (x,), (jnp.ones_like(x),))[1]
        return super().equations(d) | dict(gradient=eq(self.tau, self.T * slope))

    def energy(self) -> Energy:
        return Energy(stored=self.T * self.phi0 * self.stored(self.phi_rel / self.phi0))
