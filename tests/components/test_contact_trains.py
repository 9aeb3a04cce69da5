"""Impacts in trains of contacts: momentum, restitution and energy for random numbers, and closed forms."""

from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from numpy.typing import NDArray

from acausal import (
    Array,
    Component,
    Connections,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    SimulationError,
    Var,
    connect,
    eq,
    impact,
    simulate,
    stack,
)
from components import rotational, translational
from components.rotational import ConstantTorque, IdealGear, IdealGearR2T, Inertia, LossyGear, PlanetaryGear
from components.translational import ConstantSpeed, HardStop, Lever, Mass, RigidContact, StribeckFriction

Numbers = NDArray[Any]


def wire_row(*parts: Any) -> Connections:
    """Masses with contacts between neighbours."""
    masses, contacts = parts[: len(parts) // 2 + 1], parts[len(parts) // 2 + 1 :]
    pairs = zip(contacts, masses[:-1], masses[1:], strict=True)
    return tuple(joined for c, a, b in pairs for joined in (connect(a.b, c.a), connect(c.b, b.a)))


def row(m: Any, v: Any, s: Any, e: Any, closed: Any = None) -> Rig:
    masses = tuple(Mass(m=m[i], s=s[i], v=v[i]) for i in range(len(m)))
    closed = jnp.zeros(len(m) - 1) if closed is None else closed
    contacts = tuple(RigidContact(restitution=e[i], mode=-closed[i]) for i in range(len(m) - 1))
    return Rig(parts=masses + contacts, wiring=wire_row)


@pytest.mark.parametrize(
    ("e", "closed", "after"),
    [
        (0.0, True, [2 / 3, 2 / 3, 2 / 3]),
        (0.0, False, [2 / 3, 2 / 3, 2 / 3]),
        (1.0, True, [-2 / 3, 4 / 3, 4 / 3]),  # the closed contact transmits the impulse and stays closed
        (1.0, False, [0.0, 0.0, 2.0]),  # Newton's cradle: one contact after the other
    ],
)
@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_a_mass_strikes_two_others(e: float, closed: bool, after: list[float], gap: float) -> None:
    gap = 0.0 if closed else gap
    model = row([1.0] * 3, [2.0, 0.0, 0.0], [0.0, 1.0, 1.0 + gap], [e] * 2, jnp.array([0.0, closed]))
    run = simulate(model, 1.0, energy=True)
    np.testing.assert_allclose([part.v for part in run.final.parts[:3]], after, rtol=0.0, atol=1e-9)
    assert abs(run.energy.imbalance) < 1e-12


def one_after_the_other(e: float) -> list[float]:
    """Speeds of three masses in touch after the first is struck, once no impact is left."""
    v = [1.0, 0.0, 0.0]
    while v[0] > v[1] + 1e-3 or v[1] > v[2] + 1e-3:
        i = 0 if v[0] > v[1] else 1
        mean, rebound = 0.5 * (v[i] + v[i + 1]), 0.5 * e * (v[i] - v[i + 1])
        v[i : i + 2] = mean - rebound, mean + rebound
    return v


@pytest.mark.thorough
def test_impacts_that_follow_each_other_at_once_are_no_rebound_that_dies_out() -> None:
    """Impacts between masses in touch: that of one contact ends the motion which the other has turned back."""
    e = np.array([0.3, 0.5, 0.6, 0.7, 0.9])

    def struck_first(e: Any) -> Any:
        model = row([1.0] * 3, [1.0, 0.0, 0.0], [0.0] * 3, [e, e])
        solution = simulate(model, 1.0, save="end", throw=False)
        return solution.t1, [part.v for part in solution.final.parts[:3]]

    t1, speeds = jax.jit(jax.vmap(struck_first))(e)
    np.testing.assert_array_equal(t1, 1.0)
    np.testing.assert_allclose(np.transpose(speeds), [one_after_the_other(share) for share in e], atol=1e-6)


def test_masses_struck_from_both_sides_at_one_instant() -> None:
    """Both contacts obey Newton's law: the middle body stays, and the others rebound."""
    model = row([1.0, 3.0, 1.0], [2.0, 0.0, -2.0], [0.0, 1.0, 2.0], [0.5] * 2)
    final = simulate(model, 0.8, save="end").final
    np.testing.assert_allclose([part.v for part in final.parts[:3]], [-1.0, 0.0, 1.0], atol=1e-9)


class Row(Component):
    """Masses with contacts between neighbours, as arrays."""

    masses: Array[Mass]
    contacts: Array[RigidContact]

    def connections(self) -> Connections:
        return (
            connect(self.masses[:-1].b, self.contacts[:].a),
            connect(self.contacts[:].b, self.masses[1:].a),
        )


@pytest.mark.thorough
def test_contacts_in_an_array() -> None:
    """Four masses in closed contact, of which the first is struck: plastic, so all of them move together."""
    masses = [Mass(m=1.0, s=0.0, v=4.0)] + [Mass(m=1.0, s=1.0, v=0.0)] * 3
    contacts = [RigidContact(mode=0.0)] + [RigidContact(mode=-1.0)] * 2
    final = simulate(Row(masses=stack(masses), contacts=stack(contacts)), 1.0, save="end").final
    np.testing.assert_allclose(final.masses[:].v, np.ones(4), atol=1e-9)


class Misnamed(Component):
    """A ball whose impact names a variable that is not discrete."""

    g: Param[Scalar, "m/s2"] = 9.81
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0
    a: Var[Scalar, "m/s2"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), acceleration=eq(self.a, d.v), fall=eq(self.a, -self.g))

    def events(self) -> Events:
        return dict(impact=impact(self.h < 0.0, force="a", speed=self.v, acceleration=self.a))


