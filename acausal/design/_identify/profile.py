"""Profile likelihood: chi2 over one parameter, with all others fitted."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import root_scalar
from scipy.stats import t

from ..._errors import ModelError, ParameterError, SimulationError
from ..._extras import Axes
from ..._units.display import Scale
from .estimate import Estimate
from .levenberg_marquardt import minimise

TRIES = 40  # most fits in the search for one end of the interval


@dataclasses.dataclass(frozen=True)
class Profile:
    """chi2 over the values of a parameter, with the others fitted; `low` and `high` are the interval at `level`.

    If chi2 does not reach the threshold, an end is the bound of the parameter, infinite without one.
    """

    name: str
    unit: str
    scale: Scale
    level: float
    values: Float[np.ndarray, " n"]
    chi2: Float[np.ndarray, " n"]
    threshold: float
    low: float
    high: float

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws chi2 over the parameter with the threshold and the interval; returns the matplotlib axes."""
        from .fit_plots import plot_profile

        return plot_profile(self, ax)

    def __str__(self) -> str:
        low, high = (f"{self.scale.value(end):.6g}" for end in (self.low, self.high))
        return f"{self.name} from {low} to {high}{self.scale.text} at {100 * self.level:g} %, by its profile"


def profile(fit: Estimate[Any], index: int, points: int, level: float) -> Profile:
    """Profile from the estimate to either side until chi2 reaches the threshold."""
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level must be between 0 and 1, got {level}.")
    if fit.loss.is_robust:
        raise ModelError(
            f"There is no profile likelihood with the loss {fit.loss.name}, because the rise of its sum is not "
            "distributed as chi2. Use the interval of the covariance, fit.low to fit.high."
        )
    rise = float(t.ppf(0.5 + 0.5 * level, fit.noise_freedom)) ** 2
    sides = [_side(fit, index, direction, rise, points) for direction in (-1.0, 1.0)]
    values = np.concatenate([sides[0][0][::-1], [fit.estimates[index]], sides[1][0]])
    chi2 = np.concatenate([sides[0][1][::-1], [fit.chi2], sides[1][1]])
    name, unit, scale = fit.names[index], fit.units[index], fit._free.variables[index].scale
    return Profile(name, unit, scale, level, values, chi2, fit.chi2 + rise, sides[0][2], sides[1][2])


def _side(
    fit: Estimate[Any], index: int, direction: float, rise: float, points: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Values and chi2 on one side, and the value at which chi2 has risen by `rise`."""
    held = np.arange(len(fit.names)) == index
    z0, found = fit._minimum.z, {0.0: (fit._minimum.z, 0.0)}
    limit = float(np.asarray(fit._free.scaled(fit._free.low if direction < 0 else fit._free.high))[index])
    farthest = abs(limit - z0[index])
    if farthest == 0.0:
        return np.zeros(0), np.zeros(0), float(fit.estimates[index])

    def risen(distance: float) -> float:
        """Rise of chi2 above its minimum; the other parameters start from the nearest known fit."""
        if distance not in found:
            near = min(found, key=lambda known: abs(known - distance))
            start = found[near][0].copy()
            start[index] = z0[index] + direction * distance
            minimum = minimise(fit._problem, start, held, fit._tolerance)
            above = minimum.chi2 - fit.chi2 if minimum.computed else np.inf
            found[distance] = (minimum.z if minimum.computed else start, above)
        return found[distance][1]

    end = _crossing(risen, _first_guess(fit, index, rise, farthest), farthest, rise)
    outermost = end if end is not None else min(farthest, max(found))
    shown = np.linspace(0.0, outermost, points + 1)[1:].tolist()
    chi2 = np.array([fit.chi2 + risen(distance) for distance in shown])

    def value(distance: float) -> float:
        moved = z0.copy()
        moved[index] += direction * distance
        return float(np.asarray(fit._free.unscaled(moved))[index])

    bound = float((fit._free.low if direction < 0 else fit._free.high)[index])
    return np.array([value(distance) for distance in shown]), chi2, bound if end is None else value(end)


def _first_guess(fit: Estimate[Any], index: int, rise: float, farthest: float) -> float:
    """Scaled distance at which chi2 has risen by `rise`, according to the covariance."""
    slope = float(np.asarray(fit._free.slopes(fit.estimates))[index])
    guess = float(np.sqrt(rise) * fit.std[index] / slope)
    return min(guess, farthest) if np.isfinite(guess) and guess > 0.0 else min(0.1, 0.5 * farthest)


def _crossing(risen: Any, guess: float, farthest: float, rise: float) -> float | None:
    """Distance at which chi2 has risen by `rise`; None if it does not rise so far."""
    low, high = 0.0, guess
    for _ in range(TRIES):
        if risen(high) >= rise:
            # A point that cannot be computed is outside.
            found = root_scalar(lambda d: min(risen(d), 1e6 * rise) - rise, bracket=(low, high), rtol=1e-7)
            return float(found.root)
        if high >= farthest or high > 1e6 * guess:
            return None
        low, high = high, min(2.0 * high, farthest)
    raise SimulationError("The profile found no end of the interval. Narrow the bounds of the parameter.")
