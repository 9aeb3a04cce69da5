"""Models whose first results are timed."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from acausal import Component, Connections, connect, simulate
from components.blocks import SignalSource, Sine, Step
from components.electrical import Ground, IdealDiode, Resistor, SignalVoltage
from components.rotational import Clutch, Inertia, SignalTorque
from docs._execute import namespace
from studies import opening_time
from studies.actuators import ElectromechanicalActuator, ehs_sticking, ema_maxon

from ._dual_clutch import dual_clutch, torque
from ._press import Press, press


class Clutches(Component):
    """Four actuators that share nothing but the time."""

    actuators: tuple[ElectromechanicalActuator, ...]

    def connections(self) -> Connections:
        return ()


class Rectifier(Component):
    """Three phases in star, six diodes, a resistor."""

    sines: tuple[Sine, ...]
    sources: tuple[SignalVoltage, ...]
    upper: tuple[IdealDiode, ...]
    lower: tuple[IdealDiode, ...]
    load: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        rows = list(zip(self.sines, self.sources, self.upper, self.lower, strict=True))
        return (
            *(connect(sine.y, source.u) for sine, source, _, _ in rows),
            *(connect(source.p, upper.p, lower.n) for _, source, upper, lower in rows),
            connect(self.ground.p, *(source.n for source in self.sources)),
            connect(self.load.p, *(upper.n for upper in self.upper)),
            connect(self.load.n, *(lower.p for lower in self.lower)),
        )


class CoupledClutches(Component):
    """`CoupledClutches` of the Modelica Standard Library: four inertias, and three clutches that lock and slip."""

    torque: Sine
    drive: SignalTorque
    signals: tuple[SignalSource, ...]
    inertias: tuple[Inertia, ...]
    clutches: tuple[Clutch, ...]

    def connections(self) -> Connections:
        return (
            connect(self.torque.y, self.drive.u),
            connect(self.drive.flange, self.inertias[0].a),
            *(connect(signal.y, clutch.u) for signal, clutch in zip(self.signals, self.clutches, strict=True)),
            *(connect(inertia.b, clutch.a) for inertia, clutch in zip(self.inertias, self.clutches, strict=False)),
            *(connect(clutch.b, inertia.a) for clutch, inertia in zip(self.clutches, self.inertias[1:], strict=True)),
        )


def clutches() -> Clutches:
    return Clutches(actuators=tuple(ema_maxon(ratio=4.0 + 0.2 * k) for k in range(4)))


def last_opening(model: Clutches) -> Any:
    """The time at which the first of them, which is the slowest, is open."""
    return simulate(model, 5.0, until=lambda s: s.actuators[0].slave.rod.s - 12e-3, save="end").t1


def coupled_clutches() -> CoupledClutches:
    return CoupledClutches(
        torque=Sine(amplitude=10.0, frequency=5.0),
        drive=SignalTorque(),
        signals=(
            Sine(amplitude=1.0, frequency=0.2, phase=1.57),
            Step(height=1.0, start_time=0.4),
            Step(height=1.0, start_time=0.9),
        ),
        inertias=tuple(Inertia(J=1.0, w=10.0 if k == 0 else 0.0) for k in range(4)),
        clutches=tuple(Clutch(mu=0.5, peak=1.1, fn_max=20.0) for _ in range(3)),
    )


def last_speed(model: CoupledClutches) -> Any:
    return simulate(model, 1.5, save="end").final.inertias[3].w


def rectifier() -> Rectifier:
    return Rectifier(
        sines=tuple(Sine(amplitude=100.0, frequency=50.0, phase=-2.0 * math.pi * k / 3.0) for k in range(3)),
        sources=tuple(SignalVoltage() for _ in range(3)),
        upper=tuple(IdealDiode(Ron=1e-6, Goff=1e-6) for _ in range(3)),
        lower=tuple(IdealDiode(Ron=1e-6, Goff=1e-6) for _ in range(3)),
        load=Resistor(R=10.0),
    )


def mean_voltage(model: Rectifier) -> Any:
    return simulate(model, 0.02, integrals=lambda s: dict(v=s.load.v), save="end").integrals["v"][-1] / 0.02


def servo() -> Any:
    """The hydraulic servo of its page in the documentation: 36 states, and seals that stick."""
    with namespace(Path(__file__).parents[1] / "docs" / "servo.md", blocks=1) as page:
        return page.servo


def reached(model: Any) -> Any:
    return simulate(model, 1.5, save="end").final.load.a.s


def pressed(model: Press) -> Any:
    return simulate(model, 2.4, save="end", max_steps=200_000, max_events=200_000).final


CASES: dict[str, tuple[Callable[[], Any], Callable[[Any], Any]]] = {
    "clutch opening": (ema_maxon, opening_time),
    "sticking clutch": (ehs_sticking, opening_time),
    "four clutches": (clutches, last_opening),
    "coupled clutches": (coupled_clutches, last_speed),
    "six-diode rectifier": (rectifier, mean_voltage),
    "servo of 36 states": (servo, reached),
    "dual clutch": (dual_clutch, torque),
    "press axis": (press, pressed),
}
