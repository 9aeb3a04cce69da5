"""Delays of continuous signals: exact by a recorded history, or approximated by a polynomial over the history."""

from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from acausal import (
    ROW,
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Time,
    Var,
    Vector,
    eq,
    positive,
    prefer,
    recall,
    refuse,
    remember,
    require,
)
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


class FixedDelay(SISO):
    """y = u(t - T), exact (MSL `FixedDelay`).

    Before the start of a run, u was constant: y is u at the start until T has passed; with `steady=False`, y is the
    start value of `before`. A jump of u is an event, and again one after T. The error of the history counts in the
    error control of the run. No step is longer than T, so a delay closes no algebraic loop, and a delay that is short
    compared with the time span of the run is slow. A run fails if it takes more than n steps in T. Of several jumps
    that enter at one instant, the derivatives behind the delay are those of one jump at the mean of their times,
    weighted by their heights. `resume=True` continues a run with its history. A model with this block cannot be
    linearised, exported as C code or run backwards; one with a `PadeDelay` can. Differential equations with a delay are
    integrated by the method of steps (Bellen, Zennaro, `Numerical Methods for Delay Differential Equations`, 2003,
    ch. 3).
    """

    T: Param[Scalar, "s", positive]  # delay
    n: int = 64  # number of steps that the history holds
    steady: bool = True  # u was constant before the start; otherwise it was the start value of `before`
    t: Time[Scalar, "s"] = 0.0
    since: Var[Scalar, "s"] = 0.0  # time at which the present y entered
    before: Var[Scalar, "", prefer] = 0.0  # u before the start of the run
    past: Discrete[Vector, "", of_shape("n", ROW)] = -jnp.inf

    def requirements(self) -> Requirements:
        return (require(self.n >= 2, "n must be 2 or more"),)

    def initial_equations(self, d: Any) -> Equations:
        return dict(steady=eq(self.before, self.u.value)) if self.steady else {}

    def equations(self, d: Self) -> Equations:
        return dict(
            delay=eq(self.since, self.t - self.T),
            output=eq(self.y.value, recall(self.past, self.since, self.before), check_units=False),  # see `recall`
            constant=eq(d.before, 0.0),
        )

    def events(self) -> Events:
        return dict(history=remember(self.T, past=self.u.value))


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
