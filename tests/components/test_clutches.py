"""Clutches and a brake in a row, pressed and released while shafts slip, stick and reverse, at random."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from acausal import Component, Connections, connect, replace, simulate
from acausal.testing import check_law
from components import translational
from components.blocks import Sine
from components.rotational import Brake, Clutch, Inertia, SignalTorque

T1 = 3.0
WIDTH = 2e-5  # rad/s, in which the friction of the reference changes its sign
PRESS = 5.0, 5.0, 3.0  # N.m at u = 1


class Row(Component):
    """Three inertias with clutches in between, driven at one end and braked at the other."""

    pressures: tuple[Sine, Sine, Sine]
    torque: Sine
    motor: SignalTorque
    inertias: tuple[Inertia, Inertia, Inertia]
    clutches: tuple[Clutch, Clutch]
    brake: Brake

    def connections(self) -> Connections:
        (j1, j2, j3), (c1, c2) = self.inertias, self.clutches
        pressed = zip(self.pressures, (c1, c2, self.brake), strict=True)
        return (
            connect(self.torque.y, self.motor.u),
            connect(self.motor.flange, j1.a),
            connect(j1.b, c1.a),
            connect(c1.b, j2.a),
            connect(j2.b, c2.a),
            connect(c2.b, j3.a),
            connect(j3.b, self.brake.flange),
            *(connect(source.y, part.u) for source, part in pressed),
        )


def row(numbers: Any) -> Row:
    """Amplitude, frequency, offset and phase of three pressures and a torque, then three moments of inertia."""
    sources = [
        Sine(amplitude=a, frequency=f, offset=o, phase=p) for a, f, o, p in (numbers[i : i + 4] for i in (0, 4, 8, 12))
    ]
    given: list[dict[str, Any]] = [dict(mu=1.0, fn_max=press) for press in PRESS]
    first, second, third = given
    return Row(
        pressures=(sources[0], sources[1], sources[2]),
        torque=sources[3],
        motor=SignalTorque(),
        inertias=(Inertia(J=numbers[16]), Inertia(J=numbers[17]), Inertia(J=numbers[18])),
        clutches=(Clutch(**first), Clutch(**second)),
        brake=Brake(**third),
    )


def drawn(n: int) -> np.ndarray:
    draw = np.random.default_rng(0)
    pressures = [draw.uniform((0.2, 0.2, -0.2, 0.0), (1.5, 2.0, 1.0, 6.0), (n, 4)) for _ in range(3)]
    torque = draw.uniform((2.0, 0.2, -3.0, 0.0), (10.0, 2.0, 3.0, 6.0), (n, 4))
    return np.concatenate([*pressures, torque, draw.uniform(0.1, 2.0, (n, 3))], axis=1)


def speeds(numbers: Any) -> Any:
    final = simulate(row(numbers), T1, save="end", rtol=1e-8, max_events=100).final
    return jnp.stack([inertia.w for inertia in final.inertias])


def rounded(numbers: np.ndarray) -> np.ndarray:
    """Final speeds with smoothed friction."""

    def signal(i: int, t: float) -> float:
        a, f, o, p = numbers[4 * i : 4 * i + 4]
        return o + a * np.sin(2.0 * np.pi * f * t + p)

    def rates(t: float, w: np.ndarray) -> np.ndarray:
        slips = np.array([w[0] - w[1], w[1] - w[2], w[2]])
        held = [press * max(signal(i, t), 0.0) for i, press in enumerate(PRESS)] * np.tanh(slips / WIDTH)
        return (np.array([signal(3, t), held[0], held[1]]) - held) / numbers[16:]

    return solve_ivp(rates, (0.0, T1), np.zeros(3), method="LSODA", rtol=1e-8, atol=1e-9).y[:, -1]


@pytest.mark.thorough
def test_speeds_are_those_of_rounded_friction() -> None:
    cases = drawn(8)
    found = np.asarray(jax.jit(jax.vmap(speeds))(cases))
    expected = np.array([rounded(numbers) for numbers in cases])
    np.testing.assert_allclose(found, expected, atol=10.0 * WIDTH)
    sticks = np.abs(np.diff(found, axis=1)) < 1e-9
    assert sticks.any()
    assert not sticks.all()


@pytest.mark.slow
def test_derivatives_of_the_speeds() -> None:
    """With respect to the offset of the torque, in both modes and by differences with the same events."""
    model = row(drawn(1)[0])

    def final(offset: Any) -> Any:
        changed = replace(model, {"torque.offset": offset})
        parts = simulate(changed, T1, save="end", rtol=1e-10, max_events=100).final.inertias
        return jnp.stack([inertia.w for inertia in parts])

    at = jnp.asarray(model.torque.offset)
    forward, reverse = np.asarray(jax.jacfwd(final)(at)), np.asarray(jax.jacrev(final)(at))
    ahead, behind = (np.asarray(final(at + step)) for step in (1e-4, -1e-4))
    np.testing.assert_allclose(forward, reverse, rtol=1e-9)
    assert forward == pytest.approx((ahead - behind) / 2e-4, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize(
    ("pressed", "effort", "speed"),
    [
        (Clutch(mu=0.4, fn_max=500.0, cgeo=0.3), "a.tau", "w"),
        (Brake(mu=0.4, fn_max=500.0, cgeo=0.3), "flange.tau", "w"),
        (translational.Brake(mu=0.4, fn_max=500.0, cgeo=0.3), "flange.f", "v"),
    ],
    ids=["Clutch", "Brake", "translational.Brake"],
)
def test_sliding_friction_is_that_of_all_surfaces(pressed: Any, effort: str, speed: str) -> None:
    """mu cgeo u fn_max, against the motion."""
    for mode in (1.0, -1.0):
        sliding = replace(pressed, {"mode": mode})
        friction = mode * 0.4 * 0.3 * 0.7 * 500.0
        size = friction * (-1.0 if effort == "a.tau" else 1.0)
        check_law(sliding, {"u.value": 0.7, speed: 2.0 * mode}, {effort: size})
