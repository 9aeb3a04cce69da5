"""Elements of joined arrays that equations read alone."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import pytest

from acausal import Component, Equations, Scalar, Var, eq, simulate
from acausal._jax_private import jaxpr_as_fun
from acausal._reduce.jaxpr import slice_output
from acausal._reduce.single_elements import with_single_elements

FIRST_ONLY: list[Callable[[Any, Any], Any]] = [
    lambda a, b: jnp.stack([a, b])[0],
    lambda a, b: jnp.array([b, 2.0 * a])[1],
    lambda a, b: jnp.stack([jnp.stack([b, a]), jnp.stack([a, b])]).T[0, 1],
    lambda a, b: jnp.concatenate([jnp.stack([b, b]), a[None], b[None]])[2:][0],
    lambda a, b: jnp.stack([b, a]).reshape(2, 1)[::-1][0, 0] * jnp.stack([jnp.asarray(3.0), b])[0],
]


@pytest.mark.parametrize("function", FIRST_ONLY)
def test_only_the_picked_element_is_read(function: Callable[[Any, Any], Any]) -> None:
    program = with_single_elements(jax.make_jaxpr(function)(1.5, 2.5))
    assert slice_output(program, 0).used == (0,)
    assert jaxpr_as_fun(program)(1.5, 2.5)[0] == function(jnp.asarray(1.5), jnp.asarray(2.5))


def test_whole_arrays_stay() -> None:
    program = with_single_elements(jax.make_jaxpr(lambda a, b: jnp.dot(jnp.stack([a, b]), jnp.stack([b, a])))(1.5, 2.5))
    assert jaxpr_as_fun(program)(1.5, 2.5)[0] == 7.5


class Adaptor(Component):
    """Two stores in parallel, one of which is behind signals: a value, and its rate, which is not read."""

    v: Var[Scalar, "1"] = 1.0
    w: Var[Scalar, "1"] = 0.0
    flow: Var[Scalar, "1"] = 0.0
    rate: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return {
            "first": eq(2.0 * d.v, -self.v - self.flow, check_units=False),
            "rate": eq(self.rate, d.v, check_units=False),
            "signal": eq(self.w, jnp.stack([self.v, self.rate])[0]),
            "second": eq(0.5 * d.w, self.flow, check_units=False),
        }


def test_an_element_of_an_array_is_differentiated_alone() -> None:
    solution = simulate(Adaptor(), 1.0, save="end", rtol=1e-9)
    assert jnp.allclose(solution["v"][-1], jnp.exp(-1.0 / 2.5), rtol=1e-7)
