"""Noise that is a function of time and of a seed, and so the same in each run."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np

from acausal import (
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Vector,
    at,
    eq,
    nonnegative,
    positive,
    require,
    shape,
)

from ._interfaces import SignalSource
from ._sampled import Sampled

# Two multiplicative generators, in integers that double precision represents exactly.
_FACTORS, _MODULI = np.array([40014.0, 40692.0]), np.array([2147483563.0, 2147483399.0])


def _seeded(seed: int) -> Requirements:
    return (require(seed >= 0, "seed must be 0 or more"),)


class SampledNoise(SignalSource, Sampled, partial=True):
    """Independent random numbers, a new one at each sample and held until the next; 0 before the first sample.

    The numbers are those of the combined generator of L'Ecuyer (CACM 31, 1988), whose period is 2.3e18.
    Sources with equal seeds give the same sequence: give independent sources different seeds.
    """

    seed: int = 0  # another seed gives other numbers
    held: Discrete[Scalar, ""] = 0.0  # y
    begun: Discrete[Scalar, "1"] = 0.0  # 1 after the first sample
    states: Discrete[Vector, "1", shape(2)] = 1.0  # states of the generators

    def requirements(self) -> Requirements:
        return _seeded(self.seed)

    def value(self, share: Scalar) -> Scalar:
        """The value for a number that is distributed uniformly between 0 and 1."""
        raise NotImplementedError

    def equations(self, d: Any) -> Equations:
        return dict(noise=eq(self.y.value, self.held))

    def events(self) -> Events:
        first = np.random.SeedSequence(self.seed).generate_state(2) % (_MODULI - 1.0) + 1.0
        states = jnp.mod(_FACTORS * jnp.where(self.begun > 0.5, self.states, first), _MODULI)
        share = (jnp.mod(states[0] - states[1], _MODULI[0] - 1.0) + 0.5) / _MODULI[0]
        return dict(sample=at(self.start_time, every=self.period, held=self.value(share), begun=1.0, states=states))


class UniformNoise(SampledNoise):
    """Random numbers that are distributed uniformly between y_min and y_max (MSL `UniformNoise`)."""

    y_min: Param[Scalar, ""]  # lower bound
    y_max: Param[Scalar, ""]  # upper bound

    def requirements(self) -> Requirements:
        return (*super().requirements(), require(self.y_min < self.y_max, "y_min must be smaller than y_max"))

    def value(self, share: Scalar) -> Scalar:
        return self.y_min + (self.y_max - self.y_min) * share


class NormalNoise(SampledNoise):
    """Random numbers with a normal distribution (MSL `NormalNoise`).

    Its spectral density is flat up to about 1/(2 period): 2 sigma^2 period, one-sided, per Hz.
    """

    sigma: Param[Scalar, "", nonnegative]  # standard deviation
    mu: Param[Scalar, ""] = 0.0  # mean

    def value(self, share: Scalar) -> Scalar:
        return self.mu + self.sigma * np.sqrt(2.0) * jax.lax.erf_inv(2.0 * share - 1.0)


class BandLimitedNoise(SignalSource):
    """Smooth noise with a flat spectrum from f_min to f_max: y = mu + sigma sqrt(2/n) sum of cos(2 pi f_i t + phase_i).

    One frequency f_i lies at a random place in each of n equal parts of the band, and the phases are random (Shinozuka,
    `J. Sound Vib.` 25, 1972). The standard deviation over time is sigma, and the distribution of y is nearly normal for
    n of 20 or more. y is smooth, so it needs no events; a run takes several steps for each period of f_max.
    """

    seed: int = 0  # another seed gives other frequencies and phases
    n: int = 50  # number of frequencies
    sigma: Param[Scalar, "", nonnegative]  # standard deviation
    f_min: Param[Scalar, "Hz", nonnegative]  # lower end of the band
    f_max: Param[Scalar, "Hz", positive]  # upper end of the band
    mu: Param[Scalar, ""] = 0.0  # mean

    def requirements(self) -> Requirements:
        return (
            *_seeded(self.seed),
            require(self.n >= 1, "n must be 1 or more"),
            require(self.f_min < self.f_max, "f_min must be smaller than f_max"),
        )

    def equations(self, d: Self) -> Equations:
        places, phases = np.random.default_rng(self.seed).random((2, self.n))
        f = self.f_min + (self.f_max - self.f_min) * (np.arange(self.n) + places) / self.n
        waves = jnp.sum(jnp.cos(2.0 * jnp.pi * (f * self.t + phases)))
        return dict(noise=eq(self.y.value, self.mu + self.sigma * np.sqrt(2.0 / self.n) * waves))