def test_a_force_of_an_impact_that_is_not_discrete_is_refused() -> None:
    with pytest.raises(ModelError, match="impact has the force a, which is not a discrete variable"):
        simulate(Misnamed(), 1.0)


class Train(NamedTuple):
    """The numbers of a train of six bodies on a line of contacts, with a lever and a rack among them."""

    m: Numbers
    v: Numbers
    gaps: Numbers
    e: Numbers
    closed: Numbers
    arm: float
    ratio: float
    J: Numbers
    gear: float
    wall: float


def random_train(seed: int) -> Train:
    draw = np.random.default_rng(seed)
    closed = draw.random(4) < 0.4
    gaps = np.where(closed | (draw.random(4) < 0.3), 0.0, draw.uniform(0.01, 1.0, 4))
    v = draw.uniform(-1.0, 2.0, 5)
    train = Train(
        m=10.0 ** draw.uniform(-3.0, 3.0, 5),
        v=v,
        gaps=gaps,
        e=draw.choice([0.0, 0.3, 0.8, 1.0], 5),
        closed=closed,
        arm=draw.uniform(0.3, 3.0),
        ratio=draw.uniform(1.0, 5.0),
        J=10.0 ** draw.uniform(-3.0, 1.0, 2),
        gear=draw.uniform(-3.0, -0.5),
        wall=draw.uniform(0.2, 2.0) if draw.random() < 0.6 else np.inf,
    )
    along = direction(train)
    for i in np.flatnonzero(closed):  # the bodies of a closed contact have one speed
        v[i + 1] = v[i] * along[i + 1] / along[i]
    return train


def direction(train: Train) -> Numbers:
    """The displacements of the masses that change no gap. The lever lies between its mass 2 and contact 1."""
    return np.array([1.0, 1.0, -train.arm, -train.arm, -train.arm])


def inertias(train: Train) -> Numbers:
    """The mass of each body, with the gear pair behind the rack at mass 3."""
    rotors = train.ratio**2 * (train.J[0] + train.J[1] / train.gear**2)
    return train.m + np.array([0.0, 0.0, 0.0, rotors, 0.0])


def wire_train(*parts: Any) -> Connections:
    masses, contacts, (lever, rack, pinion, gear, load, stop) = parts[:5], parts[5:9], parts[9:]
    return (
        connect(masses[0].b, contacts[0].a),
        connect(contacts[0].b, masses[1].a),
        connect(masses[1].b, contacts[1].a),
        connect(contacts[1].b, lever.a),
        # Behind the lever, an impulse acts in the negative direction.
        connect(lever.b, masses[2].b),
        connect(masses[2].a, contacts[2].b),
        connect(contacts[2].a, masses[3].b, rack.rod),
        connect(rack.shaft, pinion.a),
        connect(pinion.b, gear.a),
        connect(gear.b, load.a),
        connect(masses[3].a, contacts[3].b),
        connect(contacts[3].a, masses[4].b),
        connect(masses[4].a, stop.flange),
    )


