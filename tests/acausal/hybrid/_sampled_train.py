"""Sources and samplers on one grid of instants, and what they give by a discrete-event simulation in plain Python."""

import math
from typing import Any, NamedTuple, Self

import jax.numpy as jnp
import numpy as np

from acausal import Component, Connections, Equations, Param, Scalar, Time, connect, eq
from components.blocks import FirstOrder, Input, Output, Pulse, SampledPI, SampleHold, Staircase, Step

N = 12  # instants in a run
K, TI, T = 0.6, 3.0, 5.0  # of the controller and its plant; times in intervals of the grid


class Gate(Component):
    """y = 1 from `start_time` on, by an equation that compares the time."""

    start_time: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(gate=eq(self.y.value, jnp.where(self.t < self.start_time, 0.0, 1.0)))


class Mix(Component):
    """A weighted sum, from which each of the signals can be read."""

    u: tuple[Input, ...]
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        total = sum((10.0**-i * u.value for i, u in enumerate(self.u)), jnp.asarray(0.0))
        return dict(sum=eq(self.y.value, total))


class Train(Component):
    """Four sources, three samplers in a row, and a sampled controller of a lag."""

    step: Step
    pulse: Pulse
    stair: Staircase
    gate: Gate
    first: SampleHold
    second: SampleHold
    third: SampleHold
    control: SampledPI
    plant: FirstOrder
    mix: Mix

    def connections(self) -> Connections:
        sources = self.step, self.pulse, self.stair, self.gate
        return (
            *(connect(source.y, u) for source, u in zip(sources, self.mix.u, strict=True)),
            connect(self.mix.y, self.first.u, self.control.u_s),
            connect(self.first.y, self.second.u),
            connect(self.second.y, self.third.u),
            connect(self.control.y, self.plant.u),
            connect(self.plant.y, self.control.u_m),
        )


class Instants(NamedTuple):
    """The numbers of a train in intervals of the grid, counted from its zero."""

    step: Any
    pulse: Any  # start, width, period
    stair: Any  # the instants between the three values
    gate: Any
    samplers: Any  # start and period of each of the three
    control: Any


def train(instants: Instants, h: Scalar) -> Train:
    """With intervals of h."""
    start, width, period = instants.pulse
    (s1, p1), (s2, p2), (s3, p3) = instants.samplers
    low, high = instants.stair
    return Train(
        step=Step(height=1.0, start_time=instants.step * h),
        pulse=Pulse(amplitude=1.0, period=period * h, width=width / period, start_time=start * h),
        stair=Staircase(
            times=jnp.stack([(low - 1000.0) * h, low * h, high * h, (high + 1000.0) * h]),
            values=jnp.array([0.0, 1.0, 3.0]),
        ),
        gate=Gate(start_time=instants.gate * h),
        first=SampleHold(period=p1 * h, start_time=s1 * h),
        second=SampleHold(period=p2 * h, start_time=s2 * h),
        third=SampleHold(period=p3 * h, start_time=s3 * h),
        control=SampledPI(period=h, start_time=instants.control * h, k=K, T=TI * h),
        plant=FirstOrder(T=T * h),
        mix=Mix(u=(Input(), Input(), Input(), Input())),
    )


def drawn(draw: np.random.Generator, begin: int) -> Instants:
    """Sources that jump before the run, at its start and in it; samplers begin in the run."""
    when = lambda: int(draw.integers(begin - 2, begin + N - 2))  # noqa: E731
    low, high = sorted(draw.choice(np.arange(begin - 2, begin + N), 2, replace=False).tolist())
    period = int(draw.integers(2, 6))
    samplers = [(int(begin + draw.integers(0, 3)), int(draw.integers(1, 4))) for _ in range(3)]
    pulse = (when(), int(draw.integers(1, period)), period)
    return Instants(when(), pulse, (low, high), when(), samplers, int(begin + draw.integers(0, 3)))


def source(instants: Instants, i: int) -> float:
    """The mixed signal from the instant i on."""
    start, width, period = instants.pulse
    step, gate = float(i >= instants.step), float(i >= instants.gate)
    pulse = float(i >= start and (i - start) % period < width)
    stair = [0.0, 1.0, 3.0][sum(i >= place for place in instants.stair)]
    return step + 0.1 * pulse + 0.01 * stair + 0.001 * gate


def held(instants: Instants, begin: int) -> np.ndarray:
    """The values that the three samplers and the controller hold after each instant, shape [4, N].

    All that are due at an instant read together: what the sources give after it, and what other samplers gave before.
    """
    samples, y, x, integral, rows = [0.0, 0.0, 0.0], 0.0, 0.0, 0.0, []
    for i in range(begin, begin + N):
        inputs = [source(instants, i), *samples[:2]]
        due = [i >= start and (i - start) % period == 0 for start, period in instants.samplers]
        samples = [new if is_due else old for new, is_due, old in zip(inputs, due, samples, strict=True)]
        if i >= instants.control:
            error = inputs[0] - x
            integral += error / TI
            y = K * (error + integral)
        x = y + (x - y) * math.exp(-1.0 / T)
        rows.append([*samples, y])
    return np.array(rows).T
