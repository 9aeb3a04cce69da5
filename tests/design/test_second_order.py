"""Certificates against brute force: saddles, degenerate corners, other units, and what has no minimum."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_control import THERE, cart, lines, steps

from acausal import Component, Param, Scalar
from acausal.design import Curvature, Design, Experiment, control, identify, optimise, pareto
from acausal.design._certificate.first_order import Point, multipliers_of
from acausal.design._certificate.second_order import curvature_of, quadratic_of
from acausal.design._optimise.descent import descended, polished
from acausal.design._optimise.solve import solve

NONE = np.zeros(0, bool)
UNIT: Any = {"x": (-2.0, 2.0), "y": (-2.0, 2.0)}
SEEDS = st.integers(0, 2**32 - 1)


class Plane(Component):
    """Two numbers, of whichever function a test has."""

    x: Param[Scalar, "1"] = 0.0
    y: Param[Scalar, "1"] = 0.0


def box(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(n), np.ones(n)


def quartic(matrix: np.ndarray, centre: np.ndarray) -> Callable[[np.ndarray], Point]:
    """f = d'Ad/2 + |d|^4/4 with d = z - centre."""

    def at(z: np.ndarray) -> Point:
        d = z - centre
        square = float(d @ d)
        value = 0.5 * float(d @ matrix @ d) + 0.25 * square**2
        return Point(np.array(z), value, matrix @ d + square * d, NONE, np.zeros((0, len(z))))

    return at


def curvature_at(at: Callable[[np.ndarray], Point], z: np.ndarray) -> Curvature:
    point, bounds = at(z), box(len(z))
    quadratic = quadratic_of(at, point, multipliers_of(point, bounds, NONE), bounds, NONE, np.zeros(len(z), bool))
    return curvature_of(at, point, quadratic, bounds, NONE)


def symmetric(random: np.random.Generator, n: int) -> np.ndarray:
    square = random.normal(size=(n, n))
    return square + square.T


@given(SEEDS, st.integers(1, 4))
@settings(max_examples=60, deadline=None)
def test_a_search_from_a_symmetric_place_ends_at_a_local_minimum(seed: int, n: int) -> None:
    """f is even in some of the variables, and the search starts where its slope by these is zero."""
    random = np.random.default_rng(seed)
    matrix, even = symmetric(random, n), random.random(n) < 0.6
    matrix[even[:, None] != even] = 0.0
    at, bounds = quartic(matrix, np.full(n, 0.5)), box(n)
    start = np.where(even, 0.5, random.random(n))

    def solver(z: np.ndarray) -> np.ndarray:
        return polished(at, solve(at, z, bounds, NONE), bounds, NONE)

    end = descended(at, start, bounds, NONE, lambda z: np.zeros(n, bool), solver)
    around = np.clip(end.z + random.normal(scale=1e-2, size=(500, n)), *bounds)
    assert min(at(z).f for z in around) >= end.f - 1e-9
    assert curvature_at(at, end.z).is_minimum


