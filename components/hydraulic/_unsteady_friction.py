"""Frequency-dependent laminar friction, which determines the decay of water hammer."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Param,
    ParameterError,
    Record,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    positive,
    require,
    shape,
)

from ._liquids import AnyLiquid
from ._pipe_friction import PipeFriction
from ._pipes import Segments

_KAGAWA_WEIGHTS = (1.0, 1.16725, 2.20064, 3.92861, 6.78788, 11.6761, 20.0612, 34.4541, 59.1642, 101.59)
_KAGAWA_RATES = (26.3744, 72.8033, 187.424, 536.626, 1570.6, 4618.13, 13601.1, 40082.5, 118153.0, 348316.0)


class FrictionMemory(Record):
    """Zielke's weighting function as a sum of exponentials, W(tau) = sum of weights exp(-rates tau), tau = 4 nu t/d^2.

    `FrictionMemory.kagawa(10)` is within 0.3 % of Zielke's series for tau above 1e-5, `kagawa(7)` above 1e-4;
    `trikha()`, with three terms, is within 40 % above 3e-5 (all compared with the sum over 4000 zeros of J2).
    """

    weights: Param[Vector, "1", positive]
    rates: Param[Vector, "1", positive]

    def requirements(self) -> Requirements:
        is_alike = jnp.ndim(self.weights) == 1 and jnp.shape(self.weights) == jnp.shape(self.rates)
        return (require(is_alike, "weights must be one-dimensional, with one number for each of rates"),)

    @classmethod
    def kagawa(cls, terms: int = 7) -> "FrictionMemory":
        """The slowest of ten terms (Kagawa, Lee, Kitagawa, Takenaka, Trans. JSME 49 (1983), 2638).

        Terms with rates 4 nu/d^2 above n c/length, which n segments cannot resolve, only add stiffness.

        Raises `ParameterError` for other than 1 to 10 terms.
        """
        if terms not in range(1, len(_KAGAWA_RATES) + 1):
            raise ParameterError(f"FrictionMemory.kagawa has 1 to {len(_KAGAWA_RATES)} terms, got {terms!r}.")
        return cls(weights=jnp.array(_KAGAWA_WEIGHTS[:terms]), rates=jnp.array(_KAGAWA_RATES[:terms]))

    @classmethod
    def trikha(cls) -> "FrictionMemory":
        """Three terms (Trikha, J. Fluids Eng. 97 (1975), 97)."""
        return cls(weights=jnp.array([1.0, 8.1, 40.0]), rates=jnp.array([26.4, 200.0, 8000.0]))


class UnsteadyFrictionPipe(Segments):
    """A `Pipe` with frequency-dependent friction (Zielke 1968, by exponentials as Trikha 1975 and Kagawa 1983).

    The steady friction is increased by 16 nu rho l/(A d^2) times the sum of y_k, with a = 4 nu/d^2 and
    dy_k/dt = weights_k dq/dt - rates_k a y_k: each term represents an annulus of liquid that is dragged along. All y_k
    are zero in steady flow and at the start of a run. The omitted faster terms act as added inertia, so that slow
    oscillations have 4/3 of the inertance as in Zielke's law, in which the sum of weights/rates is 1/12. Derived for
    laminar flow; in turbulent flow the memory is shorter. Arguments as for `Pipe`; `memory` is
    `FrictionMemory.kagawa()` by default.
    """

    k: int  # number of terms of the memory
    memory: FrictionMemory
    y: Var[Vector, "m3/s", shape("n", "k")]  # flow relative to the annuli, times weights

    def __init__(
        self,
        *,
        n: int,
        length: Scalar,
        diameter: Scalar,
        liquid: AnyLiquid,
        memory: FrictionMemory | None = None,
        friction: PipeFriction | None = None,
        wall: Scalar = 0.0,
        p: Param[Any, "Pa"] | None = None,  # initial pressure at the nodes
        q: Any = None,
        heat: bool = False,
    ) -> None:
        self._build(n, length, diameter, liquid, friction, wall, p, q, heat)
        self.memory = FrictionMemory.kagawa() if memory is None else memory
        self.k = len(self.memory.weights)
        none: Any = None
        self.y = none

    def equations(self, d: Self) -> Equations:
        driven = self.memory.weights * d.q[:, None]
        return super().equations(d) | dict(memory=eq(d.y, driven - self._decay() * self.y))

    def energy(self) -> Energy:
        account, weights = super().energy(), self.memory.weights
        drag = 0.5 * self._laminar()[:, None] / weights
        slower = weights * self.q[:, None] - self.y  # speed of the annuli as a flow, times weights
        dissipated = jnp.sum(super()._resistance() * self.q) + jnp.sum(drag * self.y**2)
        return account._replace(
            stored=account.stored + jnp.sum(0.5 * drag / self._decay() * slower**2), dissipated=dissipated
        )

    def _inertia(self) -> Scalar:
        memory = self.memory
        return self.inertance * (4.0 / 3.0 - 4.0 * jnp.sum(memory.weights / memory.rates))

    def _resistance(self) -> Vector:
        return super()._resistance() + 0.5 * self._laminar() * jnp.sum(self.y, axis=1)

    def _decay(self) -> Vector:
        """Decay rates of the annuli of all segments in 1/s."""
        return self.memory.rates * (4.0 * self._viscosity() / self.diameter**2)[:, None]
