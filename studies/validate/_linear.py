"""The present actuator as a linear system with two degrees of freedom, as in the thesis.

The rotating parts and the parts that move with the piston are two masses with the liquid between them, and with the
clutch spring at the second mass. Inputs are the motor current and a force on the piston.
"""

import dataclasses

import equinox as eqx
import numpy as np
from jaxtyping import Float

from acausal import Component, Connections, LinearSystem, Scalar, connect, linearise
from components.electrical import ConstantCurrent
from components.translational import ConstantForce

from ..actuators import WormActuator, sila

CLUTCH_STIFFNESS = 1.2e5  # N/m, of Table 4.1
INPUTS = ("actuator.supply.I", "push.force")
OUTPUTS = ("actuator.motor.rotor.w", "actuator.piston.v", "actuator.clutch.flange.f")
STATES = ("actuator.motor.rotor.w", "actuator.line.V", "actuator.piston.v", "actuator.slave.rod.s")
TURNING = ("actuator.motor.rotor", "actuator.gearbox", "actuator.cam")


class PushedActuator(Component):
    """The present actuator with a force source at its piston."""

    actuator: WormActuator
    push: ConstantForce

    def connections(self) -> Connections:
        return (connect(self.push.flange, self.actuator.piston.b),)


@dataclasses.dataclass(frozen=True)
class Share:
    """The shares of a quantity on the motor side and on the slave side."""

    motor: float
    slave: float


@dataclasses.dataclass(frozen=True)
class Mode:
    """A mode of the linear actuator."""

    frequency: float  # Hz
    shape: Share  # displacements referred to the slave, normalised to 1
    kinetic: Share
    potential: Share  # liquid as the motor side, clutch spring as the slave side


def linear_actuator(**keywords: Scalar) -> PushedActuator:
    """The present actuator with a current source; by default undamped with the spring of Table 4.1."""
    undamped = dict(friction=0.0, line_damping=0.0, piston_damping=0.0, spring_rate=CLUTCH_STIFFNESS)
    actuator = eqx.tree_at(lambda model: model.supply, sila(**(undamped | keywords)), ConstantCurrent(I=0.0))
    return PushedActuator(actuator=actuator, push=ConstantForce(force=0.0))


def linear_system(model: PushedActuator) -> LinearSystem:
    """The linear system from the motor current to the force on the clutch, both positive."""
    force = {"force": lambda m: -m.actuator.clutch.flange.f}
    return linearise(model, inputs=INPUTS[:1], outputs=force)


def turning_inertia(actuator: WormActuator) -> float:
    """Total inertia of the rotating parts in kg.m2, referred to the motor shaft."""
    return float(actuator.motor.rotor.J + actuator.gearbox.J + actuator.cam.J / actuator.gearbox.ratio**2)


def travel(actuator: WormActuator) -> float:
    """Travel of the slave per motor angle in m/rad, for an incompressible liquid."""
    slope = actuator.cam.profile.slope(0.0) / actuator.gearbox.ratio
    return float(slope * actuator.master.area / actuator.slave.area)


@dataclasses.dataclass(frozen=True)
class Matrices:
    """dx/dt = A x + B u, y = C x + D u in the states of the thesis: angular momentum, compression, momentum, stroke.

    u are current and force, y the speeds of motor and piston and the force on the clutch.
    """

    A: Float[np.ndarray, "4 4"]
    B: Float[np.ndarray, "4 2"]
    C: Float[np.ndarray, "3 4"]
    D: Float[np.ndarray, "3 2"]


def matrices(model: PushedActuator) -> Matrices:
    """The matrices of `linearise`, in the states of the thesis."""
    system, to_states = _linearised(model)
    momenta = np.array([turning_inertia(model.actuator), 1.0, float(model.actuator.piston.m), 1.0])
    to_states = momenta[:, None] * to_states
    # The motor angle is an additional state of the library; nothing depends on it.
    back = np.linalg.pinv(to_states)
    # The current of a source is positive into its pin p, which is connected to the motor.
    signs = np.array([-1.0, 1.0])
    A, B, C, D = (np.asarray(matrix) for matrix in (system.A, system.B, system.C, system.D))
    return Matrices(to_states @ A @ back, to_states @ B * signs, C[len(STATES) :] @ back, D[len(STATES) :] * signs)


def static_gains(model: PushedActuator) -> tuple[float, float]:
    """Static force on the clutch per motor torque in N/(N.m), and motor angle per stroke in rad/m."""
    found = matrices(model)
    state = np.linalg.solve(found.A, -found.B[:, 0])
    force = float(found.C[2] @ state) / float(model.actuator.motor.emf.k)
    _, compression, _, stroke = state.tolist()
    delivered = float(model.actuator.slave.area) * stroke + compression
    return force, delivered / (float(model.actuator.slave.area) * travel(model.actuator)) / stroke


def modes(model: PushedActuator) -> list[Mode]:
    """The modes of the undamped actuator, in ascending order of frequency."""
    system, to_states = _linearised(model)
    found, energy = system.modes, system.energy
    speeds = (to_states @ np.asarray(found.shapes))[[0, 2]] * np.array([[travel(model.actuator)], [1.0]])
    return [
        Mode(
            frequency=float(found.frequency[i]),
            shape=Share(*(speeds[:, i] / speeds[np.argmax(np.abs(speeds[:, i])), i]).real.tolist()),
            kinetic=_share(sum(energy[part][i] for part in TURNING), energy["actuator.piston"][i]),
            potential=_share(energy["actuator.line"][i], energy["actuator.clutch"][i]),
        )
        for i in np.flatnonzero(np.asarray(found.poles.imag) > 1.0)
    ]


def _linearised(model: PushedActuator) -> tuple[LinearSystem, Float[np.ndarray, "4 states"]]:
    """The linear system, and the transformation from its states to `STATES`."""
    system = linearise(model, inputs=INPUTS, outputs=STATES + OUTPUTS)
    return system, np.asarray(system.C)[: len(STATES)]


def _share(motor: Scalar, slave: Scalar) -> Share:
    return Share(float(motor / (motor + slave)), float(slave / (motor + slave)))
