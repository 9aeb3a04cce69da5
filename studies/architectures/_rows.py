"""Results of an architecture: one row of the table."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from acausal import Component, Scalar, Solution, parameters, replace

from ..actuators import STROKE, SUPPLY
from ._architecture import Architecture
from ._conditions import conditions_of
from ._duty import CLOSING, HOLD, half_open_by_profile, open_clutch, whole_duty


@dataclasses.dataclass(frozen=True)
class Row:
    """Results of an architecture on the duty, in SI units.

    Currents are motor currents, except `battery_current`; the converter between battery and motor is lossless. The peak
    current is that of the opening, where both currents are equal at full voltage. `motor_current` is that at the end of
    the hold; `battery_current` and `holding_power` are means over the hold. Energies are battery energies.

    `losses` by component, `stored` and `compression` are totals over the whole duty. `compression` is the energy that
    the account books as supplied in addition to the battery: the integral of e dV over the volume that a cylinder takes
    in, with the energy density e of a `LinearLiquid`. `gradients` are the derivatives of the opening time by the path
    of a size; `modes` is the largest difference between forward and reverse mode, relative to the largest gradient.
    `lowest` and `highest` bound the position from a second after the opening to the end of the hold. `flows` are
    pressure and flow of the source and of the clutch: at half the stroke during the opening at full speed and, metered,
    along a profile, and in the hold. `conditions` holds some of these figures for the duty with the no-load set, cold,
    hot and worn.
    """

    architecture: str
    opening_time: float
    peak_current: float
    motor_current: float
    battery_current: float
    holding_power: float
    energy: float
    energies: Mapping[str, float]  # of opening, holding, closing
    losses: Mapping[str, float]
    stored: float
    compression: float
    mass: float
    imbalance: float  # of the energy account, relative to the supplied energy
    gradients: Mapping[str, float]
    modes: float
    lowest: float
    highest: float
    closed: float  # position at the end
    flows: Mapping[str, Mapping[str, float]]
    conditions: Mapping[str, Mapping[str, float]]


def row_of(architecture: Architecture, rtol: float, *, differentiated: bool = True) -> Row:
    """Simulate an architecture and, by default, differentiate its opening time."""
    model = architecture.build()
    opened, duty = _done(architecture.name, model, rtol)
    energies = _energies(duty, opened)
    gradients, modes = gradients_of(architecture, model, rtol) if differentiated else ({}, 0.0)
    losses = {path: float(lost) for path, lost in duty.energy.dissipated.items() if lost != 0.0}
    supplied, stored, _ = (float(total) for total in duty.energy.totals)
    position, held = np.asarray(duty.piston.a.s), _during(duty, opened + 1.0, opened + HOLD)
    return Row(
        architecture=architecture.name,
        opening_time=opened,
        peak_current=float(np.max(np.abs(np.asarray(duty.supply.i)[_during(duty, 0.0, opened)]))),
        motor_current=float(np.interp(opened + HOLD, np.asarray(duty.ts), -np.asarray(duty.supply.i))),
        battery_current=_holding_power(duty, opened) / SUPPLY,
        holding_power=_holding_power(duty, opened),
        energy=sum(energies.values()),
        energies=energies,
        losses=losses,
        stored=stored,
        compression=supplied - sum(energies.values()),
        mass=sum(architecture.masses.values()),
        imbalance=abs(float(duty.energy.imbalance)) / supplied,
        gradients=gradients,
        modes=modes,
        lowest=float(position[held].min()),
        highest=float(position[held].max()),
        closed=float(position[-1]),
        flows={
            "opening": _flows(architecture, duty, np.interp(0.5 * STROKE, *_rising(duty, opened))),
            "metered": _flows(architecture, half_open_by_profile(model, rtol=rtol), None),
            "holding": _flows(architecture, duty, opened + HOLD),
        },
        conditions={name: _figures(architecture.name, other, rtol) for name, other in conditions_of(model).items()},
    )


def _done(name: str, model: Component, rtol: float) -> tuple[float, Solution]:
    """The opening time and the run of the whole duty."""
    opening = open_clutch(model, rtol=rtol)
    opened = float(opening.t1)
    if not np.isfinite(opened):
        raise ValueError(f"{name} does not open the clutch: {opening.result}")
    return opened, whole_duty(model, opened, rtol=rtol)


def _figures(name: str, model: Component, rtol: float) -> dict[str, float]:
    """The figures that are compared under other conditions."""
    opened, duty = _done(name, model, rtol)
    if duty.ts[-1] < opened + HOLD + CLOSING:
        # The run failed before the end, so its energies are not those of the duty.
        return {"opening_time": opened}
    return {
        "opening_time": opened,
        "battery_current": _holding_power(duty, opened) / SUPPLY,
        "holding_power": _holding_power(duty, opened),
        "energy": sum(_energies(duty, opened).values()),
        "closed": float(duty.final.piston.a.s),
    }


def opening_time_of(architecture: Architecture, model: Component, rtol: float) -> Callable[[Array], Scalar]:
    """The opening time as a function of the main sizes, in the order of `architecture.sizes`."""

    def time(values: Array) -> Scalar:
        changed = replace(model, dict(zip(architecture.sizes, values, strict=True)))
        return open_clutch(architecture.start(changed), rtol=rtol, save="end", account=False).t1

    return time


def sizes_of(architecture: Architecture, model: Component) -> Array:
    """The main sizes in SI units."""
    values = parameters(model)
    return jnp.asarray([values[path] for path in architecture.sizes])


def gradients_of(architecture: Architecture, model: Component, rtol: float) -> tuple[dict[str, float], float]:
    """The derivatives of the opening time by the main sizes, and the relative difference between both modes."""
    time, sizes = opening_time_of(architecture, model, rtol), sizes_of(architecture, model)
    forward, reverse = map(np.asarray, jax.jit(ft.partial(_both_modes, time))(sizes))
    scaled = np.asarray(sizes) * np.stack([forward, reverse])
    modes = float(np.max(np.abs(scaled[0] - scaled[1])) / np.max(np.abs(scaled)))
    return dict(zip(architecture.sizes, forward.tolist(), strict=True)), modes


def _both_modes(time: Callable[[Array], Scalar], sizes: Array) -> tuple[Array, Array]:
    """The derivatives in forward and in reverse mode, from one linearised run."""
    moment, push = jax.linearize(time, sizes)
    (pulled,) = jax.linear_transpose(push, sizes)(jnp.ones_like(moment))
    return jax.vmap(push)(jnp.eye(len(sizes))), pulled


def _energies(duty: Solution, opened: float) -> dict[str, float]:
    marks = [_integral(duty, time) for time in (0.0, opened, opened + HOLD, np.inf)]
    return dict(zip(("opening", "holding", "closing"), np.diff(marks).tolist(), strict=True))


def _integral(duty: Solution, time: float) -> float:
    """Battery energy in J until a time."""
    return float(np.interp(time, np.asarray(duty.ts), np.asarray(duty.integrals["energy"])))


def _holding_power(duty: Solution, opened: float) -> float:
    """Mean power in W over the hold."""
    return (_integral(duty, opened + HOLD) - _integral(duty, opened)) / HOLD


def _during(duty: Solution, begin: float, end: float) -> np.ndarray:
    """Mask of the saved times in an interval."""
    times = np.asarray(duty.ts)
    return (times >= begin) & (times <= end)


def _rising(duty: Solution, opened: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and times of the opening."""
    chosen = _during(duty, 0.0, opened)
    return np.asarray(duty.piston.a.s)[chosen], np.asarray(duty.ts)[chosen]


def _flows(architecture: Architecture, solution: Solution, time: float | None) -> dict[str, float]:
    """Pressure and flow of source and clutch at a time, or at the end."""
    seen = solution if time is not None else solution.final
    signals = [np.asarray(signal) for signal in (*architecture.delivered(seen), *architecture.taken(seen))]
    if time is not None:
        signals = [np.interp(time, np.asarray(solution.ts), signal) for signal in signals]
    return dict(zip(("source_p", "source_q", "clutch_p", "clutch_q"), map(float, signals), strict=True))
