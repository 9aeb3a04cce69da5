"""Stability margins of a loop: the gain, phase lag or delay up to which it stays stable."""

from typing import Any, NamedTuple

import numpy as np

from .zeros import Matrices, transmission_zeros

NEAR = 1e-6  # relative real part below which a zero counts as imaginary


class Margins(NamedTuple):
    """Stability margins of a negative-feedback loop with L(s); infinite if there is no limit.

    - `gain`: the factor above 1 by which L may grow, and `phase_crossover` in rad/s, where arg L = -180 degrees;
      `least_gain` is the factor below 1 down to which it may shrink, zero if it may vanish.
    - `phase`: the additional phase lag of L in degrees, and `gain_crossover` in rad/s, where |L| = 1.
    - `delay`: the additional delay in s.
    """

    gain: float
    phase_crossover: float
    phase: float
    gain_crossover: float
    delay: float
    least_gain: float

    def __str__(self) -> str:
        least = f"least gain {self.least_gain:.4g}, " if self.least_gain > 0.0 else ""
        return (
            f"gain margin {self.gain:.4g} at {self.phase_crossover:.4g} rad/s, {least}"
            f"phase margin {self.phase:.4g} deg at {self.gain_crossover:.4g} rad/s, delay margin {self.delay:.4g} s"
        )


def margins(matrices: Matrices) -> Margins:
    """The margins of L(s) = C (s - A)^-1 B + D; its crossovers are zeros of systems twice as large.

    |L| = 1 where L(s) L(-s) - 1 vanishes on the imaginary axis, and L is real where L(s) - L(-s) does.
    """
    A, B, C, D = (np.asarray(matrix, float) for matrix in matrices)

    def response(w: float) -> complex:
        return complex((C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) + D)[0, 0])

    none = np.zeros_like(A)
    # L(-s) = -C (s + A)^-1 B + D
    turned = np.concatenate([C, -D @ C], axis=1)
    series = np.block([[A, -B @ C], [none, -A]]), np.concatenate([B @ D, B]), turned, D @ D - 1.0
    apart = np.block([[A, none], [none, -A]]), np.concatenate([B, B]), np.concatenate([C, C], axis=1), np.zeros((1, 1))
    real = {w: response(w).real for w in _crossings(apart)}
    gains = sorted((-1.0 / value, w) for w, value in real.items() if value < 0.0)
    above, below = [pair for pair in gains if pair[0] > 1.0], [pair for pair in gains if pair[0] < 1.0]
    gain, phase_crossover = min(above, default=(np.inf, np.inf))
    phases = [(float(np.degrees(np.angle(-response(w)))), w) for w in _crossings(series)]
    phase, gain_crossover = min(phases, key=lambda pair: abs(pair[0]), default=(np.inf, np.inf))
    delay = min((np.radians(angle % 360.0) / w for angle, w in phases if w > 0.0), default=np.inf)
    return Margins(gain, phase_crossover, phase, gain_crossover, float(delay), max(below, default=(0.0, 0.0))[0])


def _crossings(matrices: Any) -> list[float]:
    """The frequencies in rad/s of zeros on the imaginary axis, except zero."""
    zeros: Any = transmission_zeros(matrices)
    is_there = (np.abs(zeros.real) < NEAR * np.abs(zeros)) & (zeros.imag > 0.0)
    return zeros[is_there].imag.tolist()
