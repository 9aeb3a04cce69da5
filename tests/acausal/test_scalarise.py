"""Arrays taken apart into elements."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from acausal import Component, Equations, Param, Scalar, Var, Vector, eq, positive, shape, simulate
from acausal._reduce.class_equations import templates
from acausal._reduce.flatten import flatten
from acausal._reduce.scalarise import element_values, objects

MATRIX = jnp.asarray(np.random.default_rng(0).normal(size=(6, 6)))

# Functions of an array of any length between 3 and 6 and a scalar, to an array of at least 3 elements.
STAGES: dict[str, Callable[[Any, Any], Any]] = {
    "head": lambda v, s: jnp.concatenate([v[:-1], v[:1] * s]),
    "tail": lambda v, s: jnp.concatenate([v[1:], jnp.array([2.0])]),
    "every second": lambda v, s: jnp.concatenate([v[::2], v[1::2]]),
    "reversed": lambda v, s: v[::-1],
    "dot with a matrix": lambda v, s: MATRIX[: len(v), : len(v)] @ v,
    "dot from the left": lambda v, s: v @ MATRIX[: len(v), : len(v)],
    "inner product": lambda v, s: jnp.dot(v, v[::-1]) * jnp.arange(1.0, 5.0),
    "broadcast scalar": lambda v, s: s + v * s,
    "sum": lambda v, s: v - jnp.sum(v),
    "sum over an axis": lambda v, s: jnp.sum(v[:, None] * MATRIX[: len(v), :4], axis=0),
    "outer": lambda v, s: (v[:, None] + v[None, :])[1],
    "transposed": lambda v, s: jnp.outer(v, MATRIX[0, : len(v)]).T[:, 1],
    "reshaped": lambda v, s: jnp.stack([v, -v]).reshape(-1)[:5],
    "picked": lambda v, s: v[jnp.array([2, 0, 1, 2])],
    "rolled": lambda v, s: jnp.roll(v, 1),
    "chosen": lambda v, s: jnp.where(v > s, v, s),
    "elementwise": lambda v, s: jnp.tanh(v) + v**2 - jnp.exp(-(v**2)),
    "cumulated": lambda v, s: jnp.cumsum(v),
    "largest": lambda v, s: v / (1.0 + jnp.max(jnp.abs(v))),
    "jitted": lambda v, s: jax.jit(lambda w: 2.0 * w - s)(v),
}


@pytest.mark.thorough
@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(sorted(STAGES)), min_size=1, max_size=3), st.integers(3, 6), st.integers(0, 2**31))
def test_element_values_equal_the_array(names: list[str], n: int, seed: int) -> None:
    def function(v: Scalar, s: Any) -> Any:
        for name in names:
            v = STAGES[name](v, s)
        return v

    *vector, scalar = np.random.default_rng(seed).normal(size=n + 1)
    closed = jax.make_jaxpr(function)(jnp.asarray(vector), jnp.asarray(scalar))
    taken_apart = [objects([jnp.asarray(x) for x in vector], (n,)), objects([jnp.asarray(scalar)], ())]
    elements = element_values(closed, taken_apart)
    expected = function(jnp.asarray(vector), jnp.asarray(scalar))
    assert elements.shape == expected.shape
    np.testing.assert_allclose([float(x) for x in elements.ravel()], np.ravel(expected), rtol=1e-12, atol=1e-12)


class Rod(Component):
    """Heat along a rod: hot at the left end, insulated at the right one."""

    n: int
    a: Param[Scalar, "1/s", positive]
    hot: Param[Scalar, "K"]
    T: Var[Vector, "K", shape("n")] = 300.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        return dict(
            conduction=eq(d.T[1:-1], self.a * (self.T[:-2] - 2.0 * self.T[1:-1] + self.T[2:])),
            left=eq(self.T[0], self.hot),
            right=eq(self.T[-1], self.T[-2]),
        )


def test_incidence_of_a_stencil_is_exact() -> None:
    (instances,) = flatten(Rod(n=6, a=1.0, hot=400.0), split=True).instances
    found = {
        template.name: {(template.inputs[i].order, template.inputs[i].element) for i in template.unknowns}
        for template in templates(instances.kind, split=True)
    }
    interior = {f"conduction[{i}]": {(1, i + 1), (0, i), (0, i + 1), (0, i + 2)} for i in range(4)}
    assert found == interior | {"left": {(0, 0)}, "right": {(0, 4), (0, 5)}}


@pytest.mark.thorough
def test_rod_against_the_matrix_exponential() -> None:
    n, a, hot, t = 6, 1.7, 400.0, 0.8
    start = np.array([hot, 290.0, 300.0, 295.0, 310.0, 310.0])
    sol = simulate(Rod(n=n, a=a, hot=hot, T=jnp.asarray(start)), t, save="end", rtol=1e-10)
    # u = T - hot vanishes at the left end; at the right one, u5 = u4.
    matrix = a * (np.diag(np.full(4, -2.0)) + np.diag(np.ones(3), 1) + np.diag(np.ones(3), -1))
    matrix[-1, -1] += a
    interior = hot + expm(matrix * t) @ (start[1:-1] - hot)
    np.testing.assert_allclose(sol.final.T, [hot, *interior, interior[-1]], rtol=1e-9)
    np.testing.assert_allclose(sol["T[3]"][-1], interior[2], rtol=1e-9)


class Whirled(Component):
    """A rod that friction brakes turns a mass on a circle; array equations hold the mass, a scalar one the torque."""

    m: Param[Scalar, "kg"] = 2.0
    radius: Param[Scalar, "m"] = 0.5
    c: Param[Scalar, "N.m.s", positive] = 0.3
    phi: Var[Scalar, "rad"] = 0.0
    w: Var[Scalar, "rad/s"] = 0.0
    tau: Var[Scalar, "N.m"] = 0.0
    r: Var[Vector, "m", shape(2)] = 0.0  # pyright: ignore[reportAssignmentType]
    v: Var[Vector, "m/s", shape(2)] = 0.0  # pyright: ignore[reportAssignmentType]
    f: Var[Vector, "N", shape(2)] = 0.0  # pyright: ignore[reportAssignmentType]
    tension: Var[Scalar, "N"] = 0.0

    def equations(self, d: Self) -> Equations:
        outward = jnp.stack([jnp.cos(self.phi), jnp.sin(self.phi)])
        along = jnp.stack([-jnp.sin(self.phi), jnp.cos(self.phi)])
        return dict(
            speed=eq(self.w, d.phi),
            position=eq(self.r, self.radius * outward),
            velocity=eq(self.v, d.r),
            newton=eq(self.m * d.v, self.f),
            torque=eq(self.tau, self.radius * jnp.dot(along, self.f)),
            friction=eq(self.tau, -self.c * self.w),
            tension=eq(self.tension, jnp.dot(outward, self.f)),
        )


def test_array_whose_elements_others_determine_is_taken_apart() -> None:
    """The torque gives one element of the force, the circle the other one."""
    sol = simulate(Whirled(w=3.0), 0.4, save="end", rtol=1e-9)
    np.testing.assert_allclose(sol.final.w, 3.0 * np.exp(-0.3 * 0.4 / (2.0 * 0.5**2)), rtol=1e-8)
    np.testing.assert_allclose(sol.final.tension, -2.0 * 0.5 * sol.final.w**2, rtol=1e-8)
