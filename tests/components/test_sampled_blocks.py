"""Sampled controllers, delays, averages and noise, compared with recursions over their samples."""

import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy import signal, stats

from acausal import Connections, ParameterError, Scalar, connect, linearise, replace, simulate
from acausal._declare.layout import complete
from components import blocks

H = 0.1


def wire(setpoint: Any, measured: Any, p: Any, pid: Any, delay: Any, average: Any) -> Connections:
    return (
        connect(setpoint.y, p.u_s, pid.u_s),
        connect(measured.y, p.u_m, pid.u_m, delay.u, average.u),
    )


def recursion(s: np.ndarray, m: np.ndarray) -> list[float]:
    """Outputs of the PID controller of the test, by its difference equations."""
    k, Ti, Td, wp, wd, Nd = 1.2, 0.5, 0.2, 0.7, 0.3, 5.0
    x, rate, before, found = 0.0, 0.0, None, []
    for u_s, u_m in zip(s, m, strict=True):
        e = wd * u_s - u_m
        rate = (Td * rate + Nd * Td * (0.0 if before is None else e - before)) / (Td + Nd * H)
        before = e
        new = x + (u_s - u_m) * H / Ti
        wanted = k * (wp * u_s - u_m + new + rate)
        limited = np.clip(wanted, -1.0, 1.0)
        if (wanted - limited) * (u_s - u_m) <= 0.0:
            x = new
        found.append(limited)
    return found


def test_sampled_blocks_follow_their_recursions() -> None:
    parts = (
        blocks.Constant(k=0.8),
        blocks.Sine(amplitude=0.9, frequency=0.7, phase=0.3),
        blocks.SampledP(period=H, k=2.0, y_max=0.7),
        blocks.SampledPID(period=H, k=1.2, Ti=0.5, Td=0.2, wp=0.7, wd=0.3, Nd=5.0, y_min=-1.0, y_max=1.0),
        blocks.SampledDelay(period=H, n=3),
        blocks.MovingAverage(period=H, n=4),
    )
    grid = np.arange(20) * H
    solution = simulate(Rig(parts=parts, wiring=wire), 1.96, save=jnp.asarray(grid + 0.05))
    m = 0.9 * np.sin(1.4 * np.pi * grid + 0.3)
    outputs = recursion(np.full(20, 0.8), m)
    assert max(outputs) == 1.0
    assert min(outputs) > -1.0
    means = [np.mean(m[max(0, i - 3) : i + 1]) for i in range(20)]
    np.testing.assert_allclose(solution.parts[2].y.value, np.minimum(2.0 * (0.8 - m), 0.7), atol=1e-9)
    np.testing.assert_allclose(solution.parts[3].y.value, outputs, atol=1e-9)
    np.testing.assert_allclose(solution.parts[4].y.value, [0.0] * 3 + list(m[:-3]), atol=1e-9)
    np.testing.assert_allclose(solution.parts[5].y.value, means, atol=1e-9)


def chained(zero: Any, source: Any, *rest: Any) -> Connections:
    """Blocks one behind the other, and a loop of the last two, an adder and a delay."""
    *chain, adder, accumulating = rest
    return (
        *(connect(a.y, b.u_s if hasattr(b, "u_s") else b.u) for a, b in itertools.pairwise([source, *chain])),
        *(connect(zero.y, block.u_m) for block in chain if hasattr(block, "u_m")),
        connect(chain[-1].y, adder.u1),
        connect(accumulating.y, adder.u2),
        connect(adder.y, accumulating.u),
    )


