"""Runs over the whole hold, and what the battery gives in them."""

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

DURATION = 60.0  # s, at a traffic light
DESIGNS: Mapping[str, Callable[..., Any]] = MappingProxyType({"motor_held": motor_held, "valve_held": valve_held})


class Outcome(eqx.Module):
    """What a hold comes to."""

    energy: Array  # J, from the battery
    top_ups: Array  # how often the motor had to run again
    period: Array  # s, from the first of them to the second; infinite where there are fewer


def run(
    model: MotorHeldActuator | ValveHeldActuator, rtol: Scalar = 1e-9, save: object = "steps", *, energy: bool = True
) -> Solution:
    """The clutch is opened and held for `DURATION`; the integrals are the energies in J of "motor" and "coil"."""
    return simulate(
        model, DURATION, save=save, energy=energy, integrals=_powers, rtol=rtol, max_steps=50_000, max_events=512
    )


def static_power(model: MotorHeldActuator, stroke: Scalar = STROKE) -> Scalar:
    """The power in W that holds the slave at `stroke` in m, in closed form: P = (R i + k w) i of the motor."""
    motor, i = model.motor, static_current(model, stroke)
    return (motor.resistor.R * i + motor.emf.k * _speed(model, stroke)) * i


def static_current(model: MotorHeldActuator, stroke: Scalar = STROKE) -> Scalar:
    """The current in A of the motor that holds, against the load and the bearing's friction: k i = D p + C w."""
    motor = model.motor
    friction = 0.0 if motor.bearing is None else motor.bearing.C
    return hold(model, stroke).current + friction * _speed(model, stroke) / motor.emf.k


def _speed(model: MotorHeldActuator, stroke: Scalar) -> Scalar:
    """The speed in rad/s with which the pump makes up for the leak: D w = p / R_leak."""
    return hold(model, stroke).pressure / (model.leak.resistance * model.pump.displacement)


@ft.partial(jax.jit, static_argnames="design")
def outcomes(
    design: str, keywords: dict[str, Scalar], directions: dict[str, Scalar], rtol: Scalar
) -> tuple[Outcome, Outcome]:
    """For each member of the arrays in `keywords`, what the hold comes to, and its derivative along `directions`.

    The members run one after the other, since under `vmap` each would take as many steps as the slowest.
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
    """When the motor had to run again, in s, in rising order; infinite for each event that is another one."""
    return jnp.sort(solution.events.of_event("controller.on"))


def _powers(s: Any) -> dict[str, Scalar]:
    """From the battery, in W."""
    coil = -s.battery.v * s.battery.i if isinstance(s, ValveHeldActuator) else jnp.zeros(())
    return {"motor": -s.supply.v * s.supply.i, "coil": coil}