@example(117, 1)  # a curvature about as small as the error of its differences
@given(SEEDS, st.integers(1, 4))
@settings(max_examples=100, deadline=None)
def test_a_corner_without_slope_is_a_minimum_if_its_curvature_is_copositive(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    matrix = symmetric(random, n) + random.choice([0.0, 1.0, 4.0]) * np.abs(symmetric(random, n))
    corner = random.integers(0, 2, n).astype(float)
    inward = 1.0 - 2.0 * corner
    found = curvature_at(quartic(matrix, corner), corner)
    directions = np.abs(random.normal(size=(4000, n))) * (random.random((4000, n)) < 0.7) * inward
    lengths = np.linalg.norm(directions, axis=1)
    directions = directions[lengths > 0.0] / lengths[lengths > 0.0, None]
    least = float(np.min(np.einsum("ki,ij,kj->k", directions, matrix, directions)))
    assert found.least <= least + 1e-6
    assert found.is_minimum == (found.least > 0.0)
    if n <= 2:  # where samples are dense
        assert found.least == pytest.approx(least, abs=1e-2 * np.max(np.abs(matrix)) + found.error)


def bowl(m: Any) -> Any:
    return (m.x - 1.0) ** 2 + (m.y + 0.5) ** 2 + 0.3 * m.x * m.y + 0.1 * jnp.sin(3.0 * m.x)


@pytest.mark.thorough
@given(st.floats(-12.0, 12.0), st.floats(-3.0, 3.0), st.floats(-6.0, 6.0), st.integers(0, 3))
@settings(max_examples=8, deadline=None)
def test_units_of_the_objective_and_of_variables_change_nothing(
    decades: float, offset: float, length: float, corner: int
) -> None:
    """An objective of another unit and with another constant, and a variable of another unit."""
    factor, unit = 10.0**decades, 10.0**length
    high = [(2.0, 2.0), (0.5, 2.0), (2.0, -1.0), (0.5, -1.0)][corner]

    def found(factor: float, offset: float, unit: float) -> Design[Plane]:
        return optimise(
            Plane(x=0.3 * unit, y=-1.2), {"x": (-2.0 * unit, high[0] * unit), "y": (-2.0, high[1])},
            lambda m: factor * (bowl(Plane(x=m.x / unit, y=m.y)) + 10.0 * offset), sensitivities=False,
        )  # fmt: skip

    one, other = found(1.0, 0.0, 1.0), found(factor, offset, unit)
    assert other.status == one.status == "optimal"
    np.testing.assert_allclose(other.x / [unit, 1.0], one.x, atol=1e-6)
    # A multiplier is a price: objective per unit of the variable.
    sizes = {"x": factor / unit, "y": factor}
    for name, price in one.multipliers.items():
        assert other.multipliers[name] == pytest.approx(sizes[name] * price, rel=1e-5)


@pytest.mark.parametrize("share", [1e-3, 1e-7, 1e-9])
def test_a_small_change_of_a_large_objective_is_minimised(share: float) -> None:
    design = optimise(Plane(x=0.3, y=0.2), UNIT, lambda m: 1.0 + share * bowl(m), sensitivities=False)
    best = optimise(Plane(x=0.3, y=0.2), UNIT, bowl, sensitivities=False)
    assert design.status == "optimal"
    np.testing.assert_allclose(design.x, best.x, atol=1e-6)


SADDLES: dict[str, tuple[Callable[[Any], Any], Sequence[float], float]] = {
    "saddle": (lambda m: m.x**2 - m.y**2, (1.0, 0.0), -4.0),
    "inflection": (lambda m: m.x**3 + m.y**2, (0.0, 1.0), -8.0),
    "top": (lambda m: m.x**2 + jnp.cos(m.y), (1.0, 0.0), math.cos(2.0)),
    "flat top": (lambda m: m.x**2 - m.y**4, (1.0, 0.0), -16.0),
    "monkey saddle": (lambda m: m.x**3 - 3.0 * m.x * m.y**2, (0.0, 0.0), -8.0),
    "slider-crank": (lambda m: jnp.sqrt(9.0 - m.y**2) - jnp.sqrt(25.0 - m.y**2) + m.x**2, (1.0, 0.0), 5**0.5 - 21**0.5),
}


@pytest.mark.parametrize("name", SADDLES)
def test_a_variable_without_slope_where_the_search_begins_is_not_idle(name: str) -> None:
    function, (x, y), least = SADDLES[name]
    design = optimise(Plane(x=x, y=y), UNIT, function, sensitivities=False)
    assert design.idle == ()
    assert design.status == "optimal"
    assert design.objective == pytest.approx(least, rel=1e-9)


def test_a_maximum_on_a_circle_is_left() -> None:
    circle: Any = {"circle": (lambda m: m.x**2 + m.y**2, "== 1")}
    design = optimise(Plane(x=1.0), UNIT, lambda m: m.x**2, constraints=circle, sensitivities=False)
    assert design.status == "optimal"
    np.testing.assert_allclose(np.abs(design.x), [0.0, 1.0], atol=1e-6)


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.5, 0.2)])
def test_a_minimum_that_is_not_a_strict_one_is_said_to_be_flat(start: tuple[float, float]) -> None:
    design = optimise(
        Plane(x=start[0], y=start[1]), {"x": (0.0, 1.0), "y": (0.0, 1.0)}, lambda m: m.x * m.y + 1.0,
        sensitivities=False,
    )  # fmt: skip
    assert design.objective == 1.0
    assert design.status == "optimal"
    assert "a local minimum, flat in some directions" in str(design)


@pytest.mark.parametrize("low", [None, 0.0])
def test_what_falls_towards_a_limit_for_ever_has_no_minimum(low: float | None) -> None:
    design = optimise(Plane(x=1.0), {"x": (low, None)}, lambda m: jnp.exp(-m.x), sensitivities=False)
    assert design.status == "not converged"
    assert "not a minimum: the Newton step leads" in str(design)


