"""Operations, limits, switches and tables, evaluated at given inputs."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _static_blocks import output

from acausal import Component, ParameterError, replace
from acausal._declare.layout import complete
from components import blocks

U = np.array([-2.0, -0.5, 0.25, 1.0, 3.0])
BOUNDS: dict[str, Any] = {"u_min": -0.5, "u_max": 1.0}
TWO, SWITCHED = ("u1", "u2"), ("control", "u1", "u2")


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        (blocks.Gain(k=3.0), 3.0 * U),
        (blocks.Function(function=jnp.abs), np.abs(U)),
        (blocks.Limiter(**BOUNDS), [-0.5, -0.5, 0.25, 1.0, 1.0]),
        (blocks.DeadZone(**BOUNDS), [-1.5, 0.0, 0.0, 0.0, 2.0]),
    ],
    ids=lambda item: type(item).__name__ if isinstance(item, Component) else "",
)
def test_one_input(block: Component, expected: np.ndarray) -> None:
    np.testing.assert_allclose(output(block, U), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        (blocks.Sum(k1=2.0, k2=-1.0), 2.0 * U - U[::-1]),
        (blocks.Product(), U * U[::-1]),
        (blocks.Division(), U / U[::-1]),
        (blocks.Minimum(), np.minimum(U, U[::-1])),
        (blocks.Maximum(), np.maximum(U, U[::-1])),
    ],
    ids=lambda item: type(item).__name__ if isinstance(item, Component) else "",
)
def test_two_inputs(block: Component, expected: np.ndarray) -> None:
    np.testing.assert_allclose(output(block, U, U[::-1], names=TWO), expected, rtol=1e-14)


def test_switches() -> None:
    control = np.array([-1.0, 0.49, 0.5, 0.9, 2.0])
    hard = output(blocks.Switch(), control, U, -U, names=SWITCHED)
    np.testing.assert_array_equal(hard, np.where(control < 0.5, -U, U))
    smooth = output(blocks.SmoothSwitch(width=0.1, threshold=0.8), control, U, -U, names=SWITCHED)
    np.testing.assert_allclose(smooth, U * np.tanh((control - 0.8) / 0.2), atol=1e-14)


def test_averaged_pulse_width_modulation() -> None:
    duty, supply = [-1.5, -0.5, 0.0, 0.5, 1.5], np.full(5, 24.0)
    names = ("duty", "supply")
    one_way = output(blocks.PWMAverage(), duty, supply, names=names)
    np.testing.assert_array_equal(one_way, [0.0, 0.0, 0.0, 12.0, 24.0])
    both_ways = output(blocks.PWMAverage(duty_min=-1.0), duty, supply, names=names)
    np.testing.assert_array_equal(both_ways, [-24.0, -12.0, 0.0, 12.0, 24.0])


POINTS = jnp.array([0.0, 1.0, 3.0, 4.0])
VALUES = jnp.array([1.0, 3.0, 2.0, 2.5])


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("extrapolation", ["hold", "linear"])
def test_table_1d(smooth: bool, extrapolation: blocks.Extrapolation) -> None:
    """It passes through its samples and extrapolates as documented; the linear table agrees with numpy."""
    table = blocks.Table1D(points=POINTS, values=VALUES, smooth=smooth, extrapolation=extrapolation)
    np.testing.assert_allclose(output(table, POINTS), VALUES, atol=1e-14)
    beyond = [1.0, 2.5] if extrapolation == "hold" else [-1.0, 3.5]
    np.testing.assert_allclose(output(table, [-1.0, 6.0]), beyond, atol=1e-14)
    if not smooth:
        u = np.linspace(0.0, 4.0, 17)
        np.testing.assert_allclose(output(table, u), np.interp(u, POINTS, VALUES), atol=1e-14)


@pytest.mark.thorough
def test_table_1d_is_differentiable_in_its_samples() -> None:
    """d y / d values is the interpolation of the unit samples for straight lines; finite differences for the cubic."""

    def at(values: jax.Array, smooth: bool) -> jax.Array:
        return output(blocks.Table1D(points=POINTS, values=values, smooth=smooth), [0.6, 2.5])

    exact = [[0.4, 0.6, 0.0, 0.0], [0.0, 0.25, 0.75, 0.0]]
    np.testing.assert_allclose(jax.jacrev(at)(VALUES, False), exact, atol=1e-14)
    steps = 1e-6 * np.eye(4)
    differences = [(at(VALUES + step, True) - at(VALUES - step, True)) / 2e-6 for step in steps]
    np.testing.assert_allclose(jax.jacfwd(at)(VALUES, True), np.stack(differences, axis=1), atol=1e-8)


GRID: dict[str, Any] = {"points1": jnp.array([0.0, 1.0, 3.0, 4.0]), "points2": jnp.array([-1.0, 0.5, 2.0])}


def surface(smooth: bool, extrapolation: blocks.Extrapolation = "hold") -> blocks.Table2D:
    u1, u2 = np.meshgrid(*GRID.values(), indexing="ij")
    values = jnp.asarray((u1**2 - u1) * (1.0 + u2) if smooth else 2.0 + u1 - u2 + 3.0 * u1 * u2)
    return blocks.Table2D(**GRID, values=values, smooth=smooth, extrapolation=extrapolation)


@pytest.mark.parametrize("smooth", [True, False])
def test_table_2d_passes_its_samples(smooth: bool) -> None:
    table = surface(smooth)
    u1, u2 = (np.ravel(axis) for axis in np.meshgrid(*GRID.values(), indexing="ij"))
    np.testing.assert_allclose(output(table, u1, u2, names=TWO), np.ravel(table.values), atol=1e-13)


def test_bilinear_table_reproduces_a_bilinear_function_also_beyond_it() -> None:
    u1, u2 = np.array([0.3, 2.0, 3.9, 5.0, -1.0]), np.array([-0.7, 1.0, 2.0, 3.0, -2.0])
    found = output(surface(False, "linear"), u1, u2, names=TWO)
    np.testing.assert_allclose(found, 2.0 + u1 - u2 + 3.0 * u1 * u2, rtol=1e-13)
    held = output(surface(False), [5.0], [3.0], names=TWO)
    np.testing.assert_allclose(held, [2.0 + 4.0 - 2.0 + 24.0], rtol=1e-13)


def test_bicubic_table_is_exact_for_parabolas_inside_and_has_continuous_slopes() -> None:
    """Slopes by parabolas are those of a parabola at inner knots; across a knot the slope does not jump."""
    table = surface(True)
    u1, u2 = np.linspace(1.0, 3.0, 9), np.linspace(-1.0, 2.0, 9)
    np.testing.assert_allclose(output(table, u1, u2, names=TWO), (u1**2 - u1) * (1.0 + u2), atol=1e-12)
    slope = jax.vmap(jax.grad(lambda u1, u2: output(table, u1[None], u2[None], names=TWO)[0], argnums=(0, 1)))
    left, right = (slope(jnp.full(5, 1.0 + e), jnp.linspace(-0.8, 1.8, 5)) for e in (-1e-9, 1e-9))
    np.testing.assert_allclose(left, right, atol=1e-6)


def test_weighted_sum_has_as_many_inputs_as_weights() -> None:
    block = blocks.WeightedSum(k=[1.0, -2.0, 0.5])
    filled = complete(replace(block, {f"u[{i}].value": value for i, value in enumerate([3.0, 1.0, 4.0])}))
    (equation,) = filled.equations(filled).values()
    assert len(block.u) == 3
    assert -equation.residual == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: blocks.Limiter(u_min=1.0, u_max=0.0), "Limiter.u_min must be smaller than u_max"),
        (lambda: blocks.LimPI(k=1.0, Ti=1.0, y_min=1.0, y_max=1.0), "LimPI.y_min must be smaller than y_max"),
        (lambda: blocks.LimPI(k=0.0, Ti=1.0, y_min=0.0, y_max=1.0), "LimPI.k must be nonzero"),
        (lambda: blocks.Table1D(points=POINTS, values=VALUES[1:]), r"Table1D.values must have shape \(4,\)"),
        (lambda: blocks.Table1D(points=POINTS[:1], values=VALUES[:1]), "Table1D.points must be two or more"),
        (lambda: blocks.Table1D(points=POINTS, values=VALUES, extrapolation="no"), "must be 'hold' or 'linear'"),  # pyright: ignore[reportArgumentType]
        (lambda: blocks.Table2D(**GRID, values=jnp.zeros((3, 4))), r"Table2D.values must have shape \(4, 3\)"),
        (lambda: blocks.TransferFunction(b=[1.0, 0.0], a=[1.0]), "TransferFunction needs a denominator of order 1"),
        (lambda: blocks.TransferFunction(b=[1.0], a=[0.0, 1.0]), "TransferFunction.a must start with a nonzero"),
        (lambda: blocks.TransferFunction(b=[1.0], a=[1.0, 1.0], x=jnp.ones(3)), "TransferFunction.x must have shape"),
        (lambda: blocks.StateSpace(A=jnp.eye(2), B=jnp.ones(2), C=jnp.ones((1, 2))), "StateSpace needs arrays"),
        (
            lambda: blocks.StateSpace(A=jnp.eye(2), B=jnp.ones((3, 1)), C=jnp.ones((1, 2))),
            r"StateSpace.B must have shape \(2, 1\)",
        ),
        (
            lambda: blocks.Trapezoid(amplitude=1.0, period=1.0, rising=0.5, width=0.3, falling=0.3),
            "Trapezoid.period must be at least rising",
        ),
        (lambda: blocks.Pulse(amplitude=1.0, period=1.0, width=1.5), "Pulse.width must be at most 1"),
    ],
)
def test_bad_parameters(build, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        build()