def model_of(train: Train) -> Rig:
    gaps = train.gaps
    # The lever's ends have the positions 0, and contact 1 acts at the origin.
    s = [-gaps[1] - gaps[0], -gaps[1], 0.0, -gaps[2], -gaps[2] - gaps[3]]
    parts = (
        *(Mass(m=train.m[i], s=s[i], v=train.v[i]) for i in range(5)),
        *(RigidContact(restitution=train.e[i], mode=-float(train.closed[i])) for i in range(4)),
        Lever(arm_a=1.0, arm_b=train.arm),
        IdealGearR2T(ratio=train.ratio),
        Inertia(J=train.J[0]),
        IdealGear(ratio=train.gear),
        Inertia(J=train.J[1]),
        HardStop(s_min=s[4] - train.wall, restitution=train.e[4]),
    )
    return Rig(parts=parts, wiring=wire_train)


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::acausal.UnresolvedWarning")  # gaps of closed contacts are zero within rounding
@pytest.mark.parametrize("seed", range(20))
def test_random_trains(seed: int) -> None:
    """At each impact: contacts and the wall push, the impulses add up to the changes of momentum, no energy is gained,
    and no contact closes. Without the wall, the generalised momentum is that of the start.
    """
    train = random_train(seed)
    run = simulate(model_of(train), 3.0, energy=True, max_steps=100_000)
    v = np.stack([run.parts[i].v for i in range(5)], axis=1)
    mass, along = inertias(train), direction(train)
    momenta = v * mass * along
    size = np.max(np.abs(momenta))
    # The impulse on the part of the train up to each contact; the last one is that of the wall.
    impulses = -np.cumsum(np.diff(momenta, axis=0), axis=1)
    assert np.all(impulses >= -1e-9 * size)
    if train.wall == np.inf:
        np.testing.assert_allclose(np.sum(momenta, axis=1) / size, np.sum(momenta[0]) / size, rtol=0.0, atol=1e-9)
    else:
        contact = run.parts[-1]
        struck = (impulses[:, 4] > 1e-9 * size) & (np.diff(run.ts) == 0.0)
        assert np.all(np.abs(contact.flange.s[1:][struck] - contact.s_min) < 1e-6)
    energies = 0.5 * np.sum(mass * v**2, axis=1)
    assert np.all(np.diff(energies) <= 1e-9 * energies[0])
    assert abs(run.energy.imbalance) < 1e-9 * energies[0]
    for i in range(4):
        assert np.min(run.parts[5 + i].s_rel) > -1e-6


def wire_planetary(gear: Any, sun: Any, ring: Any, carrier: Any, stop: Any) -> Connections:
    return (
        connect(gear.sun, sun.a, stop.flange),
        connect(gear.ring, ring.a),
        connect(gear.carrier, carrier.a),
    )


