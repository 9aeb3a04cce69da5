"""Ports at which nothing takes up the flow."""

from typing import Any

import numpy as np
import pytest

from acausal import Component, Connections, check, connect, simulate
from acausal._evaluate.building import system_of
from acausal._reduce.flatten import flatten
from acausal._show.check import free_ports
from components.electrical import Capacitor, ConstantVoltage, DCMotor, Ground, Resistor, VoltageSensor
from components.rotational import (
    AngleSensor,
    Fixed,
    IdealGear,
    Inertia,
    MeshLoss,
    PlanetaryGear,
    PlanetaryGearbox,
    SpeedSensor,
    SpringDamper,
    TorqueSensor,
)
from components.translational import Mass


class Assembly(Component):
    """Parts with connections by name, such as ("a.b", "b.a")."""

    parts: tuple[Component, ...]
    joints: tuple[tuple[str, ...], ...]

    def connections(self) -> Connections:
        def port(name: str) -> Any:
            number, _, own = name.partition(".")
            return getattr(self.parts[int(number)], own)

        return tuple(connect(*map(port, joint)) for joint in self.joints)


def inertia() -> Inertia:
    return Inertia(J=1.0)


def spring() -> SpringDamper:
    return SpringDamper(c=1.0, d=1.0)


def notes(parts: tuple[Component, ...], *joints: tuple[str, ...]) -> list[str]:
    return list(free_ports(system_of(Assembly(parts=parts, joints=joints)).flat))


GEARS: dict[str, tuple[Component, str]] = {
    "ideal": (PlanetaryGear(ring_to_sun=3.0), "sun.tau, carrier.tau are zero"),
    "with inertia": (PlanetaryGearbox(ratio=4.0, J_sun=0.1, J_carrier=0.1), "tau_mesh is zero"),
    "with loss": (PlanetaryGearbox(ratio=4.0, loss=MeshLoss(efficiency=0.9)), "tau_mesh is zero"),
}
ENDS = ("sun", "ring", "carrier")


# The inertia of a gearbox takes up the torque of a free sun or carrier.
@pytest.mark.parametrize(
    ("gear", "end"), [*(("ideal", end) for end in ENDS), ("with inertia", "ring"), ("with loss", "ring")]
)
def test_a_free_shaft_of_a_planetary_gear_is_named(gear: str, end: str) -> None:
    one, other = (name for name in ENDS if name != end)
    parts, joints = (inertia(), GEARS[gear][0], inertia()), (("0.b", f"1.{one}"), (f"1.{other}", "2.a"))
    (note,) = notes(parts, *joints)
    assert note.startswith(f"{end} of parts[1] is free: nothing takes up the torque there, so ")
    for last, part in (("3.flange", Fixed()), ("3.a", inertia())):
        assert notes((*parts, part), *joints, (last, f"1.{end}")) == []


@pytest.mark.parametrize("gear", GEARS)
def test_what_a_free_ring_means_is_what_a_run_shows(gear: str) -> None:
    model = Assembly(
        parts=(Inertia(J=1.0, w=3.0), GEARS[gear][0], inertia()), joints=(("0.b", "1.sun"), ("1.carrier", "2.a"))
    )
    found = check(model)
    assert found
    text = str(found)
    assert text.startswith("No errors found, but:\n- ring of parts[1] is free: nothing takes up the torque there, so ")
    assert GEARS[gear][1] in text
    moved = simulate(model, 1.0)["parts[2].w"]
    np.testing.assert_allclose(moved, 0.0, atol=1e-12)


FREE: dict[str, tuple[tuple[Component, ...], tuple[tuple[str, ...], ...], list[str]]] = {
    "spring": (
        (Fixed(), spring()),
        (("0.flange", "1.a"),),
        ["b of parts[1] is free: nothing takes up the torque there, so tau, a.tau are zero."],
    ),
    "behind a gear": (
        (inertia(), IdealGear(ratio=2.0)),
        (("0.b", "1.a"),),
        ["b of parts[1] is free: nothing takes up the torque there, so a.tau is zero."],
    ),
    "sensor behind a gear": (
        (inertia(), IdealGear(ratio=2.0), AngleSensor()),
        (("0.b", "1.a"), ("1.b", "2.flange")),
        ["b of parts[1] is free: nothing takes up the torque there, so a.tau is zero."],
    ),
    "mass": ((Mass(m=1.0),), (), ["Nothing acts on parts[0]: a and b are free."]),
    "mass with a sensor": (
        (inertia(), SpeedSensor()),
        (("0.b", "1.flange"),),
        ["Nothing acts on parts[0]: a and b are free."],
    ),
}
INTENDED: dict[str, tuple[tuple[Component, ...], tuple[tuple[str, ...], ...]]] = {
    "end of a shaft": ((Fixed(), spring(), inertia()), (("0.flange", "1.a"), ("1.b", "2.a"))),
    "sensor": (
        (Fixed(), spring(), inertia(), AngleSensor(), SpeedSensor()),
        (("0.flange", "1.a"), ("1.b", "2.a"), ("2.b", "3.flange", "4.flange")),
    ),
    "sensor of torque": (
        (Fixed(), spring(), TorqueSensor(), inertia()),
        (("0.flange", "1.a"), ("1.b", "2.a"), ("2.b", "3.a")),
    ),
    "motor without load": (
        (ConstantVoltage(V=1.0), DCMotor(R=1.0, L=1.0, k=1.0, J=1.0), Ground()),
        (("0.p", "1.p"), ("0.n", "1.n", "2.p")),
    ),
    "voltage of an open node": (
        (ConstantVoltage(V=1.0), Resistor(R=1.0), Capacitor(C=1.0), Ground(), VoltageSensor()),
        (("0.p", "1.p"), ("1.n", "2.p", "4.p"), ("0.n", "2.n", "3.p", "4.n")),
    ),
}


@pytest.mark.parametrize("name", FREE)
def test_free_ports_are_named(name: str) -> None:
    parts, joints, said = FREE[name]
    assert notes(parts, *joints) == said


@pytest.mark.parametrize("name", INTENDED)
def test_intended_open_ports_are_not(name: str) -> None:
    parts, joints = INTENDED[name]
    assert notes(parts, *joints) == []


def test_ports_of_the_model_itself_are_connected_elsewhere() -> None:
    for part in (inertia(), IdealGear(ratio=2.0), PlanetaryGear(ring_to_sun=3.0)):
        assert list(free_ports(flatten(part))) == []
