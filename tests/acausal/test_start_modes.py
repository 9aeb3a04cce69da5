"""Start values and modes found together: switches, diodes, friction, stops and past events at the start."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Result,
    Scalar,
    SimulationError,
    Var,
    at,
    connect,
    eq,
    initialise,
    linearise,
    simulate,
    when,
)
from components import blocks, electrical, rotational, translational


class Switched(Component):
    """A coil that a contact joins to a source; both came on at their times."""

    level: blocks.Step
    command: blocks.Step
    source: electrical.SignalVoltage
    contact: electrical.IdealClosingSwitch
    r: electrical.Resistor
    coil: electrical.Inductor
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        return (
            connect(self.level.y, self.source.u),
            connect(self.command.y, self.contact.u),
            connect(self.source.p, self.contact.p),
            connect(self.contact.n, self.r.p),
            connect(self.r.n, self.coil.p),
            connect(self.coil.n, self.source.n, self.ground.p),
        )


def switched(V: Any = 5.0, R: Any = 1.0, since: Any = -1.0) -> Switched:
    return Switched(
        level=blocks.Step(height=V, start_time=-2.0),
        command=blocks.Step(height=1.0, start_time=since),
        source=electrical.SignalVoltage(),
        contact=electrical.IdealClosingSwitch(Ron=0.0),
        r=electrical.Resistor(R=R),
        coil=electrical.Inductor(L=1e-3),
    )


@pytest.mark.thorough
def test_closed_switch() -> None:
    """i = V / R with the pole -R / L; open, the contact has its leakage."""
    rest = initialise(switched(), steady=True)
    np.testing.assert_allclose(rest.coil.i, 5.0, rtol=1e-12)
    np.testing.assert_array_equal(rest.contact.high, 1.0)
    np.testing.assert_allclose(initialise(switched(since=1.0), steady=True).coil.i, 5.0 / (1e5 + 1.0), rtol=1e-9)
    for model in (switched(), rest):
        np.testing.assert_allclose(linearise(model).poles, [-1000.0], rtol=1e-9)
    np.testing.assert_allclose(linearise(switched(), at=np.array([2.0])).poles, [-1000.0], rtol=1e-9)
    np.testing.assert_allclose(linearise(switched(since=1.0)).poles, [-1e8], rtol=1e-4)


@pytest.mark.thorough
def test_derivatives_in_a_mode() -> None:
    """By what a past step and the resistor are."""

    def current(p: Any) -> Any:
        return initialise(switched(p[0], p[1]), steady=True).coil.i

    at = jnp.array([[5.0, 2.0], [6.0, 0.5]])
    np.testing.assert_allclose(jax.jit(jax.vmap(current))(at), at[:, 0] / at[:, 1], rtol=1e-12)
    exact = np.stack([1.0 / at[:, 1], -at[:, 0] / at[:, 1] ** 2], axis=1)
    for mode in (jax.jacfwd, jax.grad):
        np.testing.assert_allclose(jax.jit(jax.vmap(mode(current)))(at), exact, rtol=1e-10)


class Block(Component):
    """A mass with dry friction on a spring, pulled by a force."""

    mass: translational.Mass
    friction: translational.StribeckFriction
    spring: translational.Spring
    wall: translational.Fixed
    pull: translational.ConstantForce

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.spring.a),
            connect(self.spring.b, self.mass.a),
            connect(self.mass.b, self.friction.flange, self.pull.flange),
        )


def block(force: Any, v: float | None = None) -> Block:
    return Block(
        mass=translational.Mass(m=2.0, v=v),
        friction=translational.StribeckFriction(Fc=8.0, Fs=10.0, vs=0.1),
        spring=translational.Spring(c=1e3),
        wall=translational.Fixed(),
        pull=translational.ConstantForce(force=force),
    )


@pytest.mark.parametrize(("force", "place"), [(4.0, 0.0), (-9.9, 0.0), (20.0, 0.01), (-20.0, -0.01)])
def test_dry_friction_rests(force: float, place: float) -> None:
    """The block rests where it is, or where friction at its limit holds it, which is the nearest rest."""
    rest = initialise(block(force), steady=True)
    np.testing.assert_allclose(rest.mass.a.s, place, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rest.mass.v, 0.0, atol=1e-11)


@pytest.mark.thorough
def test_rest_of_what_moves() -> None:
    """A speed that is only a guess, and the friction that belongs to it, give way to rest."""
    rest = initialise(block(4.0, v=3.0), steady=True)
    np.testing.assert_allclose(jnp.stack([rest.mass.v, rest.friction.mode]), 0.0, atol=1e-11)


class Stopped(Component):
    """A mass on a spring between stops."""

    mass: translational.Mass
    stop: translational.HardStop
    spring: translational.Spring
    wall: translational.Fixed
    push: translational.ConstantForce

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.spring.a),
            connect(self.spring.b, self.mass.a),
            connect(self.mass.b, self.stop.flange, self.push.flange),
        )


def stopped(force: Any, s_max: Any, s: Any = None) -> Stopped:
    return Stopped(
        mass=translational.Mass(m=0.3, a=translational.Flange(s=s)),
        stop=translational.HardStop(s_min=-0.2, s_max=s_max),
        spring=translational.Spring(c=100.0),
        wall=translational.Fixed(),
        push=translational.ConstantForce(force=force),
    )


@pytest.mark.thorough
def test_rest_at_a_stop() -> None:
    """Free, beyond the reach of the spring at one of the stops, and exactly between; with derivatives."""

    def place(p: Any) -> Any:
        return initialise(stopped(p[0], p[1]), steady=True).mass.a.s

    at = jnp.array([[5.0, 0.1], [30.0, 0.1], [-30.0, 0.1], [10.0, 1.0 / 3.0]])
    np.testing.assert_allclose(jax.jit(jax.vmap(place))(at), [0.05, 0.1, -0.2, 0.1], rtol=1e-12)
    slopes = [[0.01, 0.0], [0.0, 1.0], [0.0, 0.0], [0.01, 0.0]]
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.jacfwd(place)))(at), slopes, rtol=1e-10, atol=1e-12)


class Pushed(Component):
    """Two masses that are pushed towards stops, with nothing that would bring them there at rest."""

    masses: tuple[translational.Mass, translational.Mass]
    stops: tuple[translational.HardStop, translational.HardStop]
    pushes: tuple[translational.ConstantForce, translational.ConstantForce]

    def connections(self) -> Connections:
        return tuple(
            connect(mass.b, stop.flange, push.flange)
            for mass, stop, push in zip(self.masses, self.stops, self.pushes, strict=True)
        )


def pushed(forces: Any) -> Pushed:
    return Pushed(
        masses=(translational.Mass(m=1.0, s=0.0), translational.Mass(m=1.0, s=0.0)),
        stops=(translational.HardStop(s_min=-0.3, s_max=0.1), translational.HardStop(s_min=-0.2)),
        pushes=(translational.ConstantForce(force=forces[0]), translational.ConstantForce(force=forces[1])),
    )


@pytest.mark.thorough
def test_rest_at_stops_far_away() -> None:
    """At those that forces push to, however unequal these are; where there is none, no start is found."""

    def places(forces: Any) -> Any:
        rest: Any = initialise(pushed(forces), steady=True, throw=False)
        return jnp.stack([*(mass.a.s for mass in rest.masses), *(stop.mode for stop in rest.stops)])

    forces = np.array([[10.0, -3.0], [-10.0, -3.0], [0.0, -1.0], [-1e-3, -1e3], [5.0, 2.0]])
    found = jax.jit(jax.vmap(places))(forces)
    expected = [[0.1, -0.2, 1.0, -1.0], [-0.3, -0.2, -1.0, -1.0], [0.0, -0.2, 0.0, -1.0], [-0.3, -0.2, -1.0, -1.0]]
    np.testing.assert_allclose(found[:-1], expected, rtol=1e-12, atol=1e-15)
    assert np.all(np.isnan(found[-1, :2]))
    with pytest.raises(SimulationError, match=r"(?s)Not met: .*tried the modes that the start values imply.*stop"):
        initialise(pushed([5.0, 2.0]), steady=True)


class Guarded(Component):
    """A leak that a command opens, d(level)/dt = inflow - leak; without it there is no rest."""

    command: Param[Scalar, "1"]
    level: Var[Scalar, "1"] = 1.0
    opened: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(balance=eq(d.level, 1.0 - self.opened * self.level, check_units=False))

    def events(self) -> Events:
        return dict(opens=when(self.command > 0.5, opened=1.0), shuts=when(self.command < 0.5, opened=0.0))


@pytest.mark.thorough
def test_no_mode_is_tried_that_an_event_would_change() -> None:
    found: Any = initialise(Guarded(command=1.0, level=3.0), steady=True)
    np.testing.assert_allclose([found.level, found.opened], 1.0, rtol=1e-12)
    with pytest.raises(SimulationError, match=r"Not met: der\(level\) = 0"):
        initialise(Guarded(command=0.0, level=3.0), steady=True)


@pytest.mark.thorough
def test_start_exactly_on_a_stop() -> None:
    """Whatever the numbers, it rests there, pressed on by next to nothing, too."""

    @jax.jit
    @jax.vmap
    def end(force: Any, s: Any) -> Any:
        solution = simulate(stopped(force, s, s), 5.0, save="end", throw=False)
        return solution.final.mass.a.s, solution.stats["num_steps"]

    s = np.array([0.1, 1.0 / 3.0, 0.7, np.pi])
    for factor in (1.0 + 1e-9, 2.0):
        place, steps = end(jnp.asarray(100.0 * s * factor), jnp.asarray(s))
        np.testing.assert_allclose(place, s, rtol=1e-12)
        assert np.all(np.asarray(steps) < 50)


class Overrun(Component):
    """Two inertias with a freewheel between them."""

    a: rotational.Inertia
    wheel: rotational.OneWayClutch
    u: blocks.Constant
    b: rotational.Inertia

    def connections(self) -> Connections:
        return connect(self.a.b, self.wheel.a), connect(self.wheel.b, self.b.a), connect(self.u.y, self.wheel.u)


@pytest.mark.thorough
def test_freewheel_against_its_sense() -> None:
    model = Overrun(
        a=rotational.Inertia(J=1.0, w=2.0),
        wheel=rotational.OneWayClutch(mu=0.0, fn_max=0.0),
        u=blocks.Constant(k=0.0),
        b=rotational.Inertia(J=1.0, w=1.0),
    )
    with pytest.raises(SimulationError, match=r"^Overrun has no operating point.*wheel\.against: .*at=sol\.final"):
        linearise(model)
    with pytest.raises(SimulationError, match=r"values found are invalid\. wheel\.against: a freewheel turns in"):
        initialise(model, lambda s, d: dict(speed=eq(s.a.w, 2.0)))
    assert np.isnan(initialise(model, lambda s, d: dict(speed=eq(s.a.w, 2.0)), throw=False).a.w)


class Undecided(Component):
    """Heated below 1, cooled above it: at rest in neither of its modes."""

    x: Var[Scalar, "1"] = 0.0
    heats: Discrete[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(rate=eq(d.x, 2.0 * self.heats - self.x, check_units=False))

    def events(self) -> Events:
        heats = self.heats > 0.5
        return dict(off=when(heats & (self.x > 1.0), heats=0.0), on=when(~heats & (self.x < 0.9), heats=1.0))


@pytest.mark.thorough
def test_no_mode_is_consistent() -> None:
    with pytest.raises(SimulationError, match=r"(on|off), (on|off) would fire one after the other without end"):
        initialise(Undecided(), steady=True)
    assert np.isnan(initialise(Undecided(), steady=True, throw=False).x)


@pytest.mark.thorough
def test_undetermined_without_an_error() -> None:
    """`strict` holds without an error, too: nothing says where a block without a spring is."""
    with pytest.raises(SimulationError, match="undetermined"):
        initialise(block(4.0), steady=True, strict=True)
    assert np.isnan(initialise(block(4.0), steady=True, strict=True, throw=False).mass.v)
    np.testing.assert_allclose(initialise(switched(), steady=True, strict=True, throw=False).coil.i, 5.0, rtol=1e-12)


class Crossed(Component):
    """(0.3 - 3 k) z = x, which determines nothing in the mode k = 0.1, but for rounding."""

    x: Var[Scalar, "1"] = 1.0
    z: Var[Scalar, "1"] = 0.0
    k: Discrete[Scalar, "1"] = 0.1
    last: Param[Scalar, "1"] = 0.2

    def equations(self, d: Self) -> Equations:
        return dict(
            decay=eq(d.x, -self.x, check_units=False),
            crossed=eq((0.3 - 3.0 * self.k) * self.z, self.x),
        )

    def events(self) -> Events:
        return dict(first=at(0.0, k=0.3), last=at(0.5, k=self.last))


@pytest.mark.thorough
def test_equations_are_singular_in_the_modes_of_the_moment() -> None:
    """A run that leaves a singular mode at its start is good, one that comes to it is not."""
    sol = simulate(Crossed(), 1.0, save="end", rtol=1e-9)
    np.testing.assert_allclose(sol.final.z, -np.exp(-1.0) / 0.3, rtol=1e-7)
    assert simulate(Crossed(last=0.1), 1.0, save="end", throw=False).result == Result.undetermined


class Shaft(Component):
    """An inertia turned by a torque against a bearing's drag."""

    inertia: rotational.Inertia
    drag: rotational.Damper
    frame: rotational.Fixed
    torque: rotational.ConstantTorque

    def connections(self) -> Connections:
        return (
            connect(self.frame.flange, self.drag.a),
            connect(self.drag.b, self.inertia.a),
            connect(self.inertia.b, self.torque.flange),
        )