@pytest.mark.parametrize("e", [0.0, 0.6])
def test_a_stop_in_a_planetary_gear_with_two_degrees_of_freedom(e: float) -> None:
    """With q = (sun, ring) and rows of A for the speeds of sun, ring and carrier, M = A^T J A. The stop changes q by
    M^-1 n p, where n^T q after is -e times that before.
    """
    J, i, before = np.array([0.02, 0.3, 0.1]), 2.5, np.array([4.0, -1.0])
    A = np.array([[1.0, 0.0], [0.0, 1.0], [1.0 / (1.0 + i), i / (1.0 + i)]])
    M, n = A.T @ np.diag(J) @ A, np.array([1.0, 0.0])
    response = np.linalg.solve(M, n)
    after = before - response * (1.0 + e) * before[0] / response[0]
    parts = (
        PlanetaryGear(ring_to_sun=i),
        Inertia(J=J[0], w=before[0], phi=0.0),
        Inertia(J=J[1], w=before[1], phi=0.0),
        Inertia(J=J[2]),
        rotational.HardStop(phi_max=1.0, restitution=e),
    )
    run = simulate(Rig(parts=parts, wiring=wire_planetary), 0.3, energy=True)
    final = run.final.parts
    np.testing.assert_allclose([final[1].w, final[2].w], after, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(final[3].w, A[2] @ after, rtol=1e-9)
    loss = 0.5 * (before @ M @ before - after @ M @ after)
    np.testing.assert_allclose(run.energy.events["parts[4].impact_high"], loss, rtol=1e-9)


def wire_floating_lever(lever: Any, a: Any, b: Any, pivot: Any, stop: Any) -> Connections:
    return connect(lever.a, a.a, stop.flange), connect(lever.b, b.a), connect(lever.fulcrum, pivot.a)


def test_a_stop_at_a_lever_on_a_moving_fulcrum() -> None:
    """Two degrees of freedom, a and the fulcrum f: v_b = v_f + (b / a) (v_f - v_a)."""
    m, r, before = np.array([0.5, 2.0, 1.2]), 1.5, np.array([-3.0, 0.4])
    A = np.array([[1.0, 0.0], [-r, 1.0 + r], [0.0, 1.0]])
    M, n = A.T @ np.diag(m) @ A, np.array([1.0, 0.0])
    response = np.linalg.solve(M, n)
    after = before - response * 1.4 * before[0] / response[0]
    parts = (
        Lever(arm_a=1.0, arm_b=r, fulcrum=translational.Flange()),
        Mass(m=m[0], v=before[0], s=0.0),
        Mass(m=m[1]),
        Mass(m=m[2], v=before[1], s=0.0),
        HardStop(s_min=-0.5, restitution=0.4),
    )
    final = simulate(Rig(parts=parts, wiring=wire_floating_lever), 0.2, save="end").final.parts
    np.testing.assert_allclose([final[1].v, final[3].v], after, rtol=1e-9)
    np.testing.assert_allclose(final[2].v, A[1] @ after, rtol=1e-9)


def wire_pair_on_friction(a: Any, contact: Any, b: Any, friction: Any) -> Connections:
    return connect(a.b, contact.a), connect(contact.b, b.a), connect(b.b, friction.flange)


def test_stuck_friction_takes_no_impulse() -> None:
    """It is finite: the struck body gets its whole share, and then slides m v / F long."""
    parts = (
        Mass(m=2.0, s=-1.0, v=3.0),
        RigidContact(restitution=0.5),
        Mass(m=1.0, s=0.0),
        StribeckFriction(Fc=4.0, Fs=6.0, vs=0.1),
    )
    run = simulate(Rig(parts=parts, wiring=wire_pair_on_friction), 1.0 / 3.0 + 1e-6, energy=True)
    final = run.final.parts
    np.testing.assert_allclose([final[0].v, final[2].v], [1.5, 3.0], rtol=1e-5)
    assert abs(run.energy.imbalance) < 1e-9


def wire_jack(motor: Any, screw: Any, gear: Any, nut: Any, load: Any, stop: Any) -> Connections:
    return (
        connect(motor.flange, screw.a),
        connect(screw.b, gear.a),
        connect(gear.b, nut.a, load.flange, stop.flange),
    )


def test_a_self_locking_gear_that_lowers_a_load_onto_a_stop() -> None:
    """The load drives the mesh before the impact, at a negative efficiency. The impulse takes its momentum."""
    parts = (
        ConstantTorque(torque=-3.0),
        Inertia(J=0.01, phi=0.0),
        LossyGear.worm(ratio=10.0, efficiency=0.3),
        Inertia(J=0.1),
        ConstantTorque(torque=-20.0),
        rotational.HardStop(phi_min=-2.0, restitution=0.5),
    )
    run = simulate(Rig(parts=parts, wiring=wire_jack), 1.1)
    row = int(np.argmax(run.parts[3].a.phi < -2.0 + 1e-9))
    before, after = run.parts[3].w[row : row + 2]
    assert before < -1.0
    np.testing.assert_allclose(after, -0.5 * before, rtol=1e-9)
    assert np.min(run.parts[3].a.phi) > -2.0 - 1e-9


def wire_given(a: Any, contact: Any, b: Any) -> Connections:
    return connect(a.flange, contact.a), connect(contact.b, b.flange)


def test_a_contact_between_given_motions_ends_the_run() -> None:
    """No impulse changes their speeds."""
    parts = (ConstantSpeed(speed=1.0), RigidContact(restitution=0.5, s_rel0=-0.5), ConstantSpeed(speed=0.0))
    with pytest.raises(SimulationError, match=r"At t = 0\.5 s: After the event parts\[1\]\.impact"):
        simulate(Rig(parts=parts, wiring=wire_given), 1.0, save="end")


def struck(x: Any) -> Any:
    """The speeds of four bodies after several impacts, also through a closed contact."""
    m, v, e = x[:4], x[4], x[5:]
    closed = jnp.array([0.0, 1.0, 0.0])
    start = [v, 0.0, 0.0, -0.1]
    final = simulate(row(m, start, [0.0, 1.0, 1.0, 1.3], e, closed), 2.0, save="end", rtol=1e-9).final.parts
    return jnp.stack([final[i].v for i in range(4)] + [final[i].b.s for i in range(4)])


X = np.array([1.3, 0.8, 2.1, 0.5, 2.0, 0.6, 0.3, 0.8])


@pytest.mark.thorough
def test_derivatives_through_impacts() -> None:
    """Both modes against differences, forward mode in a batch."""
    found = jax.jit(struck)
    step = 1e-5
    expected = np.stack([(found(X + d) - found(X - d)) / (2.0 * step) for d in step * np.eye(len(X))], axis=1)
    forward = jax.jit(jax.vmap(jax.jacfwd(struck)))(X * np.array([[1.0], [1.01]]))[0]
    np.testing.assert_allclose(forward, expected, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(jax.jacrev(struck)(X), forward, rtol=1e-9, atol=1e-10)
