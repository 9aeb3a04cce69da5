"""Events that are scheduled for the present instant, or for an earlier one, happen at once."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Time,
    Var,
    at,
    connect,
    eq,
    simulate,
)
from components.blocks import PWM, Integrator, Sine
from components.electrical import ConstantVoltage, Ground, HBridge, Inductor

END = 2.0


class Chain(Component):
    """At `first`, an event schedules a second one, which schedules a third one; x grows from each on."""

    first: Param[Scalar, "s"]
    lag_2: Param[Scalar, "s"]  # how long before the first event the second one is due
    lag_3: Param[Scalar, "s"]  # how long before the second event the third one is due
    t: Time[Scalar, "s"] = 0.0
    due_2: Discrete[Scalar, "s"] = jnp.inf
    due_3: Discrete[Scalar, "s"] = jnp.inf
    n: Discrete[Scalar, "1"] = 0.0
    n_2: Discrete[Scalar, "1"] = 0.0
    n_3: Discrete[Scalar, "1"] = 0.0
    x: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.n + 10.0 * self.n_2 + 100.0 * self.n_3))

    def events(self) -> Events:
        return dict(
            third=at(self.due_3, n_3=self.n_3 + 1.0),
            second=at(self.due_2, n_2=self.n_2 + 1.0, due_3=self.t - self.lag_3),
            first=at(self.first, n=self.n + 1.0, due_2=self.t - self.lag_2),
        )


@jax.jit
@jax.vmap
def grown(first: Any, lag_2: Any, lag_3: Any) -> Any:
    return simulate(Chain(first=first, lag_2=lag_2, lag_3=lag_3), END, save="end", throw=False).final.x


@pytest.mark.thorough
def test_what_is_scheduled_for_later_happens_then() -> None:
    lags = np.array([[-0.3, -0.1], [-0.3, -5.0], [-1e-3, -1e-6], [-1e-9, -1e-9]])
    first = np.array([0.7, 0.7, 0.0, 1.0])
    on = END - first - np.array([[0.0, 0.3, 0.4], [0.0, 0.3, 5.3], [0.0, 1e-3, 0.001001], [0.0, 1e-9, 2e-9]]).T
    expected = np.array([1.0, 10.0, 100.0]) @ np.maximum(on, 0.0)
    found = grown(*np.tile([first, *lags.T], 2))
    np.testing.assert_allclose(found, np.tile(expected, 2), atol=1e-9)


def test_in_a_run_what_is_scheduled_for_now_or_earlier_happens_at_once() -> None:
    draw = np.random.default_rng(2)
    first = np.array([0.0, 0.0, *draw.uniform(0.1, 1.9, 6)])  # the first two at the start
    lags = draw.choice([0.0, 1e-17, 1e-12, 0.05, 100.0], (2, 8))
    np.testing.assert_allclose(grown(first, *lags), 111.0 * (END - first), rtol=1e-9)


class Switched(Component):
    """A signal into a pulse-width modulator with an integral behind it, and into a bridge with a coil behind it."""

    signal: Sine
    pwm: PWM
    integral: Integrator
    source: ConstantVoltage
    bridge: HBridge
    coil: Inductor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.signal.y, self.pwm.u, self.bridge.duty),
            connect(self.pwm.y, self.integral.u),
            connect(self.source.p, self.bridge.p1),
            connect(self.source.n, self.bridge.n1, self.bridge.n2, self.ground.p),
            connect(self.bridge.p2, self.coil.p),
            connect(self.coil.n, self.bridge.n2),
        )


PERIOD, PERIODS = 0.1, 10


@jax.jit
@jax.vmap
def means(offset: Any, amplitude: Any, frequency: Any) -> Any:
    """Means of the pulses and of the bridge's voltage over ten periods."""
    model = Switched(
        signal=Sine(offset=offset, amplitude=amplitude, frequency=frequency),
        pwm=PWM(period=PERIOD),
        integral=Integrator(),
        source=ConstantVoltage(V=1.0),
        bridge=HBridge(frequency=1.0 / PERIOD),
        coil=Inductor(L=1.0),
    )
    final = simulate(model, PERIODS * PERIOD, save="end", throw=False).final
    return jnp.stack([final.integral.x, final.coil.i]) / (PERIODS * PERIOD)


def sampled(offset: Any, amplitude: Any, frequency: Any) -> np.ndarray:
    """The mean of the duties at the beginnings of the periods."""
    t = PERIOD * np.arange(PERIODS)
    duties = offset[:, None] + amplitude[:, None] * np.sin(2.0 * np.pi * frequency[:, None] * t)
    return np.mean(np.clip(duties, -1.0, 1.0), axis=1)


def compared(offset: Any, amplitude: Any, frequency: Any) -> None:
    expected = sampled(offset, amplitude, frequency)
    found = means(offset, amplitude, frequency)
    np.testing.assert_allclose(found, np.stack([expected, expected], axis=1), atol=1e-9)


@pytest.mark.thorough
def test_duties_that_are_shares_of_a_period() -> None:
    """Also those that rounding cannot tell from a whole period."""
    offset = np.array([0.0, 1e-12, 1e-6, -1e-6, 0.3, 1.0 - 1e-12, 1.0 - 1e-16, 1.0, -1.0, 7.0])
    compared(offset, 0.0 * offset, 1.0 + 0.0 * offset)


def test_duties_below_rounding() -> None:
    """Constant ones, and those at the zeros of sines."""
    tiny = np.array([1e-17, 1e-16, 1e-15, -1e-17, -1e-16, 3e-17])
    frequency = np.array([5.0, 10.0, 2.5, 15.0])
    offset = np.concatenate([tiny, 0.0 * frequency])
    amplitude = np.concatenate([0.0 * tiny, 0.9 + 0.0 * frequency])
    compared(offset, amplitude, np.concatenate([0.0 * tiny + 1.0, frequency]))
