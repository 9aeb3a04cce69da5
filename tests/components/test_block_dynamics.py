"""Linear dynamics against responses in closed form."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from acausal import Component, Connections, Scalar, Solution, connect, simulate
from components import blocks

TIMES = np.linspace(0.0, 2.0, 11)
T, K, W, D = 0.4, 1.5, 3.0, 0.2
A, B = [0.5, 1.4, 2.6, 1.2], [0.3, 0.1, 0.9]


class Responses(Component):
    """Blocks in parallel on one signal."""

    source: blocks.Constant | blocks.Sine
    integrator: blocks.Integrator
    derivative: blocks.Derivative
    first: blocks.FirstOrder
    second: blocks.SecondOrder
    transfer: blocks.TransferFunction
    proper: blocks.TransferFunction
    lead: blocks.TransferFunction
    state_space: blocks.StateSpace

    def connections(self) -> Connections:
        return (
            connect(
                self.source.y,
                self.integrator.u,
                self.derivative.u,
                self.first.u,
                self.second.u,
                self.transfer.u,
                self.proper.u,
                self.lead.u,
                self.state_space.u[0],
            ),
            connect(self.first.y, self.state_space.u[1]),
        )


def responses(source: blocks.Constant | blocks.Sine) -> Responses:
    return Responses(
        source=source,
        integrator=blocks.Integrator(k=K, x=0.7),
        derivative=blocks.Derivative(k=K, T=T),
        first=blocks.FirstOrder(k=K, T=T),
        second=blocks.SecondOrder(k=K, w=W, D=D),
        transfer=blocks.TransferFunction(b=B, a=A),
        proper=blocks.TransferFunction(b=[2.0, 1.0], a=[0.5, 0.0]),
        lead=blocks.TransferFunction(b=[2.0, 1.0], a=[0.5, 0.8]),
        state_space=blocks.StateSpace(
            A=jnp.array([[-1.0, 2.0], [-2.0, -0.5]]),
            B=jnp.array([[1.0, 0.0], [0.5, -1.0]]),
            C=jnp.array([[1.0, 0.0], [0.5, 2.0]]),
            D=jnp.array([[0.0, 0.3], [0.2, 0.0]]),
        ),
    )


@pytest.fixture(scope="module")
def step() -> Solution:
    return simulate(responses(blocks.Constant(k=2.0)), 2.0, save=jnp.asarray(TIMES), rtol=1e-10)


def test_step_responses(step: Solution) -> None:
    """Blocks of first and second order, with a step of 2."""
    decay = np.exp(-TIMES / T)
    np.testing.assert_allclose(step["integrator.y.value"], 0.7 + 2.0 * K * TIMES, atol=1e-9)
    np.testing.assert_allclose(step["derivative.y.value"], 2.0 * K / T * decay, atol=1e-8)
    np.testing.assert_allclose(step["first.y.value"], 2.0 * K * (1.0 - decay), atol=1e-9)
    root = np.sqrt(1.0 - D**2)
    swing = np.cos(W * root * TIMES) + D / root * np.sin(W * root * TIMES)
    np.testing.assert_allclose(step["second.y.value"], 2.0 * K * (1.0 - np.exp(-D * W * TIMES) * swing), atol=1e-8)
    np.testing.assert_allclose(step["proper.y.value"], 2.0 * (4.0 + 2.0 * TIMES), atol=1e-8)
    np.testing.assert_allclose(step["lead.y.value"], 2.0 * (1.25 + 2.75 * np.exp(-1.6 * TIMES)), atol=1e-8)


def test_transfer_function(step: Solution) -> None:
    _, y = signal.step(signal.TransferFunction(B, A), T=TIMES)
    np.testing.assert_allclose(step["transfer.y.value"], 2.0 * y, atol=1e-8)


def test_state_space(step: Solution) -> None:
    """With the first-order block at its second input as a further state of one large system."""
    model = responses(blocks.Constant(k=2.0)).state_space
    a, b, c, d = (np.asarray(matrix) for matrix in (model.A, model.B, model.C, model.D))
    whole_a = np.block([[a, b[:, 1:]], [np.zeros((1, 2)), np.array([[-1.0 / T]])]])
    whole_b = np.vstack([b[:, :1], [[K / T]]])
    system = signal.StateSpace(whole_a, whole_b, np.hstack([c, d[:, 1:]]), d[:, :1])
    _, y, _ = signal.lsim(system, np.full_like(TIMES, 2.0), TIMES)
    np.testing.assert_allclose(step["state_space.y[0].value"], y[:, 0], atol=1e-8)
    np.testing.assert_allclose(step["state_space.y[1].value"], y[:, 1], atol=1e-8)


@pytest.mark.thorough
def test_frequency_response() -> None:
    """The stationary oscillation has the gain and phase of the transfer function at s = i w."""
    f, times = 0.8, np.linspace(28.0, 30.0, 9)
    model = responses(blocks.Sine(amplitude=1.0, frequency=f))
    sol = simulate(model, 30.0, save=jnp.asarray(times), rtol=1e-9)
    s = 2j * np.pi * f
    expected = {
        "derivative": K * s / (1.0 + T * s),
        "first": K / (1.0 + T * s),
        "second": K * W**2 / (s**2 + 2.0 * D * W * s + W**2),
        "transfer": np.polyval(B, s) / np.polyval(A, s),
    }
    for name, gain in expected.items():
        np.testing.assert_allclose(sol[f"{name}.y.value"], np.imag(gain * np.exp(s * times)), atol=1e-6)


@pytest.mark.thorough
def test_gradient_with_respect_to_coefficients() -> None:
    """Forward and reverse mode agree with the derivative of the closed form y = b / a0 (1 - exp(-a0 t / a1))."""

    class Lag(Component):
        source: blocks.Constant
        lag: blocks.TransferFunction

        def connections(self) -> Connections:
            return (connect(self.source.y, self.lag.u),)

    def at_one(coefficients: jax.Array) -> Scalar:
        a1, a0, b = coefficients
        lag = blocks.TransferFunction(b=jnp.stack([b]), a=jnp.stack([a1, a0]))
        return simulate(Lag(source=blocks.Constant(k=1.0), lag=lag), 1.0, save="end", rtol=1e-10).final.lag.y.value

    values = jnp.array([0.5, 2.0, 3.0])
    exact = jax.grad(lambda c: c[2] / c[1] * (1.0 - jnp.exp(-c[1] / c[0])))(values)
    np.testing.assert_allclose(jax.jacfwd(at_one)(values), exact, rtol=1e-7)
    np.testing.assert_allclose(eqx.filter_jit(jax.grad(at_one))(values), exact, rtol=1e-7)


@pytest.mark.thorough
def test_slew_rate_limiter() -> None:
    """Rises at its bound, then falls in with the step as a lag: u - y = rising Td exp(-(t - t') / Td)."""

    class Slewed(Component):
        source: blocks.Constant
        limiter: blocks.SlewRateLimiter

        def connections(self) -> Connections:
            return (connect(self.source.y, self.limiter.u),)

    def reach(u: float) -> Solution:
        limiter = blocks.SlewRateLimiter(rising=2.0, falling=0.5, Td=0.05)
        model = Slewed(source=blocks.Constant(k=u), limiter=limiter)
        return simulate(model, 1.0, save=jnp.asarray([0.2, 0.4, 0.5, 0.6]), rtol=1e-9)

    rest = 2.0 * 0.05 * np.exp(-(np.array([0.5, 0.6]) - 0.45) / 0.05)
    np.testing.assert_allclose(reach(1.0)["limiter.y.value"], [0.4, 0.8, *(1.0 - rest)], atol=1e-6)
    np.testing.assert_allclose(reach(-1.0)["limiter.y.value"], [-0.1, -0.2, -0.25, -0.3], atol=1e-8)
