"""Locating the zero of a stop condition within a step."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

Scalar = Float[Array, ""]


class _Bracket(eqx.Module):
    """An interval with the function's values at its ends; `sign` makes the function rise through it."""

    lower: Scalar
    upper: Scalar
    f_lower: Scalar
    f_upper: Scalar
    sign: Scalar
    slack: Scalar  # how far the next point may lie from the middle
    initial: Scalar  # first width


class Crossing(optx.AbstractRootFinder):
    """The ITP method (Oliveira and Takahashi, ACM Trans. Math. Softw. 47, 2020): bisection's guarantee at secant speed.

    The zero lies between `options["lower"]` and `options["upper"]`. Where the function jumps over zero, the jump is
    found; where it does not change sign, an end of the interval. `rtol` bounds the error relative to the abscissa.
    """

    rtol: float = 1e-15
    atol: float = 1e-300
    norm: Callable[[Any], Any] = jnp.abs

    def init(
        self, fn: Any, y: Any, args: Any, options: dict[str, Any], f_struct: Any, aux_struct: Any, tags: Any
    ) -> _Bracket:
        lower, upper = jnp.asarray(options["lower"], float), jnp.asarray(options["upper"], float)
        at_lower, at_upper = jax.vmap(lambda x: fn(x, args)[0])(jnp.stack([lower, upper]))
        sign = jnp.where(at_lower > at_upper, -1.0, 1.0)
        width = upper - lower
        return _Bracket(lower, upper, sign * at_lower, sign * at_upper, sign, width, width)

    def step(
        self, fn: Any, y: Any, args: Any, options: dict[str, Any], state: _Bracket, tags: Any
    ) -> tuple[Scalar, _Bracket, Any]:
        x = self._next(state)
        f, aux = fn(x, args)
        rises = state.sign * f
        below = rises < 0
        lower, f_lower = jnp.where(below, x, state.lower), jnp.where(below, rises, state.f_lower)
        upper, f_upper = jnp.where(below, state.upper, x), jnp.where(below, state.f_upper, rises)
        bracket = _Bracket(lower, upper, f_lower, f_upper, state.sign, state.slack / 2, state.initial)
        return jnp.where(below, upper, x), bracket, aux

    def _next(self, s: _Bracket) -> Scalar:
        """The secant's zero, nudged towards the middle and kept near enough to it that bisection is not slower."""
        width, middle = s.upper - s.lower, (s.lower + s.upper) / 2
        rise = s.f_upper - s.f_lower
        share = jnp.where(rise > 0, -s.f_lower / jnp.where(rise > 0, rise, 1.0), 0.5)
        secant = s.lower + share * width
        towards = jnp.sign(middle - secant)
        nudge = 0.2 * width**2 / s.initial
        nudged = jnp.where(nudge <= jnp.abs(middle - secant), secant + towards * nudge, middle)
        reach = jnp.maximum(s.slack - width / 2, 0.0)
        return jnp.where(jnp.abs(nudged - middle) <= reach, nudged, middle - towards * reach)

    def terminate(
        self, fn: Any, y: Any, args: Any, options: dict[str, Any], state: _Bracket, tags: Any
    ) -> tuple[Bool[Array, ""], optx.RESULTS]:
        tolerance = self.rtol * jnp.maximum(jnp.abs(state.lower), jnp.abs(state.upper)) + self.atol
        met = (state.f_upper == 0) | (state.f_lower == 0)
        return (state.upper - state.lower <= tolerance) | met, optx.RESULTS.successful

    def postprocess(
        self, fn: Any, y: Any, aux: Any, args: Any, options: dict[str, Any], state: _Bracket, tags: Any, result: Any
    ) -> tuple[Scalar, Any, dict[str, Int[Array, ""]]]:
        return jnp.where(state.f_lower == 0, state.lower, state.upper), aux, {}
