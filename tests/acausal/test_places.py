"""Functions evaluated at several places of a program are traced once, and have the numbers of each place."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Var, eq, replace, structure
from acausal._evaluate import groups


class Cooling(Component):
    """x' = -k x^2."""

    k: Param[Scalar, "1/s"] = 1.0
    x: Var[Scalar, ""] = 1.0
    z: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, -self.k * self.z), square=eq(self.z, self.x**2))


@pytest.mark.thorough
def test_another_place_traces_no_equation(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Cooling()
    system = structure(model).system
    traced: list[Any] = []
    run = groups.evaluate_block
    monkeypatch.setattr(groups, "evaluate_block", lambda *args: traced.append(args[0]) or run(*args))

    def at_two_places(k: Any, y: Any) -> Any:
        rates = [system.vector_field(0.0, x, system.pack(replace(model, {"k": j}))) for j, x in ((k, y), (2.0 * k, -y))]
        return jnp.concatenate(rates)

    def expected(k: Any, y: Any) -> Any:
        return jnp.concatenate([-k * y**2, -2.0 * k * y**2])

    k, y = jnp.array(3.0), jnp.array([0.5])
    np.testing.assert_allclose(jax.jit(at_two_places)(k, y), expected(k, y))
    assert len(traced) == len(system.plan.groups)
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(at_two_places)(k, y), derivative(expected)(k, y))
    batch = jnp.array([[0.5], [-1.0], [2.0]])
    np.testing.assert_allclose(jax.vmap(at_two_places, (None, 0))(k, batch), jax.vmap(expected, (None, 0))(k, batch))
