"""Start values from conditions, from rest, and along a homotopy."""

from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _mechanisms import Pendulum
from _models import Diode
from scipy.optimize import brentq

from acausal import (
    Array,
    Component,
    Connections,
    Equations,
    ModelError,
    Param,
    Scalar,
    SimulationError,
    Var,
    connect,
    eq,
    initialise,
    prefer,
    repeat,
    replace,
    simulate,
    structure,
)
from acausal._integrate.start.search import Search, _in_stages
from components.electrical import Capacitor, ConstantVoltage, Ground, Pin, Resistor
from components.thermal import FixedTemperature, HeatCapacitor, ThermalConductor
from docs.drive import drive


@pytest.mark.thorough
def test_drive_at_rest() -> None:
    """The stalled motor holds the spring: i = V / R, and phi = ratio k i / c."""
    rest: Any = initialise(drive, steady=True)
    assert float(rest.motor.inductor.i) == pytest.approx(12.0 / 0.3, rel=1e-12)
    assert float(rest.gear.b.phi) == pytest.approx(20.0 * 0.04 * 40.0 / 10.0, rel=1e-12)
    assert float(rest.load.w) == pytest.approx(0.0, abs=1e-12)
    assert rest.load.b.phi is None
    assert float(simulate(rest, 0.0, save="end").final.load.b.phi) == pytest.approx(3.2, rel=1e-12)
    later: Any = simulate(rest, 0.1, save="end").final
    np.testing.assert_allclose(np.array([later.motor.inductor.i, later.spring.tau]), [40.0, 32.0], rtol=1e-9)


def conditions(s: Any, d: Any) -> Any:
    """On an algebraic variable and on derivatives."""
    return dict(torque=eq(s.spring.tau, 10.0), acceleration=eq(d.load.w, 50.0), current=eq(d.motor.inductor.i))


@pytest.mark.thorough
def test_conditions() -> None:
    """(J + ratio^2 J_m) dw/dt = ratio k i - tau gives i; V = R i + k ratio w gives w; tau = c phi + d w gives phi."""
    start: Any = initialise(drive, conditions, strict=True)
    current = ((5e-3 + 20.0**2 * 5e-5) * 50.0 + 10.0) / (20.0 * 0.04)
    speed = (12.0 - 0.3 * current) / (0.04 * 20.0)
    found = np.array([start.motor.inductor.i, start.load.w, start.gear.b.phi])
    np.testing.assert_allclose(found, [current, speed, (10.0 - 0.1 * speed) / 10.0], rtol=1e-12)
    assert start.spring.tau is None
    assert float(simulate(start, 1e-3)["spring.tau"][0]) == pytest.approx(10.0, rel=1e-12)


@pytest.mark.thorough
def test_what_conditions_leave_open_stays() -> None:
    """The current keeps the start value that is given; the angle, of which none is, that of its class."""
    model = replace(drive, {"motor.inductor.i": 5.0})
    start: Any = initialise(model, lambda s, d: dict(speed=eq(s.motor.rotor.w, 40.0)))
    found = np.array([start.load.w, start.motor.inductor.i, start.gear.b.phi])
    np.testing.assert_allclose(found, [2.0, 5.0, 0.0], rtol=1e-12, atol=1e-15)


def rotor_turns(s: Any, d: Any) -> Any:
    return dict(turning=eq(s.motor.rotor.w, 1.0))


@pytest.mark.thorough
def test_start_values_that_are_given_stay_unless_they_are_free() -> None:
    moving = replace(drive, {"load.w": 3.0})
    with pytest.raises(SimulationError, match=r"(?s)Not met: turning\..*omit or free a start value: load\.w, or"):
        initialise(moving, rotor_turns)
    for free in (["load.w"], "all"):
        assert float(initialise(moving, rotor_turns, free=free).load.w) == pytest.approx(1.0 / 20.0, rel=1e-12)