@pytest.mark.thorough
def test_steady_motion() -> None:
    """w = tau / d, near the angle at which it starts; without the angle there is no rest."""
    shaft = Shaft(
        inertia=rotational.Inertia(J=0.1),
        drag=rotational.Damper(d=0.5, phi_rel=0.7),
        frame=rotational.Fixed(),
        torque=rotational.ConstantTorque(torque=3.0),
    )
    for name in ("inertia.a.phi", "drag.b.phi"):
        turning = initialise(shaft, steady=True, moving=[name])
        np.testing.assert_allclose(turning.inertia.w, 6.0, rtol=1e-12)
        np.testing.assert_allclose(turning.drag.phi_rel, 0.7, rtol=1e-5)
    with pytest.raises(SimulationError, match=r"No steady state: .* inertia\.w, drag\.phi_rel to zero together"):
        initialise(shaft, steady=True)
    with pytest.raises(ModelError, match=r"moving: torque\.flange\.tau is not tied to a state"):
        initialise(shaft, steady=True, moving=["torque.flange.tau"])
    with pytest.raises(ModelError, match=r"moving: the model has no variable 'inertia\.x'"):
        initialise(shaft, steady=True, moving=["inertia.x"])
    with pytest.raises(ModelError, match="moving= exempts derivatives from steady=True"):
        initialise(shaft, moving=["inertia.w"])


