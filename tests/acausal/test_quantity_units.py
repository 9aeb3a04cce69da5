"""Parameters and start values given with units."""

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pint
import pytest

from acausal import ModelError, Param, ParameterError, Record, Scalar, magnitude, quantity, replace, simulate
from components.blocks import Constant, Sine
from components.electrical import Capacitor
from components.hydraulic import ConstantPressure, Line, Pump
from components.rotational import Inertia, TabulatedLift
from components.thermal import FixedTemperature, HeatCapacitor
from components.translational import TabulatedSpring

from _models import rc  # isort: skip


def line(bulk_modulus: Any, volume: Any) -> Line:
    return Line.from_bulk_modulus(bulk_modulus=bulk_modulus, volume=volume)


GIVEN: dict[str, tuple[Any, float]] = {
    "inertia": (lambda: Inertia(J=quantity(120.0, "g.cm2")).J, 1.2e-5),
    "speed": (lambda: Inertia(J=1.0, w=quantity(3000, "rpm")).w, 100.0 * math.pi),
    "pressure": (lambda: ConstantPressure(pressure=quantity(250, "bar")).pressure, 2.5e7),
    "displacement": (lambda: Pump(displacement=quantity(1.2, "cm3/rev")).displacement, 1.2e-6 / (2 * math.pi)),
    "temperature": (lambda: FixedTemperature(temperature=quantity(25, "degC")).temperature, 298.15),
    "start temperature": (lambda: HeatCapacitor(C=1.0, T=quantity(-10.0, "degC")).T, 263.15),
    "capacity": (lambda: HeatCapacitor(C=quantity(2.0, "kJ/degC")).C, 2000.0),
    "angle": (lambda: Sine(amplitude=1.0, frequency=1.0, phase=quantity(90, "deg")).phase, math.pi / 2),
    "frequency": (lambda: Sine(amplitude=1.0, frequency=quantity(3000, "1/min")).frequency, 50.0),
    "signal": (lambda: Constant(k=quantity(3000, "rpm")).k, 100.0 * math.pi),
    "own unit": (lambda: Inertia(J=quantity(3.0, "kg.m2")).J, 3.0),
    "arithmetic": (lambda: line(quantity(1.5, "GPa"), quantity(10.0, "cm3")).stiffness, 1.5e14),
    "pint": (lambda: Inertia(J=pint.UnitRegistry().Quantity(120.0, "gram * cm**2")).J, 1.2e-5),  # pyright: ignore[reportArgumentType]
    "pint with prefix": (lambda: Capacitor(C=pint.UnitRegistry().Quantity(47, "microfarad")).C, 47e-6),  # pyright: ignore[reportArgumentType]
}  # fmt: skip


@pytest.mark.parametrize("name", GIVEN)
def test_values_are_converted(name: str) -> None:
    made, expected = GIVEN[name]
    np.testing.assert_allclose(made(), expected, rtol=1e-12)


def test_types_are_those_of_plain_numbers() -> None:
    inertia = Inertia(J=quantity(120, "g.cm2"), w=quantity(3000, "rpm"))
    assert isinstance(inertia.J, jax.Array)
    assert inertia.J.dtype == jnp.float64
    assert isinstance(inertia.w, float)


@pytest.mark.thorough
def test_arrays() -> None:
    spring = TabulatedSpring(
        positions=quantity([0.0, 5.0, 9.0], "mm"), forces=quantity(np.array([0.0, 1.0, 2.0]), "kN")
    )
    np.testing.assert_allclose(spring.positions, [0.0, 0.005, 0.009])
    np.testing.assert_allclose(spring.forces, [0.0, 1e3, 2e3])
    lift = TabulatedLift(angles=quantity([0.0, 90.0, 360.0], "deg"), lifts=quantity([0.0, 3.0, 0.0], "mm"))
    np.testing.assert_allclose(lift.lift(math.pi / 2), 3e-3)


def test_traced_values() -> None:
    def inertia(value: Scalar) -> Scalar:
        return jnp.asarray(Inertia(J=quantity(value, "g.cm2")).J)

    np.testing.assert_allclose(jax.grad(inertia)(120.0), 1e-7)
    np.testing.assert_allclose(jax.vmap(inertia)(jnp.array([1.0, 2.0])), [1e-7, 2e-7])


@pytest.mark.thorough
def test_replacing() -> None:
    model = replace(rc(), {"c.C": quantity(2.0, "mF"), "c.v": quantity(500, "mV")})
    assert float(model.c.C) == pytest.approx(2e-3)
    assert model.c.v == 0.5
    np.testing.assert_allclose(simulate(model, 0.1)["c.v"][0], 0.5)
    with pytest.raises(ParameterError, match=r"c\.C is in F .*, but is given in mA"):
        replace(rc(), {"c.C": quantity(2.0, "mA")})