@pytest.mark.thorough
def test_conditions_that_contradict_each_other_are_named() -> None:
    def both(s: Any, d: Any) -> Any:
        return dict(load=eq(s.load.w, 1.0), rotor=eq(s.motor.rotor.w, 1.0), current=eq(s.motor.inductor.i, 2.0))

    with pytest.raises(SimulationError, match=r"in conflict, linearly dependent: (load, rotor|rotor, load)\.\n"):
        initialise(drive, both)


@pytest.mark.thorough
def test_strict() -> None:
    expected = r"leave 2 of the start values undetermined.*: gear\.b\.phi, motor\.inductor\.i\."
    with pytest.raises(SimulationError, match=expected):
        initialise(drive, rotor_turns, strict=True)


def test_wrong_names() -> None:
    with pytest.raises(ModelError, match=r"free: the model has no variable 'load\.v'\. Did you mean load\.w"):
        initialise(drive, steady=True, free=["load.v"])
    with pytest.raises(ModelError, match=r"conditions: .*'speed'.*shape of the model"):
        initialise(drive, lambda s, d: dict(turning=eq(s.load.speed, 1.0)))
    with pytest.raises(ModelError, match=r"conditions must return a dictionary of equations"):
        initialise(drive, lambda s, d: s.load.w - 1.0)  # pyright: ignore[reportArgumentType]


class Beam(Component):
    """A beam under axial force, by its deflection: its stiffness k may be negative, so that it snaps through."""

    k: Param[Scalar, "N/m"]
    k3: Param[Scalar, "N/m3"] = 1e6
    load: Param[Scalar, "N"] = 20.0
    d: Param[Scalar, "N.s/m"] = 5.0
    m: Param[Scalar, "kg"] = 0.1
    s: Var[Scalar, "m", prefer] = 0.0
    v: Var[Scalar, "m/s", prefer] = 0.0

    def equations(self, d: Self) -> Equations:
        elastic = self.k * self.s + self.k3 * self.s**3
        return dict(speed=eq(self.v, d.s), newton=eq(self.m * d.v, -self.d * self.v - elastic - self.load))


@pytest.mark.thorough
def test_easier_model() -> None:
    """From s > 0 the search ends where the force is least; the only root is reached from a beam without axial force."""
    buckled = Beam(k=-1200.0, s=0.03)
    (root,) = (root.real for root in np.roots([1e6, 0.0, -1200.0, 20.0]) if abs(root.imag) < 1e-12)
    with pytest.raises(SimulationError, match=r"Not met: der\(v\) = 0"):
        initialise(buckled, steady=True)
    start = initialise(buckled, steady=True, easier=replace(buckled, {"k": 500.0}))
    np.testing.assert_allclose(np.array([start.s, start.v]), [root, 0.0], rtol=1e-10, atol=1e-12)


class Stage(Component):
    """A resistor, then a diode and a capacitor to ground."""

    r: Resistor
    diode: Diode
    c: Capacitor
    p: Pin = Pin()
    q: Pin = Pin()
    n: Pin = Pin()

    def connections(self) -> Connections:
        return (
            connect(self.p, self.r.p),
            connect(self.r.n, self.diode.p, self.c.p, self.q),
            connect(self.n, self.diode.n, self.c.n),
        )


class Ladder(Component):
    source: ConstantVoltage
    stages: tuple[Stage, ...]
    ground: Ground = Ground()

    def connections(self) -> Connections:
        first, *others = self.stages
        return (
            connect(self.source.p, first.p),
            *(connect(before.q, after.p) for before, after in zip(self.stages, others, strict=False)),
            connect(self.source.n, self.ground.p, *(stage.n for stage in self.stages)),
        )


class Static(Component):
    """Equations without a state: a + b = 3 and a - b = 1."""

    a: Var[Scalar, "1"] = 0.0
    b: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(total=eq(self.a + self.b, 3.0), apart=eq(self.a - self.b, 1.0))


def test_a_model_without_states_has_nothing_to_search_for() -> None:
    final = simulate(initialise(Static(), steady=True), 1.0, save="end").final
    assert (float(final.a), float(final.b)) == (2.0, 1.0)
    assert initialise(Static(), lambda s, d: dict(two=eq(s.a, 2.0))).a is None
    with pytest.raises(SimulationError, match="five"):
        initialise(Static(), lambda s, d: dict(five=eq(s.a, 5.0)))


