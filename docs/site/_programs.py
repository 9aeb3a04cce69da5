"""A program for each example: the component between partners that suit its ports, ready to run."""

import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

from acausal import Component, Port

from ._examples import Example


class _Partner(NamedTuple):
    """Parts at a port with their connections; `PORT` stands for the port."""

    parts: dict[str, str]
    connections: tuple[str, ...]


_GROUND = {"ground": "electrical.Ground()"}
_FIRST = {
    "electrical.Pin": _Partner(
        {"supply": "electrical.ConstantVoltage(V=12.0)", "cable": "electrical.Resistor(R=0.1)", **_GROUND},
        ("self.supply.p, self.cable.p", "self.cable.n, PORT", "self.supply.n, self.ground.p"),
    ),
    "rotational.Flange": _Partner(
        {"torque": "rotational.ConstantTorque(torque=1.0)", "rotor": "rotational.Inertia(J=1e-3)"},
        ("self.torque.flange, self.rotor.a", "self.rotor.b, PORT"),
    ),
    "translational.Flange": _Partner(
        {"force": "translational.ConstantForce(force=100.0)", "mass": "translational.Mass(m=1.0)"},
        ("self.force.flange, self.mass.a", "self.mass.b, PORT"),
    ),
    "planar.Frame": _Partner(
        {"base": "planar.Body(m=2.0, J=0.02)", "arm": "planar.FixedTranslation(rx=0.5)"},
        ("self.base.frame, self.arm.a", "self.arm.b, PORT"),
    ),
    "hydraulic.FluidPort": _Partner(
        {"pump": "hydraulic.ConstantPressure(pressure=100e5)", "hose": "hydraulic.LaminarResistance(resistance=1e9)"},
        ("self.pump.port, self.hose.a", "self.hose.b, PORT"),
    ),
    "thermal.HeatPort": _Partner(
        {"room": "thermal.FixedTemperature(temperature=293.15)", "wall": "thermal.ThermalConductor(G=1.0)"},
        ("self.room.port, self.wall.a", "self.wall.b, PORT"),
    ),
    "blocks.Input": _Partner({"signal": "blocks.Constant(k=0.5)"}, ("PORT, self.signal.y",)),
}
_NEXT = {
    "electrical.Pin": _Partner(
        {"load": "electrical.Resistor(R=100.0)", **_GROUND}, ("PORT, self.load.p", "self.load.n, self.ground.p")
    ),
    "rotational.Flange": _Partner(
        {"load": "rotational.Inertia(J=0.01)", "bearing": "rotational.ViscousFriction(C=0.01)"},
        ("PORT, self.load.a", "self.load.b, self.bearing.flange"),
    ),
    "translational.Flange": _Partner(
        {"load": "translational.Mass(m=1.0)", "guide": "translational.ViscousFriction(C=100.0)"},
        ("PORT, self.load.a", "self.load.b, self.guide.flange"),
    ),
    "planar.Frame": _Partner({"body": "planar.Body(m=1.0, J=0.01)"}, ("PORT, self.body.frame",)),
    "hydraulic.FluidPort": _Partner({"tank": "hydraulic.Tank()"}, ("PORT, self.tank.port",)),
}
_SPECIAL = {"IdealOpAmp", "PurgeValve", "Vessel"}  # work in circuits of their own kind only
_MODULES = {"jax": "import jax", "jnp": "import jax.numpy as jnp"}
_RETURNS = {"n", "n1", "n2", "reference"}  # pins that are grounded


def program(example: Example) -> str:
    """The code of the example in a model; empty for records, and for parts without a suitable partner."""
    name = type(example.instance).__name__
    if not isinstance(example.instance, Component) or name in _SPECIAL:
        return ""
    try:
        parts, connections = _surroundings(example.instance)
    except KeyError:
        return ""
    imports = {package: set(names) for package, names in example.imports.items()}
    for code in parts.values():
        package, _, call = code.partition(".")
        imports.setdefault(f"components.{package}", set()).add(call.partition("(")[0])
    return "\n".join([
        *(line for name, line in _MODULES.items() if f"{name}." in example.code),
        "",
        "from acausal import Component, Connections, connect, simulate",
        *(f"from {package} import {', '.join(sorted(names))}" for package, names in sorted(imports.items())),
        "\n\nclass Example(Component):",
        *(f"    {field}: {_class(code)}" for field, code in {"part": f".{name}", **parts}.items()),
        "\n    def connections(self) -> Connections:",
        "        return (",
        *(f"            connect({ports})," for ports in connections),
        "        )",
        "\n\nexample = Example(",
        f"    part={textwrap.indent(example.code, '    ').lstrip()},",
        *(f"    {field}={code.partition('.')[2]}," for field, code in parts.items()),
        ")",
        "solution = simulate(example, t1=0.1)",
    ]).lstrip()  # fmt: skip


def _class(code: str) -> str:
    return code.partition(".")[2].partition("(")[0]


def _surroundings(part: Component) -> tuple[dict[str, str], list[str]]:
    """Partners of all ports by name, and the connections."""
    parts: dict[str, str] = {}
    connections: list[str] = []
    seen: set[str] = set()
    for path, kind in _ports(part):
        if kind == "blocks.Output":
            continue
        if kind == "electrical.Pin" and path in _RETURNS:
            partner = _Partner(_GROUND, ("PORT, self.ground.p",))
        else:
            partner = _NEXT.get(kind, _FIRST[kind]) if kind in seen else _FIRST[kind]
            seen.add(kind)
        names = {
            name: name if name == "ground" or name not in parts else f"{name}_{len(parts)}" for name in partner.parts
        }
        parts |= {names[name]: code for name, code in partner.parts.items()}
        for line in partner.connections:
            for name, own in names.items():
                line = line.replace(f"self.{name}.", f"self.{own}.")
            connections.append(line.replace("PORT", f"self.part.{path}"))
    return parts, connections


def _ports(part: Component) -> Iterator[tuple[str, str]]:
    """The ports of a component with their kinds, as package and class."""
    for name, value in vars(part).items():
        many: Any = value if isinstance(value, tuple | list) else [value]
        for index, port in enumerate(many):
            if isinstance(port, Port):
                place = name if many[0] is value else f"{name}[{index}]"
                yield place, f"{type(port).__module__.split('.')[1]}.{type(port).__name__}"
