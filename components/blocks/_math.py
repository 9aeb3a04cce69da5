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
    """y = k1 u1 + k2 u2; with k2 = -1 the difference."""

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
    """y = u1 / u2. Where u2 passes through zero, y is infinite and the run fails."""

    def equations(self, d: Self) -> Equations:
        return dict(quotient=eq(self.y.value, self.u1.value / self.u2.value))


class Minimum(SI2SO):
    """y = min(u1, u2) (MSL `Min`); that they cross is an event."""

    def equations(self, d: Self) -> Equations:
        return dict(minimum=eq(self.y.value, ifelse(self.u1.value > self.u2.value, self.u2.value, self.u1.value)))


class Maximum(SI2SO):
    """y = max(u1, u2) (MSL `Max`); that they cross is an event."""

    def equations(self, d: Self) -> Equations:
        return dict(maximum=eq(self.y.value, ifelse(self.u1.value > self.u2.value, self.u1.value, self.u2.value)))


class Function(SISO):
    """y = function(u), for a function written with `jax.numpy`: `Function(function=jnp.abs)`.

    The function is part of the model's structure, so a new function object means a new compilation: define it once, at
    module level. What is to be varied or differentiated belongs into a component of its own with parameters. Kinks and
    jumps of the function are no events: they cost steps, and derivatives lose accuracy there, unlike with `Limiter`,
    `Maximum` or `Table1D`. An infinite slope, as of a square root at zero, can end the run.
    """

    function: Callable[[Scalar], Scalar]

    def equations(self, d: Self) -> Equations:
        return dict(function=eq(self.y.value, self.function(self.u.value), check_units=False))