REFUSED: dict[str, tuple[Any, str]] = {
    "dimension": (lambda: Inertia(J=quantity(120.0, "g.cm")),
                  r"Inertia\.J is in kg\.m2, but is given in cm\.g \(kg\.m\)"),
    "start value": (lambda: Inertia(J=1.0, w=quantity(1.0, "m/s")),
                    r"Inertia\.w is in rad/s \(1/s\), but is given in m/s"),
    "number for a quantity": (lambda: Inertia(J=quantity(1.0, "1")), r"Inertia\.J is in kg\.m2, but is given in 1"),
    "quantity for a number": (lambda: Gearless(ratio=quantity(1.0, "m")), r"ratio is in 1, but is given in m"),
    "turns for an angle": (lambda: Inertia(J=1.0, w=quantity(50.0, "Hz")), r"Inertia\.w is in rad/s, .* count turns"),
    "turns per minute": (lambda: Inertia(J=1.0, w=quantity(3000, "1/min")), r"Inertia\.w is in rad/s, .* count turns"),
    "angle for turns": (lambda: Sine(amplitude=1.0, frequency=quantity(3000, "rpm")), r"Sine\.frequency is in Hz"),
    "array": (lambda: TabulatedSpring(positions=quantity([0.0, 1.0], "N"), forces=jnp.zeros(2)), r"positions is in m"),
    "unknown unit": (lambda: quantity(1.0, "kg.mm^2"), r"the unit 'kg\.mm\^2' is not known.* Did you mean .*kg\.m2"),
    "sign": (lambda: Inertia(J=quantity(-1.0, "g.cm2")), r"Inertia\.J must be positive"),
}  # fmt: skip


class Gearless(Record):
    ratio: Param[Scalar, "1"]


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    made, message = REFUSED[name]
    with pytest.raises(ParameterError, match=message):
        made()


def test_a_unit_of_another_registry_only() -> None:
    registry: Any = pint.UnitRegistry()
    registry.define("smoot = 1.7 * meter")
    with pytest.raises(ParameterError, match=r"Inertia\.J is given in smoot"):
        Inertia(J=registry.Quantity(1.0, "smoot"))


def test_back_to_other_units() -> None:
    assert magnitude(quantity(50.0, "rad/s"), "rpm") == pytest.approx(1500.0 / math.pi)
    assert magnitude(3.0, "m") == 3.0
    with pytest.raises(ModelError, match="magnitude is in m, but is given in s"):
        magnitude(quantity(3.0, "s"), "m")


def test_a_quantity_put_into_a_model_behind_its_back() -> None:
    model = eqx.tree_at(lambda model: model.c.C, rc(), quantity(2.0, "mF"))
    with pytest.raises(ParameterError, match=r"changed to 2\.0 millifarad: use replace"):
        simulate(model, 0.1)


@pytest.mark.parametrize("unit", ["cm3", "ml"])
def test_a_volume_is_none_per_turn(unit: str) -> None:
    """A data sheet's 11 cm3 are those of a turn; what has an angle, or is a number, is taken."""
    message = rf"Pump\.displacement is in m3/rad, but is given in {unit}: .*Write {unit}/rad or {unit}/rev"
    with pytest.raises(ParameterError, match=message):
        Pump(displacement=quantity(11.0, unit))
    per_turn = quantity(11.0, unit) / quantity(1.0, "rev")
    assert float(Pump(displacement=per_turn).displacement) == pytest.approx(11e-6 / (2 * math.pi), rel=1e-12)


def test_a_text_is_a_number_with_a_unit() -> None:
    source: Any = ConstantPressure
    run: Any = simulate
    for text, pascals in (("20 bar", 2e6), ("2.0e6", 2e6), (" 3MPa ", 3e6), ("0 bar", 0.0)):
        assert float(source(pressure=text).pressure) == pascals
    model = replace(rc(), {"c.C": "2 mF", "c.v": "500 mV"})
    assert (float(model.c.C), model.c.v) == (2e-3, 0.5)
    assert float(run(model, "100 ms").t1) == 0.1
    with pytest.raises(ParameterError, match=r"ConstantPressure\.pressure must be a real number, .* got 'twenty bar'"):
        source(pressure="twenty bar")
    with pytest.raises(ParameterError, match=r"ConstantPressure\.pressure is in Pa .*given in mm"):
        source(pressure="20 mm")
    with pytest.raises(ParameterError, match=r"ConstantPressure\.pressure.*bars"):
        source(pressure="20 bars_")
    with pytest.raises(ParameterError, match=r"displacement is in m3/rad, but is given in cm3"):
        replace(Pump(displacement=1e-6), {"displacement": "11 cm3"})
