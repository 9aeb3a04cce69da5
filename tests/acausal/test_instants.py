"""Equations that change at times which are known ahead: random profiles, however short their parts are."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from acausal import Component, Equations, Param, Scalar, Time, Var, eq, simulate
from acausal._reduce.jaxpr_instants import instants

Knots = Float[Array, "6"]
Steps = Float[Array, "7"]
END = 10.0
N = 24


class Profiles(Component):
    """Integrals of functions of time, each written in one of the ways that numpy has."""

    knots: Param[Knots, "s"]
    values: Param[Knots, "1"]
    steps: Param[Steps, "1"]
    t: Time[Scalar, "s"] = 0.0
    line: Var[Scalar, "1"] = 0.0
    stair: Var[Scalar, "1"] = 0.0
    bins: Var[Scalar, "1"] = 0.0
    middle: Var[Scalar, "1"] = 0.0
    latest: Var[Scalar, "1"] = 0.0
    held: Var[Scalar, "1"] = 0.0
    branch: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        t, knots, steps = self.t, self.knots, self.steps
        rates = dict(
            line=jnp.interp(t, knots, self.values),
            stair=steps[jnp.searchsorted(knots, t)],
            bins=steps[jnp.digitize(t, knots)],
            middle=jnp.sort(jnp.stack([t, knots[0], knots[1]]))[1],
            latest=steps[jnp.argmax(jnp.stack([knots[2], t, 2.0 * t - knots[3]]))],
            held=jnp.where(jax.lax.stop_gradient(t) > knots[4], steps[0], 0.0),
            branch=jax.lax.cond(
                t < knots[2],
                lambda: jnp.where(t < knots[1], steps[1], steps[2]),
                lambda: jnp.where(t < knots[4], steps[3], steps[4]),
            ),
        )
        return {name: eq(getattr(d, name), rate, check_units=False) for name, rate in rates.items()}


NAMES = ("line", "stair", "bins", "middle", "latest", "held", "branch")


def integrals(knots: Any, values: Any, steps: Any) -> Any:
    """One step as long as the run, but for the instants."""
    model = Profiles(knots=knots, values=values, steps=steps)
    final = simulate(model, END, dt0=END, save="end", throw=False, max_steps=64).final
    return jnp.stack([getattr(final, name) for name in NAMES])


def exactly(k: Any, values: Any, s: Any) -> Any:
    widths = jnp.diff(jnp.concatenate([jnp.zeros(1), k, jnp.full(1, END)]))
    line = values[0] * k[0] + jnp.sum(widths[1:-1] * (values[1:] + values[:-1])) / 2.0 + values[-1] * widths[-1]
    stair = jnp.sum(widths * s)
    middle = k[0] ** 2 + (k[1] ** 2 - k[0] ** 2) / 2.0 + k[1] * (END - k[1])
    # t is the largest from knots[2] on; 2 t - knots[3] overtakes it at knots[3].
    latest = s[0] * k[2] + s[1] * (k[3] - k[2]) + s[2] * (END - k[3])
    branch = s[1] * k[1] + s[2] * (k[2] - k[1]) + s[3] * (k[4] - k[2]) + s[4] * (END - k[4])
    return jnp.stack([line, stair, stair, middle, latest, s[0] * (END - k[4]), branch])


def profiles(shortest: float) -> tuple[Any, Any, Any]:
    """Some with very short parts."""
    rng = np.random.default_rng(5)
    knots = np.sort(rng.uniform(0.5, 9.5, (N, 6)), axis=1)
    knots[::3, 1:] = knots[::3, :1] + np.cumsum(shortest ** rng.uniform(0.1, 1.0, (len(knots[::3]), 5)), axis=1)
    return jnp.asarray(knots), jnp.asarray(rng.normal(size=(N, 6))), jnp.asarray(rng.normal(size=(N, 7)))


@pytest.mark.thorough
def test_integrals_of_profiles() -> None:
    given = profiles(1e-9)
    found = jax.jit(jax.vmap(integrals))(*given)
    np.testing.assert_allclose(found, jax.jit(jax.vmap(exactly))(*given), rtol=1e-12, atol=1e-11)


@pytest.mark.thorough
def test_gradients_by_knots_and_samples() -> None:
    """In reverse mode; the samples of a profile that is flat count as well."""
    knots, values, steps = profiles(1e-5)
    values = values.at[1].set(0.0)
    found = jax.jit(jax.vmap(jax.jacrev(integrals, argnums=(0, 1, 2))))(knots, values, steps)
    wanted = jax.jit(jax.vmap(jax.jacrev(exactly, argnums=(0, 1, 2))))(knots, values, steps)
    for a, b in zip(found, wanted, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    "function",
    [
        lambda t: jnp.floor(2.0 * t + 0.3), lambda t: jnp.ceil(0.3 - 1.5 * t), lambda t: jnp.round(2.0 * t + 0.3),
        lambda t: jnp.sign(t - 0.4), lambda t: jnp.trunc(1.7 * t + 0.2), lambda t: jnp.floor(jnp.mod(t, 0.7) / 0.35),
        lambda t: jnp.where(2.0 * t > 0.8 - t, 1.0, 0.0),
    ],
    ids=["floor", "ceil", "round", "sign", "trunc", "mod", "where"],
)  # fmt: skip
def test_steps_are_constant_up_to_the_next_instant_and_change_there(function: Any, direction: float) -> None:
    found = instants(jax.make_jaxpr(function)(0.0), ["time"], [()])
    assert found is not None
    end, change = 0.05 + 2.0 * direction, direction * np.inf
    changes = np.diff(jax.vmap(function)(jnp.linspace(0.05, end, 2001))) != 0.0
    if np.any(changes):
        change = 0.05 + 1e-3 * direction * (0.5 + np.argmax(changes))
    instant = 0.05
    while direction * (change - instant) > 1e-3:  # some comparisons change nothing
        instant = float(found.following(jnp.asarray(instant), [], jnp.asarray(direction)))
    assert instant == change or abs(instant - change) < 1e-3
