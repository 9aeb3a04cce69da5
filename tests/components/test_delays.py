"""Delays: closed forms of a sine, of a loop at its stability limit and of plug flow."""

import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.special import factorial, lambertw

from acausal import Connections, ParameterError, Scalar, SimulationError, connect, linearise, simulate
from components import blocks


def chain(*parts: Any) -> Connections:
    return tuple(connect(one.y, other.u) for one, other in itertools.pairwise(parts))


def with_rate(source: Any, delay: Any, rate: Any) -> Connections:
    return connect(source.y, delay.u), connect(rate.y, delay.rate)


def loop(gain: Any, integrator: Any, delay: Any) -> Connections:
    """dy/dt = -k y(t - T)."""
    return connect(gain.y, integrator.u), connect(integrator.y, delay.u), connect(delay.y, gain.u)


def response(n: int, w: float) -> complex:
    """Response of a delay of 1 s at the angular frequency w."""
    model = Rig(parts=(blocks.Constant(k=0.0), blocks.PadeDelay(T=1.0, n=n)), wiring=chain)
    found = linearise(model, inputs=["parts[0].k"], outputs=["parts[1].y.value"])
    return complex(np.ravel(found.frequency_response(jnp.array([w])))[0])


@pytest.mark.parametrize("n", [2, 5, 8])
def test_the_error_of_a_sine_is_that_of_the_pade_approximation(n: int) -> None:
    """The leading term of the error of the order [n-1/n] is (n-1)! n! / ((2n-1)! (2n)!) s^(2n)."""
    w = 0.25 * n
    bound = factorial(n - 1) * factorial(n) / (factorial(2 * n - 1) * factorial(2 * n)) * w ** (2 * n)
    error = abs(response(n, w) - np.exp(-1j * w))
    assert 0.5 * bound < error < 2.0 * bound


def test_an_integrator_with_a_delay_is_stable_up_to_half_pi() -> None:
    """The poles of dy/dt = -k y(t - T) are W(-k T)/T with the branches of Lambert's function."""
    for kT in (np.exp(-1.0) * 0.9, 1.0, 0.5 * np.pi):
        parts = (blocks.Gain(k=-kT / 0.2), blocks.Integrator(), blocks.PadeDelay(T=0.2))
        poles = np.asarray(linearise(Rig(parts=parts, wiring=loop)).poles)
        for branch in (0, -1):
            assert np.min(np.abs(poles - lambertw(-kT, branch) / 0.2)) < 1e-7 / 0.2
    assert np.max(np.real(poles)) == pytest.approx(0.0, abs=1e-8 / 0.2)


@pytest.mark.thorough
def test_a_loop_with_a_delay_and_its_derivative_by_the_delay() -> None:
    """dy/dt = -k y(t - T) with y = 1 up to the start: y(t) = 1 - k t, then 1 - k t + k^2 (t - T)^2/2, ..."""
    n, k = 16, 2.0

    def end(T: Scalar) -> Scalar:
        line = blocks.PadeDelay(T=T, n=n, x=np.eye(n)[0])
        parts = (blocks.Gain(k=-k), blocks.Integrator(x=1.0), line)
        return simulate(Rig(parts=parts, wiring=loop), 1.9, rtol=1e-9, save="end").final.parts[1].x

    def exact(T: float) -> float:
        return sum((-k * (1.9 - (i - 1) * T)) ** i / factorial(i) * ((i - 1) * T < 1.9) for i in range(6))

    value, slope = jax.value_and_grad(end)(0.5)
    assert value == pytest.approx(exact(0.5), abs=2e-6)
    assert slope == pytest.approx((exact(0.5001) - exact(0.4999)) / 2e-4, abs=2e-5)


@pytest.mark.thorough
def test_what_leaves_a_line_entered_it_when_the_transport_began() -> None:
    """At the rate 1 + t, the delay T obeys T (1 + t) - T^2/2 = 1."""
    parts = (blocks.Sine(amplitude=1.0, frequency=0.4), blocks.TransportDelay(n=12), blocks.Clock(offset=1.0))
    t = np.array([1.7, 2.1, 2.5])
    solution = simulate(Rig(parts=parts, wiring=with_rate), 2.5, save=jnp.asarray(t), rtol=1e-9)
    T = (1.0 + t) - np.sqrt((1.0 + t) ** 2 - 2.0)
    np.testing.assert_allclose(solution.parts[1].y.value, np.sin(0.8 * np.pi * (t - T)), atol=1e-6)


@pytest.mark.thorough
def test_a_line_does_not_run_backwards() -> None:
    parts = (blocks.Constant(k=1.0), blocks.TransportDelay(n=2), blocks.Ramp(height=-2.0, offset=1.0, duration=1.0))
    with pytest.raises(SimulationError, match="the rate of a TransportDelay must not be negative"):
        simulate(Rig(parts=parts, wiring=with_rate), 1.0)


def test_a_delay_needs_a_state() -> None:
    with pytest.raises(ParameterError, match=r"PadeDelay\.n must be 1 or more"):
        blocks.PadeDelay(T=1.0, n=0)