@pytest.mark.parametrize("easy", [None, jnp.asarray(0.5)])
def test_a_homotopy_ends_at_the_conditions_themselves(easy: Any) -> None:
    """z + z^3 = 30, from the residual at zero or from an easier right-hand side."""

    def measured(z: Any, args: Any) -> Any:
        _, right, _ = args
        return z + z**3 - right

    args = (jnp.zeros(1), jnp.asarray(30.0), jnp.ones(1))
    z, lack = _in_stages(measured, args, easy)
    np.testing.assert_allclose([z[0], lack[0]], [3.0, 0.0], atol=1e-8)


def test_a_state_with_little_effect_beside_large_ones_is_determined() -> None:
    """The rate 100 (y - 1) - 1e-3 (x - X) is zero at y = 1 and x = X, however the other conditions are scaled."""

    def residual(unknowns: jax.Array, goal: Any) -> jax.Array:
        x, y, same, product = unknowns
        return jnp.array([y - same, 1.0 - same, 100.0 * (y - 1.0) - 1e-3 * (x - goal), product - x * same])

    search = Search(residual, np.ones(4), np.array([1e-6, 1e-6, 1.0, 1.0]))

    def found(goal: Any) -> Any:
        start = jnp.zeros(4)
        point = search.found(search.best(start, goal)[0], start, goal)
        return point.x, point.freedom

    (x, freedom), (slope, _) = jax.jvp(found, (50.0,), (1.0,))
    np.testing.assert_allclose(x, [50.0, 1.0, 1.0, 50.0], rtol=1e-9)
    np.testing.assert_allclose(freedom, 0.0, atol=1e-9)
    np.testing.assert_allclose(slope, [1.0, 0.0, 0.0, 1.0], atol=1e-6)


@pytest.mark.thorough
def test_ladder_of_diodes() -> None:
    """Exponentials one behind the other, from no voltage to 50 V: what each resistor brings its node takes on."""
    stages = [Stage(r=Resistor(R=10.0), diode=Diode(saturation=1e-12), c=Capacitor(C=1e-6)) for _ in range(4)]
    start = initialise(Ladder(source=ConstantVoltage(V=50.0), stages=tuple(stages)), steady=True)
    v = np.array([stage.c.v for stage in start.stages])
    through = -np.diff([50.0, *v, v[-1]]) / 10.0
    np.testing.assert_allclose(through[:-1] - through[1:], 1e-12 * np.expm1(v / 0.025), rtol=1e-7)
    assert np.all(v > 0.5)


def deflection(k: Any, load: Any) -> Any:
    return initialise(Beam(k=k, load=load), steady=True).s


@pytest.mark.slow
def test_gradients() -> None:
    """ds/dk = -s / (k + 3 k3 s^2) and ds/dload = -1 / (...), in both modes and against finite differences."""
    at = (jnp.asarray(500.0), jnp.asarray(20.0))
    s = deflection(*at)
    slope = 500.0 + 3e6 * s**2
    forward = jax.jit(jax.jacfwd(deflection, argnums=(0, 1)))(*at)
    np.testing.assert_allclose(forward, [-s / slope, -1.0 / slope], rtol=1e-9)
    np.testing.assert_allclose(jax.jit(jax.grad(deflection, argnums=(0, 1)))(*at), forward, rtol=1e-12)
    run, h = jax.jit(deflection), 1e-3
    difference = (run(at[0], at[1] + h) - run(at[0], at[1] - h)) / (2.0 * h)
    np.testing.assert_allclose(forward[1], difference, rtol=1e-6)


