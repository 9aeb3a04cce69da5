"""How warm a winding becomes that is heated again and again.

The two nodes of `BrushedMotor`, linear while the current is constant: with x the excess of winding and housing over the
ambient, C_w dx_w/dt = R(T_w) i^2 - G_wh (x_w - x_h) and C_h dx_h/dt = G_wh (x_w - x_h) - G_ha x_h. An operation is a
burst of heat as the clutch opens, a hold at a current, and a pause.
"""

import dataclasses
import functools as ft
import math

import numpy as np
import scipy
from jaxtyping import Float

from components.electrical import BrushedMotor

RAREST = 24.0 * 3600.0  # s, between operations: as good as never

COLD = np.array([0.0, 0.0, 1.0])  # the state before all operations
State = Float[np.ndarray, "3"]  # excess of winding and housing in K, and 1


@dataclasses.dataclass(frozen=True, eq=False)
class Cycle:
    """An operation that is repeated."""

    motor: BrushedMotor
    ambient: float  # K
    opening: float  # s
    burst: float  # J, into the winding while it opens
    current: float  # A, of the hold
    hold: float  # s

    @property
    def shortest(self) -> float:
        """The period without a pause, in s."""
        return self.opening + self.hold

    def peak(self, period: float) -> float:
        """The highest temperature in K of the winding once all repeats itself; infinite where it runs away."""
        whole = self.whole(period)
        if np.max(np.abs(np.linalg.eigvals(whole[:2, :2]))) >= 1.0:
            return math.inf
        before = np.append(np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2]), 1.0)
        return self.warmest(before)

    def warmest(self, before: State) -> float:
        """The highest temperature in K of the winding in an operation: after its burst, or at the end of its hold."""
        struck = self._struck @ before
        return self.ambient + float(max(struck[0], (self._held @ struck)[0]))

    def whole(self, period: float) -> Float[np.ndarray, "3 3"]:
        """What an operation and the pause after it do to the state."""
        return self._over(period - self.hold, 0.0) @ self._held @ self._struck

    def shortest_period(self, limit: float) -> float:
        """In s, with which the winding stays below a limit in K; infinite where it exceeds that the first time."""
        if self.warmest(COLD) > limit:
            return math.inf
        if self.peak(self.shortest) <= limit:
            return self.shortest
        return float(scipy.optimize.brentq(lambda period: self.peak(period) - limit, *self._bracket(limit)))

    def _bracket(self, limit: float) -> tuple[float, float]:
        """Two periods between which the peak passes the limit."""
        short = self.shortest
        while not math.isfinite(self.peak(short)):
            short *= 1.1
        return (short, RAREST) if self.peak(short) > limit else (short / 1.1, short)

    def time_to(self, limit: float, period: float) -> float:
        """In s, until the winding first exceeds a limit in K, to a period; infinite where it does not."""
        if self.peak(period) <= limit:
            return math.inf
        state, time, whole = COLD, 0.0, self.whole(period)
        while self.warmest(state) <= limit:
            state, time = whole @ state, time + period
        return time

    @ft.cached_property
    def _held(self) -> Float[np.ndarray, "3 3"]:
        """What the hold does to the state."""
        return self._over(self.hold, self.current)

    @ft.cached_property
    def _struck(self) -> Float[np.ndarray, "3 3"]:
        """What the burst does to the state."""
        matrix = np.eye(3)
        matrix[0, 2] = self.burst / float(self.motor.winding.C)
        return matrix

    def _over(self, duration: float, current: float) -> Float[np.ndarray, "3 3"]:
        """What a duration in s at a current in A does to the state."""
        motor, square = self.motor, current**2
        resistor, inside, outside = motor.resistor, float(motor.inside.G), float(motor.outside.G)
        slope = float(resistor.R_ref * resistor.alpha)
        cold = float(resistor.R_ref) + slope * (self.ambient - float(resistor.T_ref))
        flows = np.array([[square * slope - inside, inside, square * cold], [inside, -inside - outside, 0.0]])
        matrix = np.zeros((3, 3))
        matrix[:2] = flows / np.array([[float(motor.winding.C)], [float(motor.housing.C)]])
        return scipy.linalg.expm(duration * matrix)
