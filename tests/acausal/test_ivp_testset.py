"""Published end values: Test Set for IVP Solvers (Mazzia, Magherini, 2008)."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal._integrate.solvers import Rodas3P, Rodas5P


class Problem(NamedTuple):
    f: Callable
    y0: list[float]
    t1: float
    y1: list[float]
    nominal: Any = 1.0
    mass: Any = None


def robertson(t, y, _):
    slow, fast = -0.04 * y[0] + 1e4 * y[1] * y[2], 3e7 * y[1] ** 2
    return jnp.stack([slow, -slow - fast, fast])


def van_der_pol(t, y, _):
    return jnp.stack([y[1], ((1 - y[0] ** 2) * y[1] - y[0]) / 1e-6])


def hires(t, y, _):
    y1, y2, y3, y4, y5, y6, y7, y8 = y
    decay = 280 * y6 * y8 - 1.81 * y7
    return jnp.stack(
        [
            -1.71 * y1 + 0.43 * y2 + 8.32 * y3 + 0.0007,
            1.71 * y1 - 8.75 * y2,
            -10.03 * y3 + 0.43 * y4 + 0.035 * y5,
            8.32 * y2 + 1.71 * y3 - 1.12 * y4,
            -1.745 * y5 + 0.43 * y6 + 0.43 * y7,
            -280 * y6 * y8 + 0.69 * y4 + 1.71 * y5 - 0.43 * y6 + 0.69 * y7,
            decay,
            -decay,
        ]
    )


def akzo_nobel(t, y, _):
    y1, y2, y3, y4, y5, y6 = y
    r1 = 18.7 * y1**4 * jnp.sqrt(y2)
    r2 = 0.58 * y3 * y4
    r3 = 0.58 / 34.4 * y1 * y5
    r4 = 0.09 * y1 * y4**2
    r5 = 0.42 * y6**2 * jnp.sqrt(y2)
    inflow = 3.3 * (0.9 / 737 - y2)
    return jnp.stack(
        [
            -2 * r1 + r2 - r3 - r4,
            -0.5 * r1 - r4 - 0.5 * r5 + inflow,
            r1 - r2 + r3,
            -r2 + r3 - 2 * r4,
            r2 - r3 + r5,
            115.83 * y1 * y4 - y6,
        ]
    )


def transistor_amplifier(t, y, _):
    y1, y2, y3, y4, y5, y6, y7, y8 = y
    supply, signal = 6, 0.1 * jnp.sin(200 * jnp.pi * t)
    first, second = (1e-6 * (jnp.exp(u / 0.026) - 1) for u in (y2 - y3, y5 - y6))
    return jnp.stack(
        [
            (y1 - signal) / 1000,
            y2 / 9000 + (y2 - supply) / 9000 + 0.01 * first,
            y3 / 9000 - first,
            (y4 - supply) / 9000 + 0.99 * first,
            y5 / 9000 + (y5 - supply) / 9000 + 0.01 * second,
            y6 / 9000 - second,
            (y7 - supply) / 9000 + 0.99 * second,
            y8 / 9000,
        ]
    )


def capacitances() -> np.ndarray:
    """Capacitors of 1 to 5 microfarad between nodes 1-2, 3-ground, 4-5, 6-ground, 7-8."""
    mass = np.zeros((8, 8))
    pair = np.array([[-1.0, 1.0], [1.0, -1.0]])
    for c, i in ((1, 0), (3, 3), (5, 6)):
        mass[i : i + 2, i : i + 2] = c * 1e-6 * pair
    mass[2, 2], mass[5, 5] = -2e-6, -4e-6
    return mass


PROBLEMS = {
    "robertson": Problem(
        robertson,
        [1.0, 0.0, 0.0],
        1e11,
        [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050],
        nominal=np.array([1e-6, 1e-12, 1.0]),
    ),
    "van der pol": Problem(van_der_pol, [2.0, 0.0], 2.0, [1.706167732170469, -0.8928097010248125]),
    "hires": Problem(
        hires,
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057],
        321.8122,
        [
            0.7371312573325668e-3,
            0.1442485726316185e-3,
            0.5888729740967575e-4,
            0.1175651343283149e-2,
            0.2386356198831331e-2,
            0.6238968252742796e-2,
            0.2849998395185769e-2,
            0.2850001604814231e-2,
        ],
        nominal=1e-3,
    ),
    "akzo nobel": Problem(
        akzo_nobel,
        [0.444, 0.00123, 0.0, 0.007, 0.0, 115.83 * 0.444 * 0.007],
        180.0,
        [
            0.1150794920661702,
            0.1203831471567715e-2,
            0.1611562887407974,
            0.3656156421249283e-3,
            0.1708010885264404e-1,
            0.4873531310307455e-2,
        ],
        nominal=1e-3,
        mass=np.array([1.0, 1, 1, 1, 1, 0]),
    ),
    "transistor amplifier": Problem(
        transistor_amplifier,
        [0.0, 3, 3, 6, 3, 3, 6, 0],
        0.2,
        [
            -0.5562145012262709e-2,
            0.3006522471903042e1,
            0.2849958788608128e1,
            0.2926422536206241e1,
            0.2704617865010554e1,
            0.2761837778393145e1,
            0.4770927631616772e1,
            0.1236995868091548e1,
        ],
        mass=capacitances(),
    ),
}


def correct_digits(method: type, problem: Problem, rtols: tuple[float, ...]) -> list[float]:
    """Correct digits of the worst component, relative where it is larger than its nominal size."""
    nominal = problem.nominal * np.ones(len(problem.y0))

    @jax.jit
    def final(rtol):
        sol = diffrax.diffeqsolve(
            diffrax.ODETerm(problem.f),
            method(mass=problem.mass, nominal=nominal),
            0.0,
            problem.t1,
            None,
            jnp.array(problem.y0),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol * nominal),
            max_steps=20_000,
        )
        assert sol.ys is not None
        return sol.ys[-1]

    scale = np.maximum(np.abs(problem.y1), nominal)
    worst = [np.max(np.abs(final(rtol) - np.array(problem.y1)) / scale) for rtol in rtols]
    return [float(-np.log10(error)) for error in worst]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("method", "name", "rtols", "digits"),
    [
        (Rodas5P, "robertson", (1e-5, 1e-8), (6, 8.5)),
        (Rodas5P, "van der pol", (1e-5, 1e-8), (5, 7.5)),
        (Rodas5P, "hires", (1e-5, 1e-8), (4.5, 8.5)),
        (Rodas5P, "akzo nobel", (1e-5, 1e-8), (5, 8.5)),
        (Rodas5P, "transistor amplifier", (1e-5, 1e-8), (6.5, 9)),
        (Rodas3P, "robertson", (1e-4, 1e-6), (5, 6.5)),
        (Rodas3P, "hires", (1e-4, 1e-6), (2, 3)),
        (Rodas3P, "akzo nobel", (1e-4, 1e-6), (4, 6)),
    ],
)
def test_end_values(method, name, rtols, digits):
    assert np.all(np.array(correct_digits(method, PROBLEMS[name], rtols)) > digits)
