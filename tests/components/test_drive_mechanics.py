"""Gears, screws, cranks, cams and disc springs against closed forms, derivatives and published laws."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from acausal import ArgumentError, Connections, ParameterError, connect, simulate
from acausal.testing import check_law, solved
from components import rotational, translational
from components.rotational import (
    BSplineMotion,
    Cycloidal,
    EccentricDisc,
    EqualMeshLoss,
    FlatEccentricDisc,
    FlatFollower,
    Helix,
    LossyGearR2T,
    ModifiedSine,
    Motion,
    PlanetaryGearbox,
    Polynomial345,
    RiseDwellReturn,
    RollerFollower,
)

RATIO, ETA = 2.8, 0.97  # teeth of the ring over those of the sun, efficiency with the carrier held
SHAFTS = ("sun", "ring", "carrier")


@pytest.mark.parametrize(
    ("driver", "out", "held", "efficiency"),
    [
        ("sun", "ring", "carrier", ETA),
        ("ring", "sun", "carrier", ETA),
        ("sun", "carrier", "ring", (1.0 + RATIO * ETA) / (1.0 + RATIO)),
        ("carrier", "sun", "ring", (1.0 + RATIO) / (1.0 + RATIO / ETA)),
        ("ring", "carrier", "sun", (1.0 + ETA / RATIO) / (1.0 + 1.0 / RATIO)),
        ("carrier", "ring", "sun", (1.0 + 1.0 / RATIO) / (1.0 + 1.0 / (RATIO * ETA))),
    ],
)
def test_planetary_stage_in_all_fixings(driver: str, out: str, held: str, efficiency: float) -> None:
    """Willis for the speeds; efficiencies of Mueller, `Die Umlaufgetriebe`, and VDI 2157."""
    stage = PlanetaryGearbox(ratio=1.0 + RATIO, loss=EqualMeshLoss(efficiency=ETA, transition_power=1e-3))
    given = {f"der({driver}.phi)": 1.0, f"der({held}.phi)": 0.0, f"{driver}.tau": 1.0}
    found = solved(stage, given | {f"{driver}.phi": 0.0, f"{held}.phi": 0.0})
    speeds = {shaft: float(found[f"der({shaft}.phi)"]) for shaft in SHAFTS}
    np.testing.assert_allclose(speeds["sun"] + RATIO * speeds["ring"], (1.0 + RATIO) * speeds["carrier"], atol=1e-12)
    np.testing.assert_allclose(-found[f"{out}.tau"] * speeds[out], efficiency, rtol=1e-9)
    np.testing.assert_allclose(sum(found[f"{shaft}.tau"] for shaft in SHAFTS), 0.0, atol=1e-12)


def drive(motor: Any, train: Any, load: Any) -> Connections:
    return connect(motor.flange, train.a), connect(train.b, load.flange)


@pytest.mark.thorough
def test_a_train_of_two_stages_multiplies_ratios_and_efficiencies() -> None:
    losses = [EqualMeshLoss(efficiency=eta, transition_power=1e-3) for eta in (0.97, 0.98)]
    stages = [PlanetaryGearbox(ratio=1.0 + i, loss=loss) for i, loss in zip((3.3, 2.9), losses, strict=True)]
    train = rotational.PlanetaryTrain(stages=stages, support=rotational.Flange())
    assert train.ratio == pytest.approx(4.3 * 3.9)
    given = {"der(a.phi)": 1.0, "der(support.phi)": 0.0, "a.tau": 1.0, "a.phi": 0.0, "support.phi": 0.0}
    expected = {"b.tau": -16.140242, "der(b.phi)": 1.0 / 16.77, "support.tau": 15.140242}
    check_law(train, given, expected, rtol=1e-7)


@pytest.mark.thorough
def test_play_of_a_train_is_passed_before_it_drives() -> None:
    """From rest at one side of the backlash of 2 mrad, the load follows with the stiffness of the last stage only."""
    teeth = rotational.ElastoBacklash(c=1e3, d=0.0, play=2e-3)
    stages = [PlanetaryGearbox(ratio=4.0, J_sun=1e-6, J_carrier=1e-6)]
    train = rotational.PlanetaryTrain(stages=stages, teeth=[teeth])
    parts = (rotational.ConstantSpeed(speed=4.0), train, rotational.Fixed())
    end = simulate(Rig(parts=parts, wiring=drive), 5e-3, save="end", rtol=1e-8).final
    np.testing.assert_allclose(end.parts[2].flange.tau, 1e3 * (5e-3 - 1e-3), rtol=1e-6)


def test_a_train_takes_as_many_teeth_as_stages() -> None:
    teeth = rotational.ElastoBacklash(c=1.0, d=0.0, play=0.0)
    with pytest.raises(ArgumentError, match="takes 1 teeth, one for each stage, got 2"):
        rotational.PlanetaryTrain(stages=[PlanetaryGearbox(ratio=3.0)], teeth=[teeth, teeth])


@pytest.mark.parametrize(
    ("starts", "quotient", "mu", "driving", "driven"),
    [
        (1.0, 10.0, 0.06, 0.6064149481403124, 0.359199821717558),
        (4.0, 8.0, 0.03, 0.9249769394706157, 0.9214406832449805),
        (1.0, 12.0, 0.12, 0.39067760796723044, -0.5268097995750116),
    ],
)
def test_worms(starts: float, quotient: float, mu: float, driving: float, driven: float) -> None:
    """Niemann, Winter: forces on an inclined plane; the last one locks itself."""
    helix = Helix.of_worm(starts=starts, quotient=quotient, mu=mu)
    np.testing.assert_allclose(np.array([helix.driving, helix.driven]), [driving, driven], rtol=1e-12)
    assert (helix.driven <= 0.0) == (helix.lead <= helix.friction_angle)


def press(weight: Any, screw: Any, wheel: Any, motor: Any) -> Connections:
    return connect(weight.flange, screw.rod), connect(screw.shaft, wheel.a), connect(wheel.b, motor.flange)


@pytest.mark.thorough
@pytest.mark.parametrize(("torque", "turns"), [(0.0, 0), (8.0, 0), (9.0, 1), (-2.0, 0), (-2.6, -1)])
def test_a_screw_that_locks_itself(torque: float, turns: int) -> None:
    """d2 = 18 mm, lead 4 mm, 30 deg thread, mu = 0.12, under 5 kN: 8.8504 N.m raise it, 2.3855 N.m lower it."""
    screw = LossyGearR2T.screw(diameter=18e-3, lead=4e-3, mu=0.12, flank=np.pi / 12.0)
    parts = (
        translational.ConstantForce(force=-5000.0),
        screw,
        rotational.Inertia(J=1e-3),
        rotational.ConstantTorque(torque=torque),
    )
    end = simulate(Rig(parts=parts, wiring=press), 0.1, save="end").final
    if turns == 0:
        assert abs(end.parts[2].w) < 1e-6
    else:
        lost = 8.850419773179944 if turns > 0 else -2.385500649691384
        np.testing.assert_allclose(end.parts[2].w, (torque - lost) / 1e-3 * 0.1, rtol=1e-6)


def test_a_rack_has_the_efficiency_that_is_given() -> None:
    """Raising 100 N by a pinion of 20 mm takes 2 N.m over the efficiency; what is above that accelerates."""
    rack = LossyGearR2T.rack(radius=0.02, efficiency=0.9)
    weight, rotor = translational.ConstantForce(force=-100.0), rotational.Inertia(J=1e-3)
    parts = (weight, rack, rotor, rotational.ConstantTorque(torque=3.0))
    end = simulate(Rig(parts=parts, wiring=press), 0.1, save="end").final
    np.testing.assert_allclose(end.parts[2].w, (3.0 - 2.0 / 0.9) / 1e-3 * 0.1, rtol=1e-6)


def test_crank_and_slider() -> None:
    """r = 40 mm, l = 130 mm at 100 rad/s: positions and speeds of the closed form, and the torque of 1 kN."""
    crank = rotational.CrankSlider(crank=0.04, rod_length=0.13)
    given = {
        "shaft.phi": np.deg2rad([0.0, 30.0, 90.0, 135.0]),
        "der(shaft.phi)": 100.0,
        "slider.f": -1000.0,
    }
    check_law(
        crank,
        given,
        {
            "slider.s": [0.17, 0.16309334193802885, 0.12369316876852982, 0.09860150415703332],
            "der(slider.s)": [0.0, -2.5393598899705934, -4.0, -2.19793879975491],
            "shaft.tau": [0.0, -25.393598899705934, -40.0, -21.9793879975491],
        },
        rtol=1e-9,
    )
    # Stretched and folded, crank and rod lie in one line, whose distance to the slider's line is the offset.
    offset = rotational.CrankSlider(crank=0.04, rod_length=0.13, offset=0.03)
    dead = {"shaft.phi": np.array([np.arcsin(0.03 / 0.17), np.pi + np.arcsin(0.03 / 0.09)]), "slider.f": -1000.0}
    reach = [np.sqrt(0.17**2 - 0.03**2), np.sqrt(0.09**2 - 0.03**2)]
    check_law(offset, dead, {"slider.s": reach, "shaft.tau": 0.0}, rtol=1e-9, atol=1e-9)
    across = rotational.CrankSlider(crank=0.04, rod_length=0.13, shaft=rotational.Flange(phi=0.5 * np.pi))
    np.testing.assert_allclose(jnp.sin(across.rod_angle), 0.04 / 0.13, rtol=1e-12)
    with pytest.raises(ParameterError, match="rod_length must be above crank"):
        rotational.CrankSlider(crank=0.04, rod_length=0.05, offset=-0.02)


@pytest.mark.thorough
def test_lever_bearing_and_coupling() -> None:
    lever = translational.Lever(arm_a=0.2, arm_b=0.5)
    check_law(lever, {"a.s": 0.01, "a.f": 100.0}, {"b.s": -0.025, "b.f": 40.0})
    bearing = rotational.ReleaseBearing(mu=0.002, diameter=0.04)
    check_law(bearing, {"a.f": -1500.0, "w": 300.0}, {"shaft.tau": 0.06, "b.f": 1500.0})
    coupling = rotational.FlexibleCoupling(J_a=1e-3, J_b=2e-3, c=100.0, d=0.1, c_3=1e4)
    at_rest = {"der(w_a)": 0.0, "der(w_b)": 0.0, "phi_rel": 0.1, "w_a": 1.0, "w_b": 2.0}
    check_law(coupling, at_rest, {"a.tau": -20.1, "b.tau": 20.1})


H, BETA, RB, ROLLER = 12e-3, 2.0 * np.pi / 3.0, 30e-3, 8e-3
LAWS: tuple[tuple[Motion, float, float], ...] = (
    (Polynomial345(), 15.0 / 8.0, 10.0 / np.sqrt(3.0)),
    (Cycloidal(), 2.0, 2.0 * np.pi),
    (ModifiedSine(), 4.0 * np.pi / (4.0 + np.pi), 4.0 * np.pi**2 / (4.0 + np.pi)),
)
ANGLES = BETA * np.array([0.1, 0.25, 0.5, 0.75, 0.9])


def cam(motion: Motion) -> RiseDwellReturn:
    return RiseDwellReturn(motion=motion, height=H, rise=BETA, dwell=0.5, fall=BETA)


@pytest.mark.parametrize(("motion", "speed", "acceleration"), LAWS, ids=lambda value: type(value).__name__)
def test_motions_of_cams(motion: Motion, speed: float, acceleration: float) -> None:
    """VDI 2143-1: the largest f' and f''; at rest at both ends; symmetric about the middle."""
    u = jnp.linspace(0.0, 1.0, 20001)
    f, first, second = jax.jit(jax.vmap(motion.share)), jax.jit(jax.vmap(jax.grad(motion.share))), _second(motion)
    np.testing.assert_allclose([np.max(np.abs(first(u))), np.max(np.abs(second(u)))], [speed, acceleration], rtol=1e-7)
    ends = jnp.array([0.0, 1.0])
    np.testing.assert_allclose(f(ends), [0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose([first(ends), second(ends)], 0.0, atol=1e-12)
    np.testing.assert_allclose(f(u) + f(1.0 - u), 1.0, atol=1e-14)


def _second(motion: Motion) -> Any:
    return jax.jit(jax.vmap(jax.grad(jax.grad(motion.share))))


@pytest.mark.thorough
def test_a_spline_without_a_choice_is_the_polynomial_and_controls_shape_it() -> None:
    """Inserting knots into 3-4-5 by blossoming gives controls for which both are one curve."""
    u = jnp.linspace(0.0, 1.0, 101)
    fitted = BSplineMotion(controls=jnp.array([0.5]))
    np.testing.assert_allclose(jax.vmap(fitted.share)(u), jax.vmap(Polynomial345().share)(u), atol=1e-13)
    shaped = BSplineMotion(controls=jnp.array([0.1, 0.6]))
    ends = jnp.array([0.0, 1.0])
    np.testing.assert_allclose(jax.vmap(shaped.share)(ends), [0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(_second(shaped)(ends), 0.0, atol=1e-12)
    assert np.all(np.diff(jax.vmap(shaped.share)(u)) >= 0.0)


@pytest.mark.thorough
def test_roller_follower_of_a_cycloidal_cam() -> None:
    """The closed forms of Norton for a follower in line, and by three points of the pitch curve for an offset one."""
    profile = cam(Cycloidal())
    inline, offset = (RollerFollower(base_radius=RB, roller=ROLLER, offset=o, width=12e-3) for o in (0.0, 4e-3))
    found = inline.contact(profile, ANGLES, jnp.full(5, 500.0))
    angles = [0.028729655107923375, 0.14553715496360892, 0.2547758098121549, 0.1166141660985638, 0.021915467324431576]
    np.testing.assert_allclose(found.pressure_angle, angles, rtol=1e-11)
    radii = [0.04377746341294279, 0.05889893198250545, 0.03475215919752422, 0.02820328259718148, 0.03351658950031192]
    np.testing.assert_allclose(found.radius, radii, rtol=1e-11)
    load = 500.0 / np.cos(angles) * 113.2e9 * (1.0 / np.array(radii) + 1.0 / ROLLER) / (np.pi * 12e-3)
    np.testing.assert_allclose(found.hertz_pressure, np.sqrt(load), rtol=1e-11)
    shifted = [-0.07658695118082133, 0.04445683035863369, 0.16872406946796673, 0.035500940097596335]
    tilted = offset.contact(profile, ANGLES, jnp.full(5, 500.0))
    np.testing.assert_allclose(tilted.pressure_angle[:4], shifted, rtol=1e-10)
    for angle, radius in zip(ANGLES, tilted.radius, strict=True):
        np.testing.assert_allclose(radius + ROLLER, _by_three_points(profile, angle, 4e-3), rtol=1e-5)


def _by_three_points(profile: Any, angle: float, o: float) -> float:
    """Radius of the circle through three centres of the roller, as seen from the cam."""
    z = []
    for theta in (angle - 1e-3, angle, angle + 1e-3):
        y = float(profile.lift(theta)) + np.sqrt((RB + ROLLER) ** 2 - o**2)
        z.append((o + 1j * y) * np.exp(-1j * theta))
    a, b, c = abs(z[0] - z[1]), abs(z[1] - z[2]), abs(z[2] - z[0])
    area = 0.5 * abs(((z[1] - z[0]) * np.conj(z[2] - z[0])).imag)
    return a * b * c / (4.0 * area)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("motion", "base"),
    [(Polynomial345(), 7.701181261231067e-3), (ModifiedSine(), 6.432538741067253e-3)],
    ids=lambda value: type(value).__name__,
)
def test_least_base_circle_of_a_flat_follower_without_undercut(motion: Motion, base: float) -> None:
    follower = FlatFollower(base_radius=base)
    least = jax.jit(lambda follower: follower.least_radius(cam(motion), 0.0, BETA))
    np.testing.assert_allclose(least(follower), 3e-3, rtol=1e-8)
    slope = jax.grad(lambda r: FlatFollower(base_radius=r).least_radius(cam(motion), 0.0, BETA))
    np.testing.assert_allclose(jax.jit(slope)(base), 1.0, rtol=1e-6)


FOLLOWERS = st.one_of(
    st.builds(FlatFollower, base_radius=st.floats(2e-3, 40e-3)),
    st.builds(RollerFollower, base_radius=st.floats(5e-3, 40e-3), roller=st.floats(1e-3, 20e-3)),
)


@jax.jit
def _surface(follower: Any, profile: Any, rise: Any) -> Any:
    """Progress of the follower's envelope over steps of the angle, the contact and the least radius."""
    angles = jnp.linspace(0.0, rise, 2001)
    s, slope = jax.vmap(profile.lift)(angles), jax.vmap(profile.slope)(angles)
    if isinstance(follower, FlatFollower):
        tilt, point = jnp.zeros_like(s), slope + 1j * (follower.base_radius + s)
    else:
        centre = s + follower.base_radius + follower.roller
        tilt = jnp.arctan(slope / centre)
        point = 1j * centre - 1j * follower.roller * jnp.exp(1j * tilt)
    tangent = jnp.exp(1j * (tilt - angles))
    forward = jnp.real(jnp.diff(point * jnp.exp(-1j * angles)) * jnp.conj(tangent[1:] + tangent[:-1]))
    contact = follower.contact(profile, angles, jnp.full(2001, 100.0))
    return forward, contact, follower.least_radius(profile, 0.0, rise)


@pytest.mark.thorough
@settings(deadline=None, max_examples=60, derandomize=True, database=None)
@given(follower=FOLLOWERS, height=st.floats(1e-3, 30e-3), rise=st.floats(0.4, 2.0))
def test_undercut_is_where_the_surface_turns_back(follower: Any, height: float, rise: float) -> None:
    """Nonpositive radius and no Hertzian pressure exactly where the surface moves backward over the angle."""
    profile = RiseDwellReturn(motion=Cycloidal(), height=height, rise=rise, dwell=0.5, fall=1.0)
    forward, contact, least = _surface(follower, profile, rise)
    assume(abs(float(least)) > 1e-5)
    assert (float(least) < 0.0) == bool(np.any(forward < 0.0))
    bears = np.asarray(contact.radius) > -float(getattr(follower, "roller", np.inf))  # else it is hollow
    convex = np.asarray(contact.radius)[bears]
    assert float(least) == pytest.approx(float(np.min(convex)), rel=1e-4, abs=1e-6)
    np.testing.assert_array_equal(np.isnan(contact.hertz_pressure), bears & (np.asarray(contact.radius) < 0.0))


@pytest.mark.thorough
def test_round_cams_under_a_flat_face_and_a_roller() -> None:
    """An eccentric disc is round: its radius is everywhere that of the disc, R_b + e."""
    e, disc, roller, force = 4e-3, 20e-3, 6e-3, 300.0
    flat = FlatFollower(base_radius=disc - e)
    rolling = RollerFollower(base_radius=disc - e, roller=roller)
    angles = jnp.linspace(0.0, 6.0, 25)
    for follower, profile, curvature in (
        (flat, FlatEccentricDisc(eccentricity=e), 1.0 / disc),
        (rolling, EccentricDisc(eccentricity=e, radius=disc + roller), 1.0 / disc + 1.0 / roller),
    ):
        found = follower.contact(profile, angles, jnp.full(25, force))
        np.testing.assert_allclose(found.radius, disc, rtol=1e-9)
        load = found.normal_force * 113.2e9 * curvature / (np.pi * 10e-3)
        np.testing.assert_allclose(found.hertz_pressure, np.sqrt(load), rtol=1e-9)
        assert float(follower.least_radius(profile)) == pytest.approx(disc, rel=1e-9)


def test_no_pressure_without_contact() -> None:
    profile, follower = FlatEccentricDisc(eccentricity=2e-3), FlatFollower(base_radius=10e-3)
    found = follower.contact(profile, jnp.zeros(3), jnp.asarray([-1.0, 0.0, 1.0])).hertz_pressure
    assert np.isnan(found[0])
    assert float(found[1]) == 0.0
    assert float(found[2]) > 0.0


@pytest.mark.thorough
def test_a_hollow_stretch_has_no_least_radius() -> None:
    """Early on the rise of a high lift, the cam is concave under a roller."""
    profile = RiseDwellReturn(motion=Cycloidal(), height=40e-3, rise=0.8, dwell=0.5, fall=0.8)
    follower = RollerFollower(base_radius=15e-3, roller=4e-3)
    assert np.all(follower.contact(profile, jnp.linspace(0.1, 0.2, 9), jnp.ones(9)).radius < -4e-3)
    assert float(follower.least_radius(profile, 0.1, 0.2)) == np.inf


@pytest.mark.thorough
def test_followers_are_differentiable() -> None:
    def pressure(roller: Any, height: Any) -> Any:
        profile = RiseDwellReturn(motion=Cycloidal(), height=height, rise=BETA, dwell=0.5, fall=BETA)
        return RollerFollower(base_radius=RB, roller=roller, offset=2e-3).hertz_pressure(profile, 0.7, 400.0)

    for mode in (jax.jacfwd, jax.jacrev):
        slopes = jax.jit(mode(pressure, (0, 1)))(ROLLER, H)
        step = 1e-7
        by_roller = (pressure(ROLLER + step, H) - pressure(ROLLER - step, H)) / (2.0 * step)
        by_height = (pressure(ROLLER, H + step) - pressure(ROLLER, H - step)) / (2.0 * step)
        np.testing.assert_allclose(slopes, [by_roller, by_height], rtol=1e-6)


DISCS = {
    (3.0, 1.1): ([4254.989873493799, 8214.28503576366, 11976.450390550888, 15640.05084159681], None),
    (2.0, 1.4): ([1948.621317608545, 3490.8382838028697, 4762.119015721049, 5897.931630501153], None),
    (1.25, 1.6): ([853.751933566964, 1328.3511194588536, 1550.181806900694, 1645.6282451175096], None),
}


@pytest.mark.parametrize(("size", "expected"), DISCS.items())
def test_discs_of_din_2093(size: tuple[float, float], expected: Any) -> None:
    """De 50, Di 25.4 mm, series A, B and C, by the formula of DIN EN 16984 at s/h = 0.25 to 1."""
    t, h = size
    disc = translational.ConicalDisc(De=50e-3, Di=25.4e-3, t=t * 1e-3, h=h * 1e-3)
    s = h * 1e-3 * np.array([0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(disc.force(jnp.asarray(s)), expected[0], rtol=1e-12)
    spring = translational.DiscSpring(disc=disc, series=4.0, parallel=2.0, s_rel0=0.02)
    check_law(spring, {"s_rel": 0.02 - 4.0 * s}, {"f": -2.0 * np.array(expected[0])})
    check_law(spring, {"s_rel": [0.021]}, {"f": [0.0]})
    np.testing.assert_allclose(jax.vmap(jax.grad(disc.work))(jnp.asarray(s)), disc.force(jnp.asarray(s)), rtol=1e-12)


DIAPHRAGM = translational.Diaphragm(R=114.5e-3, r=89e-3, R_1=112.5e-3, r_1=90.5e-3, r_f=29e-3, t=2.6e-3, H=4.5e-3)


def test_diaphragm_spring_of_a_clutch() -> None:
    """Clamp load over the deflection with its maximum and minimum, release load over the stroke, and wear."""
    x = np.array([0.5e-3, 2e-3, 4e-3, 6e-3])
    loads = [1866.1163170487782, 4507.442791305581, 4146.732823230326, 4090.2824026163735]
    np.testing.assert_allclose(DIAPHRAGM.force(jnp.asarray(x)), loads, rtol=1e-12)
    turns = np.array([2.590153927711003e-3, 5.174551954641937e-3])
    np.testing.assert_allclose(DIAPHRAGM.force(jnp.asarray(turns)), [4675.08147533387, 3745.0447341422223], rtol=1e-10)
    np.testing.assert_allclose(jax.vmap(jax.grad(DIAPHRAGM.force))(jnp.asarray(turns)), 0.0, atol=1e-3)
    np.testing.assert_allclose(jax.vmap(jax.grad(DIAPHRAGM.work))(jnp.asarray(x)), loads, rtol=1e-12)
    clutch = translational.DiaphragmClutch(spring=DIAPHRAGM, engaged=3.2e-3)
    release = [1625.5534404367659, 1499.649779206349, 1344.2962772147737, 1484.246431079129]
    check_law(clutch, {"flange.s": [0.0, 2e-3, 6e-3, 8e-3]}, {"flange.f": release}, rtol=1e-9)
    worn = translational.DiaphragmClutch(spring=DIAPHRAGM, engaged=3.2e-3, wear=1.2e-3)
    check_law(worn, {"flange.s": [0.0]}, {"clamp": [4507.442791305581]}, rtol=1e-9)
    with pytest.raises(ParameterError, match="wear must be at most engaged"):
        translational.DiaphragmClutch(spring=DIAPHRAGM, engaged=1e-3, wear=1.2e-3)


@pytest.mark.thorough
def test_a_spring_of_two_rates() -> None:
    spring = translational.DualRateSpring(c_1=1e3, c_2=4e3, knee=0.01, s_rel0=0.1)
    check_law(spring, {"s_rel": [0.11, 0.095, 0.08]}, {"f": [10.0, -5.0, -50.0]})
