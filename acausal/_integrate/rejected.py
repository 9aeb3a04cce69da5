"""Reverse mode through steps that fail: they are rejected, and nothing depends on them."""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .wrapper import Wrapper

Outcome = tuple[Any, Array, PyTree, Any, diffrax.RESULTS]  # what a step of a solver returns
Attempt = Callable[..., Outcome]


class Rejectable(Wrapper):
    """Steps of `solver`, of which those that fail have no derivatives."""

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride, reportIncompatibleMethodOverride]
        return self.solver.interpolation_cls

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> Any:
        return self.solver.init(terms, t0, t1, y0, args)

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return self.solver.func(terms, t0, y0, args)

    def step(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: Any, made_jump: Any) -> Outcome:
        attempt = rejectable(lambda solver, *numbers: solver.step(*numbers))
        return attempt(self.solver, terms, t0, t1, y0, args, solver_state, made_jump)


def rejectable(attempt: Attempt, core: Callable[[Any], Array] = lambda y: y) -> Attempt:
    """The step that `attempt` takes of its arguments, without derivatives where it fails. `core` is what is integrated.

    A step may be so long that the equations have no root at its end. It is NaN then, and so are its slopes; the
    controller rejects it, but reverse mode would multiply what is not used, zero, by these slopes. So the tangents of
    all arguments and of the outcome are replaced by zero where the error of the step is not finite; transposed, that
    replaces the cotangents.
    """
    return _masked(lambda *args: _harmless(attempt(*args), core), lambda outcome: jnp.all(jnp.isfinite(outcome[1])))


def _harmless(outcome: Outcome, core: Callable[[Any], Array]) -> Outcome:
    """The outcome of a step; of a failed one the error is infinite, and what else is not finite is zero."""
    y, error, *others = outcome
    is_good = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(core(y)))
    finite = jax.tree.map(lambda x: jnp.where(is_good | jnp.isfinite(x), x, jnp.zeros_like(x)), (y, *others))
    return finite[0], jnp.where(is_good, error, jnp.inf), *finite[1:]


def _masked(function: Callable[..., PyTree], is_good: Callable[[PyTree], Array]) -> Callable[..., PyTree]:
    """A function whose derivatives are zero where its value is not good."""

    def pushed(primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]) -> tuple[PyTree, PyTree]:
        moves = jax.tree.map(lambda dx: dx is not None, tangents, is_leaf=lambda dx: dx is None)
        moving, held = eqx.partition(primals, moves)

        def of_moving(moving: PyTree) -> tuple[PyTree, PyTree]:
            return eqx.partition(function(*eqx.combine(moving, held)), eqx.is_inexact_array)

        changing, push, rest = jax.linearize(of_moving, moving, has_aux=True)
        value = eqx.combine(changing, rest)

        def where_good(tangents: PyTree) -> PyTree:
            return jax.tree.map(lambda dx: jnp.where(is_good(value), dx, 0.0), tangents)

        return value, where_good(push(where_good(tangents)))

    masked = eqx.filter_custom_jvp(function)
    masked.def_jvp(pushed)
    return masked
