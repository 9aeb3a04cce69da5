"""Arguments known from the Modelica Standard Library, and classes with the same name in several domains."""

import dataclasses
import inspect
import re
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from _rig import Rig

from acausal import ArgumentError, Component, Connections, ParameterError, UnknownNameError, connect, quantity, simulate
from acausal.testing import check_law, solved
from components import blocks, electrical, rotational, thermal, translational


def test_fixed_points_lie_where_they_are_said_to() -> None:
    check_law(rotational.Fixed(phi0=0.4), {}, {"flange.phi": 0.4, "der(flange.phi)": 0.0})
    check_law(translational.Fixed(s0=-0.3), {}, {"flange.s": -0.3, "der(flange.s)": 0.0})


TIMES = np.array([-1.0, 0.0, 0.2, 0.3, 1.0, 2.5])
SINCE = np.maximum(TIMES - 0.3, 0.0)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (blocks.Clock(offset=0.5, start_time=0.3), 0.5 + SINCE),
        (
            blocks.Sine(amplitude=2.0, frequency=0.5, phase=0.1, offset=0.5, start_time=0.3),
            0.5 + 2.0 * np.sin(np.pi * SINCE + 0.1) * (TIMES >= 0.3),
        ),
        (
            blocks.ChirpSine(amplitude=2.0, f0=0.2, f1=0.6, duration=2.0, offset=0.5, start_time=0.3),
            0.5 + 2.0 * np.sin(2.0 * np.pi * (0.2 * SINCE + 0.1 * SINCE**2)),
        ),
    ],
)
def test_sources_wait_for_their_start_time(source: Component, expected: np.ndarray) -> None:
    np.testing.assert_allclose(solved(source, {"t": TIMES})["y.value"], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("cls", "name", "answer"),
    [
        (blocks.Sine, "startTime", "Did you mean start_time?"),
        (blocks.Sine, "f", "Here it is frequency."),
        (blocks.LimPID, "yMax", "Did you mean y_max?"),
        (blocks.FirstOrder, "y_start", "Here it is x."),
        (electrical.Capacitor, "v_start", "Did you mean v?"),
        (electrical.Resistor, "alpha", "Here it is a parameter of HeatingResistor."),
        (rotational.Fixed, "phi", "Did you mean phi0?"),
        (rotational.Inertia, "w_start", "Did you mean w?"),
        (rotational.IdealGear, "useSupport", "Did you mean support?"),
        (rotational.PlanetaryGear, "ratio", "Here it is ring_to_sun."),
        (rotational.BearingFriction, "tau_pos", "Here it is speeds and torques."),
        (translational.Fixed, "s", "Did you mean s0?"),
        (translational.ConstantForce, "f_constant", "Here it is force."),
    ],
)
def test_other_names_are_answered_with_the_right_one(cls: Any, name: str, answer: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        cls(**{name: 1.0})
    assert str(caught.value).startswith(f"{cls.__name__} takes no argument {name!r}. {answer} It takes ")


@pytest.mark.parametrize(
    ("part", "name", "answer"),
    [
        (rotational.Inertia(J=1.0), "flange_a", "Did you mean a?"),
        (electrical.EMF(k=1.0), "flange", "Here it is shaft."),
        (rotational.SpeedSensor(), "w", "It has flange, y."),
    ],
)
def test_other_names_of_ports_are_answered(part: Component, name: str, answer: str) -> None:
    with pytest.raises(UnknownNameError, match=rf"{name}'\. {re.escape(answer)}$"):
        getattr(part, name)


def test_names_elsewhere_are_none_here_and_tell_what_is() -> None:
    domains = (blocks, electrical, rotational, translational, thermal)
    classes = {name: getattr(domain, name) for domain in domains for name in _classes(domain)}
    assert sum(bool(cls.elsewhere) for cls in classes.values()) > 20
    for cls in classes.values():
        own = {field.name for field in dataclasses.fields(cls)}
        for other, here in cls.elsewhere.items():
            assert other not in own, f"{cls.__name__}.{other}"
            assert here.startswith("left out") or set(re.findall(r"\w+", here)) & (own | classes.keys()), cls.__name__


def _twins(name: str) -> tuple[Any, Any]:
    return getattr(rotational, name), getattr(translational, name)


def _classes(domain: ModuleType) -> set[str]:
    return {name for name, item in inspect.getmembers(domain, inspect.isclass) if issubclass(item, Component)}


def test_what_has_one_name_in_both_domains_has_one_law() -> None:
    """Smooth or sticking, with events or without, with the same discrete variables and path parameters."""
    for name in sorted(_classes(rotational) & _classes(translational)):
        one, other = _twins(name)
        assert hasattr(one, "__mro__")
        for aspect in ("events", "energy"):
            states = [getattr(cls, aspect) is not getattr(Component, aspect) for cls in (one, other)]
            assert states[0] == states[1], f"{name}.{aspect}"
        general = {"acceleration", "path", "rest", "creep", "mode", "moving", "restitution", "piece", "forward"}
        names = [general & set(inspect.signature(cls.__init__).parameters) for cls in (one, other)]
        assert names[0] == names[1], name


@pytest.mark.thorough
def test_friction_twins_give_the_same_numbers() -> None:
    speeds = np.array([-2.0, -0.01, 0.3, 1.5])
    for name, extra in (("SmoothStribeckFriction", {"0": 0.1}), ("StribeckFriction", {})):
        one, other = _twins(name)
        turning = one(Tc=0.4, Ts=0.6, ws=0.5, **{f"w{key}": value for key, value in extra.items()})
        sliding = other(Fc=0.4, Fs=0.6, vs=0.5, **{f"v{key}": value for key, value in extra.items()})
        rest = {} if extra else {"acceleration": 0.0}
        torque = solved(turning, {"w": speeds} | rest)["flange.tau"]
        np.testing.assert_allclose(torque, solved(sliding, {"v": speeds} | rest)["flange.f"], rtol=1e-12)
        level = 0.4 + 0.2 * np.exp(-((speeds / 0.5) ** 2))
        sign = np.tanh(speeds / 0.1) if extra else np.sign(speeds)
        np.testing.assert_allclose(torque, level * sign, rtol=1e-9)


def ring(supply: Any, inductor: Any, capacitor: Any, resistor: Any, helper: Any, ground: Any) -> Connections:
    return (
        connect(supply.p, inductor.p),
        connect(inductor.n, resistor.p),
        connect(resistor.n, helper.p),
        connect(helper.n, capacitor.p),
        connect(capacitor.n, supply.n, ground.p),
    )


@pytest.mark.thorough
def test_a_negative_resistor_undoes_the_damping_of_a_circuit() -> None:
    """The circuit oscillates as without resistance, and the energy account shows the supply."""
    parts = (
        electrical.ConstantVoltage(V=0.0),
        electrical.Inductor(L=0.5),
        electrical.Capacitor(C=0.5, v=1.0),
        electrical.Resistor(R=0.3),
        electrical.NegativeResistor(R=0.3),
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=ring), np.pi, save="end", rtol=1e-9, energy=True)
    np.testing.assert_allclose(solution.final.parts[2].v, 1.0, rtol=1e-6)
    np.testing.assert_allclose(solution.energy.supplied["parts[4]"], solution.energy.dissipated["parts[3]"], rtol=1e-6)


