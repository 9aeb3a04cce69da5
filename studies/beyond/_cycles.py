"""Temperature of a winding under repeated operations.

The model has the two thermal nodes of `BrushedMotor` and is linear while the current is constant. With the temperature
rise x of winding and housing above the ambient, C_w dx_w/dt = R(T_w) i^2 - G_wh (x_w - x_h) and C_h dx_h/dt =
G_wh (x_w - x_h) - G_ha x_h. An operation is a burst of heat during the opening, a hold at a current, and a pause.
"""

import dataclasses
import functools as ft
import math

import numpy as np
import scipy
from jaxtyping import Float

from components.electrical import BrushedMotor

RAREST = 24.0 * 3600.0  # s, longest period between operations

COLD = np.array([0.0, 0.0, 1.0])  # the state before all operations
State = Float[np.ndarray, "3"]  # temperature rise of winding and housing in K, and 1


@dataclasses.dataclass(frozen=True, eq=False)
class Cycle:
    """A repeated operation."""

    motor: BrushedMotor
    ambient: float  # K
    opening: float  # s
    burst: float  # J, winding heat of the opening
    current: float  # A, holding current
    hold: float  # s

    @property
    def shortest(self) -> float:
        """The period without a pause, in s."""
        return self.opening + self.hold

    def peak(self, period: float) -> float:
        """The peak winding temperature in K in the periodic steady state; infinite on thermal runaway."""
        whole = self.whole(period)
        if np.max(np.abs(np.linalg.eigvals(whole[:2, :2]))) >= 1.0:
            return math.inf
        before = np.append(np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2]), 1.0)
        return self.warmest(before)

    def warmest(self, before: State) -> float:
        """The peak winding temperature in K of an operation: after its burst, or at the end of its hold."""
        struck = self._struck @ before
        return self.ambient + float(max(struck[0], (self._held @ struck)[0]))

    def whole(self, period: float) -> Float[np.ndarray, "3 3"]:
        """State transition matrix of an operation and its pause."""
        return self._over(period - self.hold, 0.0) @ self._held @ self._struck

    def shortest_period(self, limit: float) -> float:
        """The shortest period in s below a temperature limit in K; infinite if the first operation exceeds it."""
        if self.warmest(COLD) > limit:
            return math.inf
        if self.peak(self.shortest) <= limit:
            return self.shortest
        return float(scipy.optimize.brentq(lambda period: self.peak(period) - limit, *self._bracket(limit)))

    def _bracket(self, limit: float) -> tuple[float, float]:
        """Two periods that bracket the limit of the peak temperature."""
        short = self.shortest
        while not math.isfinite(self.peak(short)):
            short *= 1.1
        return (short, RAREST) if self.peak(short) > limit else (short / 1.1, short)

    def time_to(self, limit: float, period: float) -> float:
        """The time in s until the winding first exceeds a limit in K, in whole periods; infinite if it does not."""
        if self.peak(period) <= limit:
            return math.inf
        state, time, whole = COLD, 0.0, self.whole(period)
        while self.warmest(state) <= limit:
            state, time = whole @ state, time + period
        return time

    @ft.cached_property
    def _held(self) -> Float[np.ndarray, "3 3"]:
        """State transition matrix of the hold."""
        return self._over(self.hold, self.current)

    @ft.cached_property
    def _struck(self) -> Float[np.ndarray, "3 3"]:
        """State transition matrix of the burst."""
        matrix = np.eye(3)
        matrix[0, 2] = self.burst / float(self.motor.winding.C)
        return matrix

    def _over(self, duration: float, current: float) -> Float[np.ndarray, "3 3"]:
        """State transition matrix over a duration in s at a current in A."""
        motor, square = self.motor, current**2
        resistor, inside, outside = motor.resistor, float(motor.inside.G), float(motor.outside.G)
        slope = float(resistor.R_ref * resistor.alpha)
        cold = float(resistor.R_ref) + slope * (self.ambient - float(resistor.T_ref))
        flows = np.array([[square * slope - inside, inside, square * cold], [inside, -inside - outside, 0.0]])
        matrix = np.zeros((3, 3))
        matrix[:2] = flows / np.array([[float(motor.winding.C)], [float(motor.housing.C)]])
        return scipy.linalg.expm(duration * matrix)
