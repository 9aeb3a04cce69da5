"""Derivatives past a jump of the equations at which a state passes a limit."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, JumpWarning, Param, Scalar, Var, eq, ifelse, simulate

END = 1.0


class Rising(Component):
    """x' = a up to x = c and b beyond; y' = x y."""

    a: Param[Scalar, "1/s"]
    b: Param[Scalar, "1/s"]
    c: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        rate = ifelse(self.x > self.c, self.b, self.a)
        return dict(x=eq(d.x, rate), y=eq(d.y, self.x * self.y, check_units=False))


def end(numbers: Any) -> Any:
    a, b, c = numbers
    final = simulate(Rising(a=a, b=b, c=c), END, save="end", rtol=1e-9, throw=False).final
    return jnp.stack([final.x, final.y])


def exactly(numbers: Any) -> Any:
    """For c within the run."""
    a, b, c = numbers
    after = END - c / a
    x = c + b * after
    return jnp.stack([x, jnp.exp(0.5 * c**2 / a + 0.5 * (c + x) * after)])


# The limit is passed half-way or earlier; nothing jumps where a = b.
POINTS = jnp.array([[1.0, 3.0, 0.3], [2.0, 0.5, 0.5], [1.0, 0.0, 0.5], [1.5, 1.5, 0.5]])


@pytest.fixture(scope="module")
def found() -> Any:
    """Values, and derivatives in both modes."""
    return jax.jit(jax.vmap(lambda numbers: (end(numbers), jax.jacfwd(end)(numbers), jax.jacrev(end)(numbers))))(POINTS)


@pytest.mark.thorough
def test_values(found: Any) -> None:
    np.testing.assert_allclose(found[0], jax.vmap(exactly)(POINTS), rtol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [1, 2], ids=["forward", "reverse"])
def test_derivatives(found: Any, mode: int) -> None:
    np.testing.assert_allclose(found[mode], jax.vmap(jax.jacfwd(exactly))(POINTS), rtol=1e-5, atol=1e-5)


class Plain(Component):
    """The same by a plain where, between fixed numbers."""

    c: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, jnp.where(self.x > self.c, 3.0, 1.0), check_units=False))


@pytest.mark.thorough
def test_a_plain_where_that_jumps_is_warned_of() -> None:
    with pytest.warns(JumpWarning, match=r"Plain\.equations: x may jump .*ifelse"):
        simulate(Plain(c=0.3), END, save="end")
