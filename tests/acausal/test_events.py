"""Events: located, carried out in order, differentiated, and named where they do not come to an end."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _switching_models import Undoing

from acausal import (
    Array,
    Component,
    Connections,
    Discrete,
    Energy,
    Equations,
    Events,
    ModelError,
    Param,
    Result,
    Scalar,
    SimulationError,
    Time,
    Var,
    at,
    connect,
    eq,
    positive,
    repeat,
    simulate,
    when,
)
from components.rotational import IdealGear, Inertia

G = 9.81


class Ball(Component):
    """A ball that rebounds from the floor with a share e of its speed."""

    e: Param[Scalar, "1", positive] = 0.8
    m: Param[Scalar, "kg", positive] = 2.0
    g: Param[Scalar, "m/s2", positive] = G
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    impacts: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.e * self.v, impacts=self.impacts + 1.0))

    def energy(self) -> Energy:
        return Energy(stored=self.m * (0.5 * self.v**2 + self.g * self.h))


def impacts(e: Any, n: int) -> Any:
    """When a ball dropped from 1 m hits the floor: each flight takes e times as long as the one before."""
    first = np.sqrt(2.0 / G)
    flights = 2.0 * first * e ** np.arange(1, n)
    return first + np.concatenate([[0.0], np.cumsum(flights)])


def height(e: Any, t: float) -> Any:
    times = impacts(e, 40)
    n = int(np.sum(times < t))
    since = t - times[n - 1]
    return e**n * np.sqrt(2.0 * G) * since - 0.5 * G * since**2


@pytest.fixture(scope="module")
def bounced() -> Any:
    return simulate(Ball(), 3.0, rtol=1e-10, energy=True)


@pytest.mark.thorough
def test_moments_and_trajectory(bounced: Any) -> None:
    assert bounced.events.names == ["impact"] * 6
    np.testing.assert_allclose(bounced.events.times, impacts(0.8, 6), rtol=1e-12)
    np.testing.assert_allclose(bounced.final.h, height(0.8, 3.0), rtol=1e-10)
    assert bounced.final.impacts == 6.0
    assert "2.88007" in str(bounced.events)


def test_saved_steps_have_both_sides_of_an_event(bounced: Any) -> None:
    first = np.flatnonzero(np.isclose(bounced.ts, impacts(0.8, 1)[0], rtol=1e-12))
    assert len(first) == 2
    before, after = (float(bounced.v[i]) for i in first)
    np.testing.assert_allclose([before, after], [-np.sqrt(2 * G), 0.8 * np.sqrt(2 * G)], rtol=1e-10)
    np.testing.assert_allclose(bounced.impacts[first], [0.0, 1.0])
    assert np.all(np.diff(bounced.ts) >= 0.0)


def test_energy_lost_at_impacts(bounced: Any) -> None:
    account = bounced.energy
    np.testing.assert_allclose(account.events["impact"], 2.0 * G * (1.0 - 0.8**12), rtol=1e-9)
    np.testing.assert_allclose(account.imbalance, 0.0, atol=1e-9)
    assert "impact" in str(account)


@pytest.mark.thorough
def test_plots_show_the_events(bounced: Any) -> None:
    from matplotlib import pyplot as plt

    rows = bounced.events.plot()
    assert [label.get_text() for label in rows.get_yticklabels()] == ["impact"]
    np.testing.assert_allclose(rows.get_lines()[0].get_xdata(), impacts(0.8, 6), rtol=1e-12)
    none = simulate(Ball(), 0.1).events
    assert len(none) == 0
    assert not none.plot().get_lines()
    (heights,) = bounced.plot("h")
    assert len(heights.get_lines()) == 1
    (marks,) = heights.collections  # a line at each impact
    np.testing.assert_allclose([path.vertices[0, 0] for path in marks.get_paths()], impacts(0.8, 6), rtol=1e-12)
    plt.close("all")


def test_dense_output_on_both_sides() -> None:
    times = np.array([0.2, 0.9, 1.5])
    sol = simulate(Ball(), 2.0, rtol=1e-10, save="dense")
    np.testing.assert_allclose(jnp.asarray(sol.at(times).h)[1:], [height(0.8, 0.9), height(0.8, 1.5)], rtol=1e-9)
    np.testing.assert_allclose(sol.at(times).impacts, [0.0, 1.0, 2.0])


def dropped(e: Any, h0: Any) -> tuple[Any, Any]:
    sol = simulate(Ball(e=e, h=h0), 2.0, rtol=1e-10, save="end")
    return sol.final.h, sol.events.times[2]


@pytest.mark.thorough
def test_gradients_in_both_modes_are_exact() -> None:
    """With respect to a parameter and to a start value, of the end and of the moment of an event."""
    point = (jnp.asarray(0.8), jnp.asarray(1.0))
    forward = jax.jit(jax.jacfwd(dropped, argnums=(0, 1)))(*point)
    reverse = jax.jit(jax.jacrev(dropped, argnums=(0, 1)))(*point)
    h = 1e-6
    first = np.sqrt(2.0 / G)
    np.testing.assert_allclose(forward[0][0], (height(0.8 + h, 2.0) - height(0.8 - h, 2.0)) / (2 * h), rtol=1e-8)
    np.testing.assert_allclose(forward[1][0], first * (2.0 + 4.0 * 0.8), rtol=1e-10)
    # All moments grow with the square root of the height.
    np.testing.assert_allclose(forward[1][1], 0.5 * impacts(0.8, 3)[2], rtol=1e-10)
    np.testing.assert_allclose(np.ravel(reverse), np.ravel(forward), rtol=1e-10)


@pytest.mark.thorough
def test_stop_conditions_that_a_rebound_meets_or_undoes() -> None:
    """Met by the third rebound, by the first one, and just above the floor, from where the rebound leads back in the
    same step; when, and its derivative by e.
    """

    def stopped(e: Any, which: Any) -> Any:
        conditions = lambda s: jnp.stack([s.impacts - 2.5, s.v - 1.0, s.h - 1e-6])  # noqa: E731
        return simulate(Ball(e=e), 3.0, until=lambda s: which @ conditions(s), rtol=1e-10, save="end").t1

    first, e = np.sqrt(2.0 / G), 0.8
    run = jax.jit(jax.vmap(lambda which: jax.value_and_grad(stopped)(e, which)))
    times, slopes = run(np.eye(3))
    just_above = np.sqrt(2.0 * (1.0 - 1e-6) / G)
    np.testing.assert_allclose(times, [first * (1.0 + 2.0 * e + 2.0 * e**2), first, just_above], rtol=1e-9)
    np.testing.assert_allclose(slopes, [first * (2.0 + 4.0 * e), 0.0, 0.0], rtol=1e-8, atol=1e-9)


class Zeroed(Component):
    """x rises at the rate 1 and y falls; at a time both are set to zero. How often each was above it."""

    time: Param[Scalar, "s"] = 1.0
    x: Var[Scalar, "s"] = -3.0
    y: Var[Scalar, "s"] = -3.0
    n_x: Discrete[Scalar, "1"] = 0.0
    n_y: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rises=eq(d.x, 1.0), falls=eq(d.y, -1.0))

    def events(self) -> Events:
        return dict(
            zero=at(self.time, x=0.0, y=0.0),
            x_above=when(self.x > 0.0, n_x=self.n_x + 1.0),
            y_above=when(self.y > 0.0, n_y=self.n_y + 1.0),
        )


@pytest.mark.thorough
def test_a_condition_that_an_event_leaves_exactly_at_zero() -> None:
    """The sign of the condition an instant later counts."""
    sol = simulate(Zeroed(), 2.0)
    assert (sol.final.n_x, sol.final.n_y) == (1.0, 0.0)
    assert sol.events.names == ["zero", "x_above"]
    np.testing.assert_allclose(sol.events.times, 1.0, rtol=1e-9)


@pytest.mark.thorough
def test_batch_with_different_numbers_of_events() -> None:
    restitution = jnp.array([0.7, 0.8, 0.95])
    heights, _ = jax.jit(jax.vmap(lambda e: dropped(e, 1.0)))(restitution)
    np.testing.assert_allclose(heights, [height(e, 2.0) for e in restitution.tolist()], rtol=1e-8)


@pytest.mark.thorough
def test_array_of_components() -> None:
    class Box(Component):
        balls: Array[Ball]

    box = Box(balls=repeat(Ball(e=jnp.array([0.7, 0.8, 0.9]), h=jnp.array([1.0, 1.0, 1.0])), 3))
    sol = simulate(box, 2.0, rtol=1e-10, save="end")
    np.testing.assert_allclose(sol.final.balls.item.h, [height(e, 2.0) for e in (0.7, 0.8, 0.9)], rtol=1e-8)
    # All three hit the floor for the first time at one instant.
    assert sol.events.names[:3] == ["balls[0].impact", "balls[1].impact", "balls[2].impact"]
    np.testing.assert_allclose(sol.events.times[:3], impacts(0.8, 1)[0], rtol=1e-12)


def test_each_of_many_rebounds_takes_one_step() -> None:
    """Free flight is integrated without an error, but steps do not become much longer than flights."""
    n, flight = 2000, 2.0 * np.sqrt(2.0 / G)
    sol = simulate(Ball(e=1.0), n * flight, save="end", max_steps=100_000)
    assert sol.final.impacts == n
    np.testing.assert_allclose(sol.final.h, 1.0, atol=1e-9)
    assert sol.stats["num_rejected_steps"] == 0
    assert sol.stats["num_accepted_steps"] < 1.02 * n


@pytest.mark.thorough
def test_events_that_undo_each_other_are_named() -> None:
    assert simulate(Undoing(), 1.0, throw=False).result == Result.events_endless


class Clocked(Component):
    """Every kind of moment: at the start, at one instant with another event, twice in a step, of a clock."""

    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, ""] = 0.0
    first: Discrete[Scalar, "s"] = -1.0
    second: Discrete[Scalar, "s"] = -1.0
    third: Discrete[Scalar, "s"] = -1.0
    swings: Discrete[Scalar, "1"] = 0.0
    at_start: Discrete[Scalar, "1"] = 0.0
    zero: Discrete[Scalar, "1"] = 0.0
    order: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, jnp.cos(self.t), check_units=False))

    def events(self) -> Events:
        after_one = self.first > 0.0
        return dict(
            one=when(self.t > 1.0, first=self.t, order=2.0 * self.order + 1.0),
            same=when(self.t >= 1.0, second=self.t),
            follows=when(after_one & (self.third < 0.0), third=self.t),
            high=when(self.x > 0.999, swings=self.swings + 1.0),
            running=when(self.x > -1.0 - 1e-6, at_start=self.at_start + 1.0),
            rises=when(self.x > 0.0, zero=self.zero + 1.0),
        )


@pytest.mark.thorough
def test_moments() -> None:
    sol = simulate(Clocked(x=0.0), 20.0, save="end", rtol=1e-8)
    final = sol.final
    np.testing.assert_allclose(np.array([final.first, final.second, final.third]), 1.0, rtol=1e-12)
    # Above 0.999 for less than 0.1 s in each turn: not to be stepped over.
    assert final.swings == 3.0
    assert final.at_start == 1.0
    # Exactly zero at the start and rising: that is the first of the onsets, one a turn.
    assert final.zero == 4.0
    assert final.order == 1.0


class Struck(Component):
    """Two geared rotors; a blow sets the speed of the one that is not a state."""

    t: Time[Scalar, "s"] = 0.0
    first: Inertia
    gear: IdealGear
    second: Inertia

    def connections(self) -> Connections:
        return connect(self.first.b, self.gear.a), connect(self.gear.b, self.second.a)

    def events(self) -> Events:
        return dict(blow=when(self.t > 0.5, **{"first.w": self.first.w + 6.0}))


@pytest.mark.thorough
def test_reset_of_a_dependent_variable() -> None:
    """The variables tied to it follow."""
    model = Struck(first=Inertia(J=1.0, w=3.0), gear=IdealGear(ratio=3.0), second=Inertia(J=2.0))
    sol = simulate(model, 1.0, save="end")
    np.testing.assert_allclose(np.array([sol.final.first.w, sol.final.second.w]), [9.0, 3.0], rtol=1e-12)


@pytest.mark.thorough
def test_reset_that_contradicts_a_constraint_is_named() -> None:
    class TwiceStruck(Component):
        t: Time[Scalar, "s"] = 0.0
        first: Inertia
        gear: IdealGear
        second: Inertia

        def connections(self) -> Connections:
            return connect(self.first.b, self.gear.a), connect(self.gear.b, self.second.a)

        def events(self) -> Events:
            return dict(blow=when(self.t > 0.5, **{"first.w": 6.0, "second.w": 6.0}))

    model = TwiceStruck(first=Inertia(J=1.0), gear=IdealGear(ratio=3.0), second=Inertia(J=2.0))
    with pytest.raises(SimulationError, match=r"contradict the constraints.*blow"):
        simulate(model, 1.0)


@pytest.mark.parametrize(
    ("event", "changes", "message"),
    [
        (when, {"z": 1.0}, "changes z, which does not exist"),
        (when, {"T": 1.0}, "a param"),
    ],
)
def test_events_change_what_can_change(event: Any, changes: dict[str, Any], message: str) -> None:
    class Bad(Component):
        T: Param[Scalar, "s"] = 1.0
        x: Var[Scalar, "m"] = 1.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.T * d.x, -self.x))

        def events(self) -> Events:
            return dict(low=event(self.x < 0.5, **changes))

    with pytest.raises(ModelError, match=message):
        simulate(Bad(), 1.0)