class Rectifier(Component):
    """Capacitors in a mesh of sources, contacts, diodes and resistors."""

    sources: tuple[electrical.ConstantVoltage, ...]
    commands: tuple[blocks.Constant, ...]
    contacts: tuple[electrical.IdealClosingSwitch, ...]
    diodes: tuple[electrical.IdealDiode, ...]
    resistors: tuple[electrical.Resistor, ...]
    stores: tuple[electrical.Capacitor, ...]
    loads: tuple[electrical.Resistor, ...]
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        joints = []
        for i, store in enumerate(self.stores):
            node = (self.resistors[i].n, store.p, self.loads[i].p, self.diodes[i].p, self.diodes[i - 1].n)
            joints += [
                connect(self.commands[i].y, self.contacts[i].u),
                connect(self.sources[i].p, self.contacts[i].p),
                connect(self.contacts[i].n, self.resistors[i].p),
                connect(*node),
                connect(self.sources[i].n, store.n, self.loads[i].n, self.ground.p),
            ]
        return tuple(joints)


def rectifier(p: dict[str, Any]) -> Rectifier:
    """Node i feeds the next one through a diode, the last one the first."""
    return Rectifier(
        sources=tuple(electrical.ConstantVoltage(V=V) for V in p["V"]),
        commands=tuple(blocks.Constant(k=k) for k in p["k"]),
        contacts=tuple(electrical.IdealClosingSwitch(Ron=0.01) for _ in p["k"]),
        diodes=tuple(electrical.IdealDiode(Ron=R, Vknee=0.3) for R in p["Ron"]),
        resistors=tuple(electrical.Resistor(R=R) for R in p["R"]),
        stores=tuple(electrical.Capacitor(C=1e-3) for _ in p["V"]),
        loads=tuple(electrical.Resistor(R=R) for R in p["load"]),
    )


