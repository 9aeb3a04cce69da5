"""Delays of continuous signals, by a polynomial approximation of their history."""

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from acausal import Equations, Events, Param, Requirements, Scalar, Var, Vector, eq, positive, prefer, refuse, require
from acausal import shape as of_shape

from ._interfaces import SISO, Input


def _line(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A and B of T dx/dt = A x + B u, for the Legendre coefficients of u over the past time T.

    With P the Legendre polynomials on 0 (now) to 1 (the time T ago), u = sum of x_i P_i obeys du/dt = -(1/T) du/ds. The
    tau method adds a multiple of the next polynomials so that u(0) is the input.
    """
    i, j = np.ogrid[:n, :n]
    A = (2.0 * i + 1.0) * np.where(i < j, -1.0, (-1.0) ** (i - j + 1))
    return A, (2.0 * np.arange(n) + 1.0) * (-1.0) ** np.arange(n)


class DelayLine(SISO, partial=True):
    """A line that carries u from its entry to its exit, as n coefficients of Legendre polynomials."""

    n: int = 8  # number of states
    x: Var[Vector, "", prefer, of_shape("n")] = 0.0  # coefficients of the history of u; x[0] is its mean

    def requirements(self) -> Requirements:
        return (require(self.n >= 1, "n must be 1 or more"),)

    def _moved(self) -> Any:
        """T dx/dt."""
        A, B = _line(self.n)
        return A @ self.x + B * self.u.value

    def equations(self, d: Any) -> Equations:
        return dict(output=eq(self.y.value, sum(self.x[i] for i in range(self.n))))


class PadeDelay(DelayLine):
    """y = u(t - T), approximated by a polynomial of n coefficients over the history of u, from now to T ago.

    The transfer function is the Pade approximation of exp(-s T) of order [n - 1/n], in the Legendre basis, which is
    well conditioned for large n (Voelker, Eliasmith, `Neural Computation` 30, 2018; MSL `PadeDelay` is another
    realisation). For a sine of angular frequency w, the error relative to its amplitude is at most about 2 (n-1)! n! /
    ((2n-1)! (2n)!) (w T)^(2n): 1e-9 for n = 8 and w T = pi, 1e-4 for w T = 2 pi. If u jumps, y oscillates around the
    delayed jump and is delayed by T on average. y does not depend on the present u, so a delay closes no algebraic
    loop. The history is zero at the start; `x=[value, 0, ..., 0]` is a constant one. T is differentiable. For a delay
    that varies see `TransportDelay`, for sampled signals `SampledDelay`.
    """

    T: Param[Scalar, "s", positive]  # delay

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(line=eq(self.T * d.x, self._moved()))


class TransportDelay(DelayLine):
    """Plug flow through a line: y(t) = u(t - T), where the integral of `rate` over the past time T is 1.

    The rate is speed over length, or volume flow over volume: a pipe whose exit temperature follows that of its entry
    by plug flow, a belt conveyor, a rolling mill. For the approximation see `PadeDelay`, which has a constant rate 1/T.
    At rate 0 the line stands still. A negative rate ends the run. Not modelled: mixing, heat losses.
    """

    rate: Input = Input()  # in 1/s

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(line=eq(d.x, self.rate.value * self._moved()))

    def events(self) -> Events:
        return dict(backwards=refuse(self.rate.value < 0.0, "the rate of a TransportDelay must not be negative"))