def test_a_resistor_names_what_has_a_negative_resistance() -> None:
    message = r"^Resistor\.R must be nonnegative and finite \(otherwise use NegativeResistor\), got -3\.0 ohm\.$"
    with pytest.raises(ParameterError, match=message):
        electrical.Resistor(R=-3.0)
    assert electrical.NegativeResistor(R=3.0).R == 3.0
    with pytest.raises(ParameterError, match="use NegativeResistor"):
        electrical.Conductor(G=-3.0)


def hang(body: Any, spring: Any, wall: Any) -> Connections:
    return connect(wall.flange, spring.a), connect(spring.b, body.a)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("body", "spring", "wall", "place"),
    [
        (
            rotational.Inertia(J=0.5, phi=1.2, w=0.3),
            rotational.Spring(c=2.0),
            rotational.Fixed(phi0=0.4),
            "phi",
        ),
        (
            translational.Mass(m=0.5, s=1.2, v=0.3),
            translational.Spring(c=2.0),
            translational.Fixed(s0=0.4),
            "s",
        ),
        (
            translational.Mass(m=0.5, L=0.2, s=1.3, v=0.3),
            translational.Spring(c=2.0),
            translational.Fixed(s0=0.4),
            "s",
        ),
        (
            translational.SlidingMass(m=0.5, L=0.2, s=1.3, v=0.3),
            translational.Spring(c=2.0),
            translational.Fixed(s0=0.4),
            "s",
        ),
    ],
)
def test_bodies_start_where_they_are_said_to(body: Any, spring: Any, wall: Any, place: str) -> None:
    """Swinging about the fixed point with 2 rad/s: 0.4 + 0.8 cos(2 t) + 0.15 sin(2 t)."""
    end = simulate(Rig(parts=(body, spring, wall), wiring=hang), 0.7, save="end", rtol=1e-9).final.parts[0]
    expected = 0.4 + 0.8 * np.cos(1.4) + 0.15 * np.sin(1.4)
    np.testing.assert_allclose(getattr(end.a, place), expected, rtol=1e-7)


def test_the_place_of_a_body_reads_that_of_its_flange() -> None:
    assert rotational.Inertia(J=1.0, phi=quantity(90.0, "deg")).phi == pytest.approx(0.5 * np.pi)
    mass = translational.Mass(m=1.0, L=quantity(40.0, "cm"), s=0.3)
    assert (mass.s, mass.a.s) == (pytest.approx(0.3), pytest.approx(0.1))
    check_law(translational.Mass(m=2.0, L=0.4), {"a.s": 0.1, "a.f": 3.0, "b.f": 1.0}, {"b.s": 0.5, "der(v)": 2.0})


def test_the_place_of_a_body_leaves_what_else_its_flange_starts_from() -> None:
    body = rotational.Inertia(J=1.0, phi=0.1, a=rotational.Flange(tau=0.2))
    assert (body.a.phi, body.a.tau) == (pytest.approx(0.1), 0.2)


def test_a_body_starts_at_one_place() -> None:
    with pytest.raises(ArgumentError, match=r"from phi=\.\.\. or from a=Flange\(phi=\.\.\.\), not from both"):
        rotational.Inertia(J=1.0, phi=0.1, a=rotational.Flange(phi=0.2))
    with pytest.raises(ParameterError, match=r"Mass\.s must be a real number"):
        translational.Mass(m=1.0, L=0.1, s="a")  # pyright: ignore[reportArgumentType]