@pytest.mark.thorough
def test_limits_without_a_constraint_qualification_are_named() -> None:
    square: Any = {"square": (lambda m: m.x**2, "<= 0")}
    design = optimise(Plane(x=1.0, y=1.0), UNIT, lambda m: m.x + m.y**2, constraints=square, sensitivities=False)
    assert design.status == "not converged"
    assert design.unqualified == ("square (<=)",)
    assert design.multipliers == {}
    assert "no constraint qualification holds. The gradients of square (<=)" in str(design)
    touching: Any = {
        "left": (lambda m: (m.x + 1.0) ** 2 + m.y**2, "<= 1"), "right": (lambda m: (m.x - 1.0) ** 2 + m.y**2, "<= 1"),
    }  # fmt: skip
    design = optimise(Plane(y=0.5), UNIT, lambda m: m.y, constraints=touching, sensitivities=False)
    assert design.status == "not converged"
    assert set(design.unqualified) == {"left (<=)", "right (<=)"}


@pytest.mark.parametrize("start", [1e-10, 1e-6, 0.0, 1.0])
@pytest.mark.parametrize("best", [3.0, 3e3])
def test_sizes_of_variables_without_bounds_follow_the_objective(start: float, best: float) -> None:
    free: Any = {"x": None, "y": (None, None)}
    design = optimise(
        Plane(x=start, y=start), free, lambda m: (m.x - best) ** 2 + (m.y - 1.0) ** 2, sensitivities=False
    )
    assert design.status == "optimal"
    np.testing.assert_allclose(design.x, [best, 1.0], rtol=1e-6)


def test_a_front_that_is_not_convex_is_found_from_a_place_without_slope() -> None:
    """ZDT2 (Zitzler, Deb and Thiele, Evol. Comput. 8 (2000) 173): f2 = 1 - f1^2."""

    def second(m: Any) -> Any:
        share = 1.0 + 9.0 * m.y
        return share * (1.0 - (m.x / share) ** 2)

    front = pareto(
        Plane(x=0.5, y=0.5), {"x": (0.0, 1.0), "y": (0.0, 1.0)}, {"f1": lambda m: m.x, "f2": second}, points=5
    )
    np.testing.assert_allclose(front.values[:, 1], [1.0, 0.75, 0.5, 0.25, 0.0], atol=1e-7)
    np.testing.assert_allclose(front.values[:, 0], np.sqrt(1.0 - front.values[:, 1]), atol=1e-7)
    assert [design.status for design in front.designs] == ["optimal"] * 5


@pytest.mark.slow
@pytest.mark.parametrize("guess", [(1.0, 2.0, 1.0, 1e-6, -1.0, -3.0), (0.0,) * 6, (1e-6,) * 6])
def test_samples_of_a_signal_have_one_size(guess: tuple[float, ...]) -> None:
    course = control(
        cart(lines(*guess)), {"command": None}, 0.8, {"cost": lambda s: s.force.u.value**2}, end=THERE,
        sensitivities=False,
    )  # fmt: skip
    assert course.design.status == "optimal"
    assert course.design.objective == pytest.approx(93.75, rel=1e-9)  # 12 m^2 d^2 / T^3


@pytest.mark.slow
@pytest.mark.parametrize("guess", [(0.0, 0.0), (-10.0, 10.0), (10.0, 10.0)])
def test_soonest_from_a_poor_guess(guess: tuple[float, ...]) -> None:
    bounds: Any = {"command": ("-10 N", "10 N")}
    course = control(cart(steps(*guess)), bounds, ("0.1 s", "5 s"), end=THERE, sensitivities=False)
    assert course.design.status == "optimal"
    assert course.duration == pytest.approx(2.0 * math.sqrt(2.5 * 0.8 / 10.0), rel=1e-9)


T = np.linspace(0.0, 1.0, 21)
NOISE = 0.01 * np.sin(37.0 * T)
SQUARES: dict[str, tuple[Callable[[Any], Any], np.ndarray]] = {
    "square": (lambda m: m.x * T + m.y**2, 3.0 * T + 1.0 + NOISE),
    "cosine": (lambda m: m.x * T + jnp.cos(m.y), 3.0 * T + 0.5 + NOISE),
    # Each residual has a slope by y, and both slopes cancel.
    "opposite": (lambda m: jnp.stack([m.x * T + m.y + m.y**2, m.x * T - m.y + m.y**2]), np.stack([3.0 * T + 4.0] * 2)),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", SQUARES)
def test_a_fit_leaves_a_saddle_of_the_sum_of_squares(name: str) -> None:
    function, measured = SQUARES[name]
    experiment = Experiment(lambda m: {"v": function(m)}, {"v": measured}, {"v": 0.01})
    free = {"x": (-10.0, 10.0), "y": (-3.0, 3.0)}
    still, moved = (identify(Plane(x=1.0, y=y), free, experiment) for y in (0.0, 0.3))
    assert still.chi2 == pytest.approx(moved.chi2, rel=1e-9)
    np.testing.assert_allclose(np.abs(still.estimates), np.abs(moved.estimates), rtol=1e-6)
    assert still.rank == 2
