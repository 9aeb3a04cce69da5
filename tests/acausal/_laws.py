"""The laws of elements as rows of numbers, written without the engine and its components."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from acausal import Scalar


class Terminal(NamedTuple):
    """Rows that pick what is across, its rate, and the flow into the element."""

    x: Any
    dx: Any
    f: Any


class Inner(NamedTuple):
    """Rows that pick an unknown of an element, and its rate."""

    y: Any
    dy: Any


def resistor(p: Terminal, n: Terminal, *, R: float) -> list[Any]:
    return [p.x - n.x - R * p.f, p.f + n.f]


def conductor(p: Terminal, n: Terminal, *, G: float) -> list[Any]:
    return [p.f - G * (p.x - n.x), p.f + n.f]


def inductor(p: Terminal, n: Terminal, i: Inner, *, L: float) -> list[Any]:
    return [p.x - n.x - L * i.dy, i.y - p.f, p.f + n.f]


def capacitor(p: Terminal, n: Terminal, v: Inner, *, C: float) -> list[Any]:
    return [p.f - C * v.dy, v.y - (p.x - n.x), p.f + n.f]


def effort_source(p: Terminal, n: Terminal, value: Scalar) -> list[Any]:
    return [p.x - n.x - value, p.f + n.f]


def flow_source(p: Terminal, n: Terminal, value: Scalar) -> list[Any]:
    return [p.f - value, p.f + n.f]


def transformer(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, n: float) -> list[Any]:
    return [p1.x - n1.x - n * (p2.x - n2.x), n * p1.f + p2.f, p1.f + n1.f, p2.f + n2.f]


def coils(
    p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, i1: Inner, i2: Inner, *, L1: float, L2: float, M: float
) -> list[Any]:
    induced = [p1.x - n1.x - L1 * i1.dy - M * i2.dy, p2.x - n2.x - M * i1.dy - L2 * i2.dy]
    return [*induced, i1.y - p1.f, i2.y - p2.f, p1.f + n1.f, p2.f + n2.f]


def gyrator(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, G: float) -> list[Any]:
    return [p1.f - G * (p2.x - n2.x), p2.f + G * (p1.x - n1.x), p1.f + n1.f, p2.f + n2.f]


def vcv(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, gain: float) -> list[Any]:
    return [p1.f, n1.f, p2.x - n2.x - gain * (p1.x - n1.x), p2.f + n2.f]


def vcc(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, G: float) -> list[Any]:
    return [p1.f, n1.f, p2.f - G * (p1.x - n1.x), p2.f + n2.f]


def ccv(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, R: float) -> list[Any]:
    return [p1.x - n1.x, p1.f + n1.f, p2.x - n2.x - R * p1.f, p2.f + n2.f]


def ccc(p1: Terminal, n1: Terminal, p2: Terminal, n2: Terminal, *, gain: float) -> list[Any]:
    return [p1.x - n1.x, p1.f + n1.f, p2.f - gain * p1.f, p2.f + n2.f]


def body(a: Terminal, b: Terminal, speed: Inner, *, mass: float) -> list[Any]:
    return [a.x - b.x, speed.y - a.dx, mass * speed.dy - a.f - b.f]


def spring(a: Terminal, b: Terminal, *, c: float) -> list[Any]:
    return [b.f - c * (b.x - a.x), a.f + b.f]


def damper(a: Terminal, b: Terminal, *, d: float) -> list[Any]:
    return [b.f - d * (b.dx - a.dx), a.f + b.f]


def spring_damper(a: Terminal, b: Terminal, *, c: float, d: float) -> list[Any]:
    return [b.f - c * (b.x - a.x) - d * (b.dx - a.dx), a.f + b.f]


def gear(a: Terminal, b: Terminal, *, ratio: float) -> list[Any]:
    return [a.x - ratio * b.x, ratio * a.f + b.f]


def planetary(sun: Terminal, ring: Terminal, carrier: Terminal, *, ring_to_sun: float) -> list[Any]:
    """Relative to the carrier, the sun turns `ring_to_sun` times as fast as the ring, the other way (Willis)."""
    kinematics = (sun.x - carrier.x) + ring_to_sun * (ring.x - carrier.x)
    return [kinematics, ring.f - ring_to_sun * sun.f, sun.f + ring.f + carrier.f]


def offset(a: Terminal, b: Terminal, distance: Any) -> list[Any]:
    return [b.x - a.x - distance, a.f + b.f]


def machine(p: Terminal, n: Terminal, shaft: Terminal, speed: Inner, *, k: float) -> list[Any]:
    return [p.x - n.x - k * speed.y, speed.y - shaft.dx, shaft.f + k * p.f, p.f + n.f]


# What an element is called inside the library, as far as it is an unknown of its own here.
INNER: Mapping[str, tuple[str, ...]] = {
    "Inductor": ("i",),
    "Capacitor": ("v",),
    "Transformer": ("i1", "i2"),
    "Inertia": ("w",),
    "Mass": ("v",),
    "EMF": ("w",),
    "TranslationalEMF": ("v",),
}

# A law with an argument `u` takes the row of its source there: of the sine that drives it, or of the number 1.
LAWS: Mapping[str, Callable[..., list[Any]]] = {
    "Ground": lambda p: [p.x],
    "Resistor": resistor,
    "Conductor": conductor,
    "Inductor": inductor,
    "Capacitor": capacitor,
    "ConstantVoltage": lambda p, n, *, u, V: effort_source(p, n, V * u),
    "ConstantCurrent": lambda p, n, *, u, I: flow_source(p, n, I * u),  # noqa: E741
    "SignalVoltage": lambda p, n, *, u: effort_source(p, n, u),
    "SignalCurrent": lambda p, n, *, u: flow_source(p, n, u),
    "IdealTransformer": transformer,
    "Transformer": coils,
    "Gyrator": gyrator,
    "VCV": vcv,
    "VCC": vcc,
    "CCV": ccv,
    "CCC": ccc,
    "VoltageSensor": lambda p, n: [p.f, n.f],
    "CurrentSensor": lambda p, n: [p.x - n.x, p.f + n.f],
    "Fixed": lambda flange: [flange.x],
    "Inertia": lambda a, b, w, *, J: body(a, b, w, mass=J),
    "Mass": lambda a, b, v, *, m: body(a, b, v, mass=m),
    "Spring": spring,
    "Damper": damper,
    "SpringDamper": spring_damper,
    "ConstantTorque": lambda flange, *, u, torque: [flange.f + torque * u],
    "ConstantForce": lambda flange, *, u, force: [flange.f + force * u],
    "SignalTorque": lambda flange, *, u: [flange.f + u],
    "SignalForce": lambda flange, *, u: [flange.f + u],
    "ConstantSpeed": lambda flange, *, u, speed: [flange.dx - speed * u],
    "SignalSpeed": lambda flange, *, u: [flange.dx - u],
    "SignalAngle": lambda flange, *, u: [flange.x - u],
    "SignalPosition": lambda flange, *, u: [flange.x - u],
    "IdealGear": gear,
    "IdealGearR2T": lambda shaft, rod, *, ratio: gear(shaft, rod, ratio=ratio),
    "PlanetaryGear": planetary,
    "Disc": lambda a, b, *, u, delta_phi: offset(a, b, delta_phi * u),
    "Rod": lambda a, b, *, u, L: offset(a, b, L * u),
    "EMF": machine,
    "TranslationalEMF": machine,
}
