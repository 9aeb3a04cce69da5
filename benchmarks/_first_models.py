"""Models whose first results are timed."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from acausal import Component, Connections, connect, simulate
from components.blocks import Sine
from components.electrical import Ground, IdealDiode, Resistor, SignalVoltage
from docs._execute import namespace
from studies import opening_time
from studies.actuators import ElectromechanicalActuator, ehs_sticking, ema_maxon


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


def clutches() -> Clutches:
    return Clutches(actuators=tuple(ema_maxon(ratio=4.0 + 0.2 * k) for k in range(4)))


def last_opening(model: Clutches) -> Any:
    """The time at which the first of them, which is the slowest, is open."""
    return simulate(model, 5.0, until=lambda s: s.actuators[0].slave.rod.s - 12e-3, save="end").t1


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


CASES: dict[str, tuple[Callable[[], Any], Callable[[Any], Any]]] = {
    "clutch opening": (ema_maxon, opening_time),
    "sticking clutch": (ehs_sticking, opening_time),
    "four clutches": (clutches, last_opening),
    "six-diode rectifier": (rectifier, mean_voltage),
    "servo of 36 states": (servo, reached),
}