def outputs_of(block: Any, u: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The outputs of a sampled block for its inputs just before the samples, and just after them."""
    n, m = len(u), np.zeros(len(u))
    match block:
        case blocks.SampledDelay():
            return np.concatenate([np.zeros(block.n), after])[:n]
        case blocks.MovingAverage():
            return np.array([np.mean(u[max(0, i + 1 - block.n) : i + 1]) for i in range(n)])
        case blocks.SampledP():
            return float(block.k) * u
        case blocks.SampledPI():
            return float(block.k) * (u + np.cumsum(u) * H / float(block.T))
        case blocks.SampledPID():
            return np.array(recursion(u, m))
    return u


KINDS = (
    blocks.SampleHold(period=H),
    blocks.SampledDelay(period=H),
    blocks.SampledDelay(period=H, n=3),
    blocks.MovingAverage(period=H, n=2),
    blocks.SampledP(period=H, k=-0.7),
    blocks.SampledPI(period=H, k=0.4, T=0.3),
    blocks.SampledPID(period=H, k=1.2, Ti=0.5, Td=0.2, wp=0.7, wd=0.3, Nd=5.0, y_min=-1.0, y_max=1.0),
)


@pytest.mark.parametrize(
    ("seed", "start"),
    [
        pytest.param(0, 0.0),
        *(pytest.param(*case, marks=pytest.mark.thorough) for case in [(1, 0.0), (2, 0.03), (3, 0.0), (4, 0.03)]),
    ],
)
def test_sampled_blocks_in_series_on_one_clock_follow_their_recursions(seed: int, start: float) -> None:
    """A sampled block reads its input just before the instant, as Modelica's `pre`; a delay by n periods adds n."""
    random = np.random.default_rng(seed)
    order = [0, 1, 1, 6] if seed == 0 else list(random.permutation(len(KINDS)))
    chain = [replace(KINDS[i], {"start_time": start}) for i in order]
    accumulating = blocks.SampledDelay(period=H, start_time=start)
    source = blocks.Sine(amplitude=0.9, frequency=0.7, phase=0.3)
    parts = (blocks.Constant(k=0.0), source, *chain, blocks.Sum(), accumulating)
    n = 16
    grid = start + np.arange(n) * H
    solution = simulate(Rig(parts=parts, wiring=chained), grid[-1] + 0.06, save=jnp.asarray(grid + 0.05))
    u = after = 0.9 * np.sin(1.4 * np.pi * grid + 0.3)
    for i, block in enumerate(chain, start=2):
        y = outputs_of(block, u, after)
        np.testing.assert_allclose(solution.parts[i].y.value, y, atol=1e-9, err_msg=f"{order}, part {i}")
        u, after = np.concatenate([[0.0], y[:-1]]), y
    sums = np.concatenate([[0.0], np.cumsum(after)[:-1]])
    np.testing.assert_allclose(solution.parts[-1].y.value, sums, atol=1e-9)


def sequence(noise: blocks.NormalNoise | blocks.UniformNoise, count: int) -> np.ndarray:
    """The first numbers of a noise."""

    def sample(state: Any, _: None) -> tuple[Any, Any]:
        event: Any = complete(replace(noise, state)).events()["sample"]
        changes = event.changes
        return {"begun": changes["begun"] + 0.0 * changes["held"], "states": changes["states"]}, changes["held"]

    start = {"begun": jnp.zeros(()), "states": jnp.ones(2)}
    return np.asarray(jax.jit(lambda: jax.lax.scan(sample, start, length=count)[1])())


def test_random_numbers_have_their_distribution_and_are_independent() -> None:
    uniform = sequence(blocks.UniformNoise(period=H, y_min=-1.0, y_max=3.0), 20000)
    normal = sequence(blocks.NormalNoise(period=H, sigma=0.5, mu=2.0), 20000)
    assert stats.kstest(uniform, stats.uniform(-1.0, 4.0).cdf).pvalue > 0.01
    assert stats.kstest(normal, stats.norm(2.0, 0.5).cdf).pvalue > 0.01
    deviation = normal - np.mean(normal)
    for lag in (1, 2, 5):
        assert abs(np.mean(deviation[lag:] * deviation[:-lag])) < 0.25 * 4.0 / np.sqrt(20000)
    other = sequence(blocks.NormalNoise(period=H, sigma=0.5, mu=2.0, seed=1), 20000)
    assert abs(np.corrcoef(normal, other)[0, 1]) < 4.0 / np.sqrt(20000)


def test_the_generator_is_that_of_l_ecuyer() -> None:
    """Figure 3 of CACM 31 (1988), from the start states that numpy's SeedSequence gives for the seed."""
    one, other = map(int, np.random.SeedSequence(7).generate_state(2))
    s1, s2 = one % 2147483562 + 1, other % 2147483398 + 1
    expected = []
    for _ in range(50):
        s1, s2 = 40014 * s1 % 2147483563, 40692 * s2 % 2147483399
        expected.append(((s1 - s2) % 2147483562 + 0.5) / 2147483563)
    found = sequence(blocks.UniformNoise(period=H, y_min=0.0, y_max=1.0, seed=7), 50)
    np.testing.assert_allclose(found, expected, rtol=1e-15)


@pytest.mark.thorough
def test_band_limited_noise_has_its_spectrum_and_is_proportional_to_sigma() -> None:
    def course(sigma: Scalar) -> Any:
        noise = blocks.BandLimitedNoise(sigma=sigma, f_min=2.0, f_max=6.0, mu=0.5)
        times = jnp.linspace(0.0, 100.0, 5001)

        def value(t: Scalar) -> Any:
            here = complete(replace(noise, {"t": t, "y.value": 0.0}))
            return -here.equations(here)["noise"].residual

        return jax.vmap(value)(times)

    y, slope = jax.jvp(course, (2.0,), (1.0,))
    np.testing.assert_allclose(y, 0.5 + 2.0 * slope, atol=1e-9)
    assert np.std(y) == pytest.approx(2.0, rel=0.02)
    f, density = signal.welch(np.asarray(y) - 0.5, fs=50.0, nperseg=500)
    inside, outside = (f > 2.4) & (f < 5.6), ((f > 0.5) & (f < 1.2)) | (f > 6.8)
    assert np.mean(density[inside]) == pytest.approx(4.0 / 4.0, rel=0.1)
    assert np.max(density[outside]) < 1e-3


def filters(source: Any, lead: Any, notch: Any) -> Connections:
    return (connect(source.y, lead.u, notch.u),)


def test_filters_have_their_transfer_functions() -> None:
    parts = (blocks.Constant(k=1.0), blocks.LeadLag(T1=0.5, T2=0.02, k=3.0), blocks.Notch(w=7.0, D=0.3, depth=0.1))
    model = Rig(parts=parts, wiring=filters)
    system = linearise(model, inputs=["parts[0].k"], outputs=["parts[1].y.value", "parts[2].y.value"])
    w = np.array([0.5, 7.0, 10.0, 400.0])
    s, found = 1j * w, np.asarray(system.frequency_response(w))[:, :, 0]
    np.testing.assert_allclose(found[:, 0], 3.0 * (1.0 + 0.5 * s) / (1.0 + 0.02 * s), rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], (s**2 + 0.42 * s + 49.0) / (s**2 + 4.2 * s + 49.0), rtol=1e-12)
    most = np.angle((1.0 + 0.5 * 10j) / (1.0 + 0.02 * 10j))
    assert most == pytest.approx(np.arcsin(24.0 / 26.0))  # as the docstring of LeadLag says, at 1/sqrt(T1 T2)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: blocks.SampledDelay(period=H, n=0), r"SampledDelay\.n must be 1 or more"),
        (lambda: blocks.SampledP(period=H, k=1.0, y_min=1.0, y_max=0.0), r"SampledP\.y_min must be smaller than y_max"),
        (lambda: blocks.NormalNoise(period=H, sigma=1.0, seed=-1), r"NormalNoise\.seed must be 0 or more"),
        (lambda: blocks.UniformNoise(period=H, y_min=1.0, y_max=0.0), r"y_min must be smaller than y_max"),
        (lambda: blocks.BandLimitedNoise(sigma=1.0, f_min=2.0, f_max=1.0), r"f_min must be smaller than f_max"),
        (lambda: blocks.BandLimitedNoise(sigma=1.0, f_min=1.0, f_max=2.0, n=0), r"n must be 1 or more"),
    ],
)
def test_bad_parameters(build: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        build()
