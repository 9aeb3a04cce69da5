"""Operations on signals."""

from collections.abc import Callable
from typing import Self

import jax.numpy as jnp

from acausal import Component, Equations, Param, Requirements, Scalar, Vector, eq, ifelse, require

from .._checks import numbers
from ._interfaces import SI2SO, SISO, Input, Output


class Gain(SISO):
    """y = k u."""

    k: Param[Scalar, ""]  # gain

    def equations(self, d: Self) -> Equations:
        return dict(gain=eq(self.y.value, self.k * self.u.value))


class Sum(SI2SO):
    """y = k1 u1 + k2 u2; the difference for k2 = -1."""

    k1: Param[Scalar, ""] = 1.0  # weight of u1
    k2: Param[Scalar, ""] = 1.0  # weight of u2

    def equations(self, d: Self) -> Equations:
        return dict(sum=eq(self.y.value, self.k1 * self.u1.value + self.k2 * self.u2.value))


class WeightedSum(Component):
    """y = sum of k_i u_i over any number of inputs: `WeightedSum(k=[1.0, -1.0, 0.5])` has u[0], u[1] and u[2].

    As MSL `Add3` and `Sum`.
    """

    k: Param[Vector, ""]  # weights
    u: tuple[Input, ...]
    y: Output

    def __init__(self, *, k: Vector | list[float]) -> None:
        self.k = numbers(self, "k", k)
        self.u = tuple(Input() for _ in range(len(self.k)))
        self.y = Output()

    def requirements(self) -> Requirements:
        return (require(jnp.shape(self.k) == (len(self.u),), f"k must have shape {(len(self.u),)}"),)

    def equations(self, d: Self) -> Equations:
        return dict(sum=eq(self.y.value, sum(self.k[i] * u.value for i, u in enumerate(self.u))))


class Product(SI2SO):
    """y = u1 u2."""

    def equations(self, d: Self) -> Equations:
        return dict(product=eq(self.y.value, self.u1.value * self.u2.value))


class Division(SI2SO):
    """y = u1 / u2. If u2 crosses zero, y is infinite and the run fails."""

    def equations(self, d: Self) -> Equations:
        return dict(quotient=eq(self.y.value, self.u1.value / self.u2.value))


class Minimum(SI2SO):
    """y = min(u1, u2) (MSL `Min`); a crossing of the inputs is an event."""

    def equations(self, d: Self) -> Equations:
        return dict(minimum=eq(self.y.value, ifelse(self.u1.value > self.u2.value, self.u2.value, self.u1.value)))


class Maximum(SI2SO):
    """y = max(u1, u2) (MSL `Max`); a crossing of the inputs is an event."""

    def equations(self, d: Self) -> Equations:
        return dict(maximum=eq(self.y.value, ifelse(self.u1.value > self.u2.value, self.u1.value, self.u2.value)))


class Function(SISO):
    """y = function(u), for a function written with `jax.numpy`: `Function(function=jnp.abs)`.

    The function is part of the model structure, so a new function object triggers a new compilation: define it once, at
    module level. To vary or differentiate its parameters, write a component instead. Kinks and jumps of the function
    are not events: they cost steps and accuracy of derivatives, unlike those of `Limiter`, `Maximum` or `Table1D`. An
    infinite slope, such as that of a square root at zero, can make the run fail.
    """

    function: Callable[[Scalar], Scalar]

    def equations(self, d: Self) -> Equations:
        return dict(function=eq(self.y.value, self.function(self.u.value), check_units=False))
