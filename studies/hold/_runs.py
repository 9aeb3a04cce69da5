"""Simulations of the whole hold, with the energy from the battery."""

import functools as ft
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from acausal import Scalar, Solution, simulate

from ..actuators import STROKE, MotorHeldActuator, ValveHeldActuator, hold, motor_held, valve_held

DURATION = 60.0  # s, such as at a traffic light
DESIGNS: Mapping[str, Callable[..., Any]] = MappingProxyType({"motor_held": motor_held, "valve_held": valve_held})


class Outcome(eqx.Module):
    """Results of a hold."""

    energy: Array  # J, from the battery
    top_ups: Array  # number of times that the motor runs again
    period: Array  # s, from the first top-up to the second; infinite if there are fewer


def run(
    model: MotorHeldActuator | ValveHeldActuator, rtol: Scalar = 1e-9, save: object = "steps", *, energy: bool = True
) -> Solution:
    """Opens the clutch and holds it for `DURATION`. The integrals are the energies in J of "motor" and "coil"."""
    return simulate(
        model, DURATION, save=save, energy=energy, integrals=_powers, rtol=rtol, max_steps=50_000, max_events=512
    )


def static_power(model: MotorHeldActuator, stroke: Scalar = STROKE) -> Scalar:
    """The motor power in W that holds the slave at `stroke` in m, in closed form: P = (R i + k w) i."""
    motor, i = model.motor, static_current(model, stroke)
    return (motor.resistor.R * i + motor.emf.k * _speed(model, stroke)) * i


def static_current(model: MotorHeldActuator, stroke: Scalar = STROKE) -> Scalar:
    """The motor current in A that holds against the load and the bearing friction: k i = D p + C w."""
    motor = model.motor
    friction = 0.0 if motor.bearing is None else motor.bearing.C
    return hold(model, stroke).current + friction * _speed(model, stroke) / motor.emf.k


def _speed(model: MotorHeldActuator, stroke: Scalar) -> Scalar:
    """The speed in rad/s at which the pump compensates for the leakage: D w = p / R_leak."""
    return hold(model, stroke).pressure / (model.leak.resistance * model.pump.displacement)


@ft.partial(jax.jit, static_argnames="design")
def outcomes(
    design: str, keywords: dict[str, Scalar], directions: dict[str, Scalar], rtol: Scalar
) -> tuple[Outcome, Outcome]:
    """The outcome for each member of the arrays in `keywords`, and its derivative along `directions`.

    The members run one after the other, because under `vmap` each would take as many steps as the slowest.
    """
    one = ft.partial(_outcome, design, rtol)
    return jax.lax.map(lambda member: jax.jvp(one, member[:1], member[1:]), (keywords, directions))


def _outcome(design: str, rtol: Scalar, keywords: dict[str, Scalar]) -> Outcome:
    solution = run(DESIGNS[design](**keywords), rtol, "end", energy=False)
    energy = solution.integrals["motor"][-1] + solution.integrals["coil"][-1]
    if design == "motor_held":
        return Outcome(energy, jnp.zeros(()), jnp.full((), jnp.inf))
    times = top_up_times(solution)
    count = jnp.sum(jnp.where(jnp.isfinite(times), 1.0, 0.0))
    return Outcome(energy, count, jnp.where(count > 1.0, times[1] - times[0], jnp.inf))


def top_up_times(solution: Solution) -> Array:
    """Times in s at which the motor runs again, in ascending order; infinite for each event of another kind."""
    return jnp.sort(solution.events.of_event("controller.on"))


def _powers(s: Any) -> dict[str, Scalar]:
    """Battery powers in W."""
    coil = -s.battery.v * s.battery.i if isinstance(s, ValveHeldActuator) else jnp.zeros(())
    return {"motor": -s.supply.v * s.supply.i, "coil": coil}
