"""Freewheels between inertias, and what they do by hand: pieces of closed-form motion between changes of the mode."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from acausal import Component, Connections, connect
from components.blocks import Pulse, Sine
from components.rotational import Inertia, OneWayClutch, SignalTorque

MU, FN_MAX, PEAK = 0.5, 3.0, 25.0
AMPLITUDE, FREQUENCY = 10.0, 3.0
START, WIDTH, PERIOD = 0.3, 0.5, 1.3


class Driven(Component):
    """`OneWayClutch` of the Modelica Standard Library: a torque on an inertia that a freewheel joins to another one."""

    sine: Sine
    press: Pulse
    torque: SignalTorque
    first: Inertia
    clutch: OneWayClutch
    second: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.torque.u),
            connect(self.torque.flange, self.first.a),
            connect(self.first.b, self.clutch.a),
            connect(self.clutch.b, self.second.a),
            connect(self.press.y, self.clutch.u),
        )


def driven(w1: Any, w2: Any, phase: Any, pressed: Any, start: Any) -> Driven:
    """With the speeds w1 and w2 at the start."""
    return Driven(
        sine=Sine(amplitude=AMPLITUDE, frequency=FREQUENCY, phase=phase),
        press=Pulse(amplitude=pressed, width=WIDTH, period=PERIOD, start_time=start),
        torque=SignalTorque(),
        first=Inertia(J=1.0, w=w1),
        clutch=OneWayClutch(mu=MU, fn_max=FN_MAX, peak=PEAK, w=w2 - w1),
        second=Inertia(J=1.0),
    )


def by_hand(numbers: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Both speeds at the times, shape [2, n]; `numbers` are the arguments of `driven`.

    Sliding, w2 > w1, the friction mu fn drives the first and brakes the second inertia. Locked, both have half of the
    torque each; the clutch holds any positive one, and a negative one up to the static level, which is zero where it is
    not pressed.
    """
    w1, w2, phase, pressed, start = numbers.tolist()
    turns = start + PERIOD * (np.arange(10)[:, None] + np.array([0.0, WIDTH])).ravel()
    ends = [0.0, *turns[(turns > 0.0) & (turns < times[-1])], times[-1]]
    found, state, is_locked = np.empty((2, len(times))), np.array([w1, w2]), w1 == w2
    for begin, end in pairwise(ends):
        is_pressed = begin >= start and (begin - start + 1e-9) % PERIOD < WIDTH * PERIOD
        friction = MU * FN_MAX * pressed * is_pressed
        t = begin
        while t < end:
            is_locked = is_locked and not _breaks(t, phase, friction)
            part = _moved(t, end, state, phase, friction, is_locked)
            here = (times >= t) & (times <= part.t[-1])
            if here.any():
                found[:, here] = part.sol(times[here])
            t, state = part.t[-1], part.y[:, -1]
            if part.status == 1 and not is_locked:
                is_locked, state = True, np.full(2, state.mean())
    return found


def _half(t: float, phase: float) -> float:
    """Half of the torque."""
    return 0.5 * AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * t + phase)


def _breaks(t: float, phase: float, friction: float) -> bool:
    """Whether a locked clutch slides from now on."""
    return min(_half(t, phase), _half(t + 1e-6, phase)) + PEAK * friction < 0.0 and (
        _half(t, phase) + PEAK * friction < 1e-9
    )


def _moved(t: float, end: float, state: np.ndarray, phase: float, friction: float, is_locked: bool) -> Any:
    """Up to the next change of the mode."""

    def rates(t: float, w: np.ndarray) -> list[float]:
        half = _half(t, phase)
        return [half, half] if is_locked else [2.0 * half + friction, -friction]

    def margin(t: float, w: np.ndarray) -> float:
        return _half(t, phase) + PEAK * friction if is_locked else w[1] - w[0]

    margin.terminal, margin.direction = True, -1.0  # type: ignore[attr-defined]
    options: dict[str, Any] = dict(dense_output=True, rtol=1e-11, atol=1e-12, max_step=0.02)
    return solve_ivp(rates, (t, end), state, "DOP853", events=margin, **options)
