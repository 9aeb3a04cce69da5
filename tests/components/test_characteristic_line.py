"""A line by the method of characteristics: water hammer and reflections against their closed forms."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import Component, Connections, Scalar, connect, simulate
from components.blocks import Step
from components.hydraulic import (
    AnyLiquid,
    CharacteristicLine,
    ConstantPressure,
    LaminarResistance,
    LinearLiquid,
    SignalFlow,
    SignalPressure,
    Tank,
    iso_vg_46,
    water,
)

WATER = LinearLiquid(density=1000.0, bulk_modulus=2.25e9)
CLOSES, FLOW, RESERVOIR = 0.003, 0.008, 5e5
LINE = CharacteristicLine(length=15.0, diameter=0.1, liquid=WATER, pressure=RESERVOIR)
T, Z = 0.01, 1000.0 * 1500.0 / (0.25 * np.pi * 0.1**2)  # the speed of sound is 1500 m/s


class Hammer(Component):
    """A valve at the end of a line closes at once."""

    reservoir: ConstantPressure
    line: CharacteristicLine
    closing: Step
    valve: SignalFlow

    def connections(self) -> Connections:
        return (
            connect(self.reservoir.port, self.line.a),
            connect(self.line.b, self.valve.port),
            connect(self.closing.y, self.valve.u),
        )


def hammer(line: CharacteristicLine = LINE, closes: Scalar = CLOSES) -> Hammer:
    closing = Step(start_time=closes, height=FLOW, offset=-FLOW)
    return Hammer(reservoir=ConstantPressure(pressure=RESERVOIR), line=line, closing=closing, valve=SignalFlow())


def test_water_hammer() -> None:
    """The pressure at the valve is p_0 +- rho c v, with changes 0, 2 T, 4 T, ... after the valve closes."""
    times = CLOSES + T * np.array([-0.2, 0.1, 1.9, 2.1, 3.9, 4.1, 7.9])
    solution = simulate(hammer(), 0.09, save=times, energy=True)
    rise = 1000.0 * 1500.0 * FLOW / (0.25 * np.pi * 0.1**2)
    assert_allclose(solution["line.b.p"], RESERVOIR + rise * np.array([0, 1, 1, -1, -1, 1, -1]), rtol=1e-10)
    assert_allclose(solution["line.a.q"], FLOW * np.array([1, 1, -1, -1, 1, 1, 1]), rtol=1e-10)
    assert abs(float(solution.energy.imbalance)) < 1e-9 * 0.5 * 1000.0 * 15.0 * FLOW**2


def test_the_wave_holds_the_kinetic_energy_of_the_liquid() -> None:
    """When the first wave has reached the reservoir, all kinetic energy is compression."""
    solution = simulate(hammer(), CLOSES + 2.0 * T, save=[0.0, CLOSES + 0.999999 * T])
    area, rise = 0.25 * np.pi * 0.1**2, Z * FLOW
    compressed = 15.0 * area * ((RESERVOIR + rise) ** 2 - RESERVOIR**2) / (2.0 * 2.25e9)
    kinetic = 0.5 * 1000.0 * 15.0 / area * FLOW**2
    gained = np.diff(np.asarray(solution["line.stored"]))[0]
    assert gained == pytest.approx(compressed - kinetic, rel=1e-5)


class Ended(Component):
    """A step of the pressure enters a line that ends in a resistance."""

    step: Step
    source: SignalPressure
    line: CharacteristicLine
    end: LaminarResistance
    tank: Tank

    def connections(self) -> Connections:
        return (
            connect(self.step.y, self.source.u),
            connect(self.source.port, self.line.a),
            connect(self.line.b, self.end.a),
            connect(self.end.b, self.tank.port),
        )


def ended(ratio: Any, line: CharacteristicLine = LINE) -> Ended:
    """The resistance of the end is this ratio of the impedance."""
    end = LaminarResistance(resistance=ratio * Z)
    return Ended(step=Step(start_time=CLOSES, height=1e5), source=SignalPressure(), line=line, end=end, tank=Tank())


@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_reflections_at_a_resistance(ratio: float) -> None:
    """Each wave that arrives adds (1 + r) w to the pressure there; it returns with the factors r = (R - Z)/(R + Z) and
    -1.
    """
    n = np.arange(4)
    solution = simulate(ended(ratio), 0.09, save=CLOSES + T * (2.0 * n + 1.5))
    r = (ratio - 1.0) / (ratio + 1.0)
    assert_allclose(solution["line.b.p"], 1e5 * np.cumsum((1.0 + r) * (-r) ** n), rtol=1e-10)


@pytest.mark.thorough
def test_derivatives() -> None:
    """Of the pressure after two reflections, by the resistance at the end: both modes and the closed form."""

    def pressure(ratio: Scalar) -> Scalar:
        return simulate(ended(ratio), CLOSES + 3.5 * T, save="end").final.line.b.p

    def exact(ratio: Scalar) -> Scalar:
        r = (ratio - 1.0) / (ratio + 1.0)
        return 1e5 * (1.0 + r) * (1.0 - r)

    for derivative in (jax.grad, jax.jacfwd):
        assert derivative(pressure)(3.0) == pytest.approx(float(jax.grad(exact)(3.0)), rel=1e-8)


@pytest.mark.thorough
def test_the_travel_time_has_a_derivative() -> None:
    """A line that ends in its impedance holds the energy that has entered within T."""

    def energy(length: Scalar) -> Scalar:
        line = CharacteristicLine(length=length, diameter=0.1, liquid=WATER, pressure=RESERVOIR)
        return simulate(ended(1.0, line), CLOSES + 1.9 * T, save="end").final.line.stored

    power = 1e5**2 / Z
    assert float(energy(jnp.asarray(15.0))) == pytest.approx(power * T, rel=1e-9)
    assert float(jax.jacfwd(energy)(15.0)) == pytest.approx(power / 1500.0, rel=1e-8)


def test_walls_slow_the_wave() -> None:
    """Korteweg: c^2 = K/rho/(1 + K d/(E s))."""
    line = CharacteristicLine(length=15.0, diameter=0.1, liquid=WATER, pressure=RESERVOIR, wall=0.1 / (200e9 * 0.005))
    assert float(line.sound_speed) == pytest.approx(1500.0 / np.sqrt(1.0 + 2.25e9 * 1e-10), rel=1e-12)


@pytest.mark.parametrize("liquid", [iso_vg_46(), iso_vg_46(air=0.02), water()])
@pytest.mark.parametrize("pressure", [0.0, 2e7])
def test_the_speed_of_sound_is_that_at_the_working_pressure(liquid: AnyLiquid, pressure: float) -> None:
    """c^2 = K/rho, with the bulk modulus and the density at the working pressure, seen in flows of mass over rho_0:
    the impedance rho_0 c/A makes a pressure of c times the mass flow per area.
    """
    line = CharacteristicLine(length=1.0, diameter=0.1, liquid=liquid, pressure=pressure)
    density = liquid.reference_density * liquid.relative_density(pressure)
    assert_allclose(line.sound_speed, np.sqrt(liquid.bulk_modulus_at(pressure) / density), rtol=1e-12)