@pytest.mark.thorough
def test_gradient_by_given_start_values() -> None:
    """On a rod of length L, y = -sqrt(L^2 - x^2) wherever x is given."""

    def height(length: Any, x: Any) -> Any:
        return initialise(Pendulum(L=length, x=x, y=-1.0), free=["y"]).y

    at = (jnp.asarray(1.2), jnp.asarray(0.7))
    y = -np.sqrt(1.2**2 - 0.7**2)
    np.testing.assert_allclose(jax.jit(height)(*at), y, rtol=1e-12)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(height, argnums=(0, 1)))(*at), [1.2 / y, -0.7 / y], rtol=1e-10)
    np.testing.assert_allclose(jax.jit(jax.grad(height, argnums=(0, 1)))(*at), [1.2 / y, -0.7 / y], rtol=1e-10)


@pytest.mark.thorough
def test_batch() -> None:
    loads = jnp.array([-5.0, 5.0, 20.0])
    together = jax.jit(jax.vmap(lambda load: deflection(500.0, load)))(loads)
    roots = [[root.real for root in np.roots([1e6, 0.0, 500.0, load]) if root.imag == 0.0] for load in loads]
    np.testing.assert_allclose(together, np.ravel(roots), rtol=1e-9)


@pytest.mark.thorough
def test_failure_without_an_error() -> None:
    """A bob 2 m to the side of its joint needs a rod as long."""

    @eqx.filter_jit
    def height(length: Any) -> Any:
        return initialise(Pendulum(L=length, x=2.0, y=-1.0), free=["y"], throw=False).y

    np.testing.assert_allclose(jax.vmap(height)(jnp.array([1.0, 2.5])), [np.nan, -1.5], rtol=1e-12)
    assert np.isnan(initialise(Pendulum(L=1.0, x=2.0, y=-1.0), free=["y"], throw=False).y)


class Wall(Component):
    """Layers between a room and the outside."""

    room: FixedTemperature
    layers: Array[HeatCapacitor]
    joints: Array[ThermalConductor]
    outside: FixedTemperature

    def connections(self) -> Connections:
        return (
            connect(self.room.port, self.joints[0].a),
            connect(self.joints[:-1].b, self.layers[:].port),
            connect(self.layers[:].port, self.joints[1:].a),
            connect(self.joints[-1].b, self.outside.port),
        )


@pytest.mark.thorough
def test_array_of_components() -> None:
    """At rest the temperature falls linearly."""
    n = 6
    wall = Wall(
        room=FixedTemperature(temperature=300.0),
        layers=repeat(HeatCapacitor(C=jnp.linspace(1e3, 2e3, n), T=280.0), n),
        joints=repeat(ThermalConductor(G=50.0), n + 1),
        outside=FixedTemperature(temperature=265.0),
    )
    rest = initialise(wall, steady=True)
    np.testing.assert_allclose(rest.layers.item.T, np.linspace(300.0, 265.0, n + 2)[1:-1], rtol=1e-12)
    np.testing.assert_allclose(simulate(rest, 100.0, save="end").final.layers.item.T, rest.layers.item.T, rtol=1e-9)


class Branches(Component):
    """Two curves that cross three times, and a lag that follows the crossing."""

    x: Var[Scalar, "", prefer] = 0.0
    u: Var[Scalar, ""] = 0.0
    v: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            lag=eq(d.x, self.u - self.x),
            first=eq(self.u, 2.0 * jnp.tanh(self.v + 0.1)),
            second=eq(self.v, 2.0 * jnp.tanh(self.u)),
        )


@pytest.mark.parametrize("near", [-1.9, 0.0, 1.9])
def test_the_guess_of_a_tearing_variable_selects_the_branch(near: float) -> None:
    """The steady state and the run from it are on the branch of the guess of the variable that `structure` names."""
    assert "torn by u" in str(structure(Branches()))
    f = lambda u: u - 2.0 * np.tanh(2.0 * np.tanh(u) + 0.1)  # noqa: E731
    root = brentq(f, near - 0.2, near + 0.2, xtol=1e-14)
    rest = initialise(Branches(u=near), steady=True)
    for found in (rest.x, rest.u, simulate(rest, 1.0, save="end").final.u):
        assert float(found) == pytest.approx(root, rel=1e-9)
