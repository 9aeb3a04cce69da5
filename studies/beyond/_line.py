"""Inertia of the liquid in a line, and length of the line.

The thesis models the line as a spring with the stiffness of the whole liquid, without inertia or pressure drop. This
study adds a pipe of a given length with pressure waves, and compares it with the same liquid as a spring only. The
difference is the effect of inertia and friction.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import jax.numpy as jnp

from acausal import Component, Connections, Scalar, connect
from components.hydraulic import FluidPort, LaminarFriction, LaminarResistance, Line, Pipe, dot_4

from ..actuators import ClutchActuator, opening
from ._prototypes import PROTOTYPES, RE40, RE50, Build
from ._row import Row

ITEM = "line"
DIAMETER = 4e-3  # m, inner diameter of a typical steel pipe for brakes and clutches; assumed
LENGTHS = (0.25, 0.5, 1.0, 2.0)  # m
SEGMENTS = 6
LIQUID = dot_4(293.15)
LATEST = 1.0  # s, limit of a run
ACTUATORS = {name: PROTOTYPES[name].build for name in (RE50, RE40)}
SPRING, FRICTION, WHOLE = "spring", "spring and friction", "spring, friction and inertia"


class LongLine(Component):
    """The liquid of pump or master cylinder as a spring, and a pipe to the slave cylinder."""

    spring: Line
    pipe: Pipe | LaminarResistance
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def connections(self) -> Connections:
        return (
            connect(self.a, self.spring.a),
            connect(self.spring.b, self.pipe.a),
            connect(self.pipe.b, self.b),
        )


def with_pipe(actuator: ClutchActuator, length: Scalar) -> ClutchActuator:
    """The actuator with a pipe of a length in m, with pressure waves, between line and slave cylinder."""
    pipe = Pipe(n=SEGMENTS, length=length, diameter=DIAMETER, liquid=LIQUID, friction=LaminarFriction(), p=0.0, q=0.0)
    return dataclasses.replace(actuator, line=LongLine(spring=actuator.line, pipe=pipe))


def with_drop(actuator: ClutchActuator, length: Scalar, friction: float = 1.0) -> ClutchActuator:
    """The actuator with the liquid of the pipe added to the spring, and with a share of its laminar pressure drop."""
    volume = 0.25 * jnp.pi * DIAMETER**2 * length
    line, added = actuator.line, LIQUID.bulk_modulus_at(1e6) / volume
    stiffness = 1.0 / (1.0 / line.stiffness + 1.0 / added)
    spring = Line(stiffness=stiffness, damping=line.damping * stiffness / line.stiffness)
    viscosity = friction * LIQUID.reference_density * LIQUID.kinematic_viscosity(0.0)
    drop = LaminarResistance.from_pipe(diameter=DIAMETER, length=length, viscosity=viscosity)
    return dataclasses.replace(actuator, line=LongLine(spring=spring, pipe=drop))


def moved_mass(actuator: ClutchActuator, length: float) -> float:
    """The liquid mass in kg referred to the slave, rho L A_s^2/A."""
    area = 0.25 * jnp.pi * DIAMETER**2
    return float(LIQUID.reference_density * length * actuator.slave.area**2 / area)


def rows(
    rtol: float = 1e-6, lengths: Sequence[float] = LENGTHS, actuators: Mapping[str, Build] = ACTUATORS
) -> list[Row]:
    """Rows of the opening times with pipes of several lengths."""

    def time(model: ClutchActuator) -> float:
        return float(opening(model, t_max=LATEST, save="end", rtol=rtol, throw=True, max_steps=100_000).t1)

    table = []
    for name, build in actuators.items():
        base = build()
        for length in lengths:
            case = f"{name}, {length:g} m"
            models = {
                SPRING: with_drop(base, length, 0.0), FRICTION: with_drop(base, length), WHOLE: with_pipe(base, length),
            }  # fmt: skip
            table += [Row(ITEM, f"{case}, {what}", "opening time", "s", time(model)) for what, model in models.items()]
            mass = moved_mass(base, length)
            table.append(Row(ITEM, case, "liquid mass referred to the slave", "kg", mass, remark="the rod has 0.3 kg"))
    return table
