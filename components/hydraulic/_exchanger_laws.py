"""Effectiveness of heat exchangers: Kays, London, `Compact Heat Exchangers`; Incropera, DeWitt, table 11.3."""

import abc

import jax.numpy as jnp

from acausal import Record, Scalar

from .._series import expm1_over


class Arrangement(Record, partial=True):
    """How the two streams of a heat exchanger pass each other."""

    @abc.abstractmethod
    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        """Heat flow over the largest possible, from the number of transfer units N = UA/C_min and c = C_min/C_max."""


class CounterFlow(Arrangement):
    """(1 - exp(-x))/(1 - c exp(-x)) with x = N (1 - c), which is N/(1 + N) for c = 1."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        shared = units * expm1_over(-units * (1.0 - ratio))
        return shared / (1.0 + ratio * shared)


class ParallelFlow(Arrangement):
    """(1 - exp(-N (1 + c)))/(1 + c)."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        return -jnp.expm1(-units * (1.0 + ratio)) / (1.0 + ratio)


class CrossFlow(Arrangement):
    """Both streams unmixed: 1 - exp(N^0.22/c (exp(-c N^0.78) - 1)), within 4 % of the exact series."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        spread = units**0.78
        return -jnp.expm1(-(units**0.22) * spread * expm1_over(-ratio * spread))


class ShellAndTube(Arrangement):
    """One shell pass and 2, 4, ... tube passes: 2/(1 + c + s (1 + exp(-N s))/(1 - exp(-N s))), s = sqrt(1 + c^2)."""

    def effectiveness(self, units: Scalar, ratio: Scalar) -> Scalar:
        s = jnp.sqrt(1.0 + ratio**2)
        return 2.0 / (1.0 + ratio + s / jnp.tanh(0.5 * units * s))