@pytest.mark.thorough
def test_random_networks_at_rest() -> None:
    """The rest is the end of a long run from zero voltage, whichever contacts are closed and diodes conduct."""
    random, n = np.random.default_rng(7), (24, 3)
    params = dict(
        V=random.uniform(-10.0, 10.0, n),
        k=random.integers(0, 2, n).astype(float),
        Ron=random.uniform(0.1, 1.0, n),
        R=random.uniform(0.5, 5.0, n),
        load=random.uniform(5.0, 30.0, n),
    )

    def voltages(model: Rectifier) -> Any:
        return jnp.stack([store.v for store in model.stores])

    def at_rest(p: Any) -> Any:
        found = initialise(rectifier(p), steady=True)
        return voltages(found), jnp.stack([diode.on for diode in found.diodes])

    def in_the_end(p: Any) -> Any:
        final = simulate(rectifier(p), 1.5, save="end", rtol=1e-8).final
        return voltages(final), jnp.stack([diode.on for diode in final.diodes])

    rest, modes = jax.jit(jax.vmap(at_rest))(params)
    later, later_modes = jax.jit(jax.vmap(in_the_end))(params)
    np.testing.assert_allclose(rest, later, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(modes, later_modes)
    assert len(np.unique(np.asarray(modes), axis=0)) >= 4
