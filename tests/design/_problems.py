"""Problems with closed-form solutions."""

import jax.numpy as jnp

from acausal import Component, Param, Scalar, positive


class GearedLoad(Component):
    """An inertia turned by an angle from rest to rest through a gear, by a motor of limited torque.

    With J = J_load + N^2 J_motor and F = N T the motion takes 2 sqrt(angle J / F), least at N = sqrt(J_load / J_motor);
    the motor's speed reaches N sqrt(angle F / J). See Pasch and Seering, J. Mech. Trans. Autom. Des. 106 (1984) 102.
    """

    ratio: Param[Scalar, "1", positive] = 10.0
    J_load: Param[Scalar, "kg.m2", positive] = 0.02
    J_motor: Param[Scalar, "kg.m2", positive] = 5.6e-5
    torque: Param[Scalar, "N.m", positive] = 0.25
    angle: Param[Scalar, "rad", positive] = 1.5

    @property
    def acceleration(self) -> Scalar:
        return self.ratio * self.torque / (self.J_load + self.ratio**2 * self.J_motor)

    @property
    def time(self) -> Scalar:
        return 2.0 * jnp.sqrt(self.angle / self.acceleration)

    @property
    def motor_speed(self) -> Scalar:
        return self.ratio * jnp.sqrt(self.angle * self.acceleration)


class Box(Component):
    """A box without a lid. Of all with the volume V that with base b = (2 V)^(1/3), height b / 2 has the least area."""

    base: Param[Scalar, "m", positive] = 1.0
    height: Param[Scalar, "m", positive] = 1.0

    @property
    def area(self) -> Scalar:
        return self.base**2 + 4.0 * self.base * self.height

    @property
    def volume(self) -> Scalar:
        return self.base**2 * self.height


class Valleys(Component):
    """y = (x^2 - 1)^2 + x / 10: two valleys, of which that of negative x is the deeper one."""

    x: Param[Scalar, "m"] = 1.5

    @property
    def height(self) -> Scalar:
        return (self.x**2 - 1.0) ** 2 + 0.1 * self.x
