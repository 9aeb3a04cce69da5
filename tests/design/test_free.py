"""Free parameters: what they may be named by, their bounds, units and scaling."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Array,
    Component,
    ModelError,
    Param,
    ParameterError,
    Record,
    Scalar,
    Var,
    Vector,
    parameters,
    quantity,
    stack,
)
from acausal.design import Experiment, Normal, Tolerance, free_parameters, identify, optimise, sweep
from acausal.design._problem.limits import limits_of
from components.electrical import DCMotor
from components.hydraulic import Pipe, iso_vg_46


class Table(Record):
    y: Param[Vector, "V"]


class Source(Component):
    table: Table
    bore: Param[Scalar, "m"] = 20e-3
    v: Var[Scalar, "V"]


class Bank(Component):
    sources: Array[Source]


class Rig(Component):
    a: Source
    b: Source
    temperature: Param[Scalar, "K"] = 300.0


def source(**values: Any) -> Source:
    return Source(table=Table(y=jnp.array([1.0, 2.0, 3.0])), **values)


def rig(**values: Any) -> Rig:
    return Rig(a=source(v=4.0), b=source(), **values)


def test_numbers_go_into_the_model_and_out_of_it() -> None:
    free = free_parameters(rig(), {("a.bore", "b.bore"): ("15 mm", "25 mm"), "a.table.y[1]": (0.0, 5.0), "a.v": (1, 9)})
    assert free.names == ("a.bore, b.bore", "a.table.y[1]", "a.v")
    assert free.units == ("m", "V", "V")
    np.testing.assert_allclose(free.low, [15e-3, 0.0, 1.0])
    np.testing.assert_allclose(free.high, [25e-3, 5.0, 9.0])
    changed = free.with_values(rig(), jnp.array([18e-3, 2.5, 7.0]))
    assert changed.a.bore == changed.b.bore == 18e-3
    np.testing.assert_array_equal(changed.a.table.y, [1.0, 2.5, 3.0])
    np.testing.assert_array_equal(changed.b.table.y, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(free.values(changed), [18e-3, 2.5, 7.0])
    slopes = jax.jacobian(lambda x: free.with_values(rig(), x).b.bore)(jnp.array([18e-3, 2.5, 7.0]))
    np.testing.assert_allclose(slopes, [1.0, 0.0, 0.0])


def test_an_array_as_a_whole_is_as_many_variables() -> None:
    free = free_parameters(rig(), {"b.table.y": (0.5, [4.0, 5.0, 60.0])})
    assert free.names == ("b.table.y[0]", "b.table.y[1]", "b.table.y[2]")
    np.testing.assert_array_equal(free.high, [4.0, 5.0, 60.0])
    np.testing.assert_array_equal(free.with_values(rig(), jnp.array([3.0, 2.0, 1.0])).b.table.y, [3.0, 2.0, 1.0])


def test_a_member_of_an_array_of_components() -> None:
    model = Bank(sources=stack([source(bore=0.02), source(bore=0.03)]))
    free = free_parameters(model, {"sources[1].bore": (0.01, 0.05)})
    np.testing.assert_allclose(free.with_values(model, jnp.array([0.04])).sources.item.bore, [0.02, 0.04])


def test_scaling_is_even_or_by_the_logarithm() -> None:
    model = rig()
    free = free_parameters(model, {"a.bore": (10e-3, 30e-3), "b.bore": (1e-3, 1.0), "temperature": (None, 400.0)})
    x = free.values(model)
    np.testing.assert_allclose(free.scaled(x), [0.5, np.log(20.0) / np.log(1000.0), 0.0])
    np.testing.assert_allclose(free.unscaled(free.scaled(x)), x)
    np.testing.assert_allclose(jax.jacobian(free.unscaled)(free.scaled(x)), np.diag(np.asarray(free.slopes(x))))
    np.testing.assert_allclose(free.scaled(free.high), [1.0, 1.0, 100.0 / 300.0])


def test_units_are_shown_as_they_were_given() -> None:
    free = free_parameters(rig(), {"a.bore": (quantity(0.5, "in"), None), "temperature": ("0 degC", "100 degC")})
    bore, temperature = free.variables
    assert (bore.low, temperature.low, temperature.high) == pytest.approx((12.7e-3, 273.15, 373.15))
    assert bore.scale.text == " in"
    assert bore.scale.value(25.4e-3) == pytest.approx(1.0)
    assert temperature.scale.value(300.0) == pytest.approx(26.85)
    assert temperature.scale.difference(2.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("sense", "sign"), [("<=", 1.0), (">=", -1.0), ("==", 1.0)])
@pytest.mark.parametrize("value", [-2.0, 0.0, 5.0])
def test_a_limit_is_broken_on_one_side_whatever_its_sign(sense: str, sign: float, value: float) -> None:
    """The violation is relative to the size of the limit, or to 1 for a limit of zero."""
    _, limit = limits_of({"force": (lambda m: m, f"{sense} {value} N")})["force"]
    size = abs(value) or 1.0
    for beyond in (-0.3, 0.3):
        excess = sign * beyond / size
        assert limit.constraint(value + beyond) == pytest.approx(excess, rel=1e-12)
        assert limit.excess(value + beyond) == pytest.approx(abs(excess) if sense == "==" else excess, rel=1e-12)


@pytest.mark.parametrize(
    ("free", "said"),
    [
        ({}, "at least one"),
        ({"a.bor": (0.0, 1.0)}, r"no parameter or start value 'a\.bor'.*a\.bore"),
        ({"bore": (0.0, 1.0)}, r"not a complete path.*a\.bore or b\.bore"),
        ({"a": (0.0, 1.0)}, r"a is not a parameter but contains some: a\.table\.y, a\.bore"),
        ({"a.table.y[3]": (0.0, 1.0)}, r"not an element of a\.table\.y, which has the shape \(3,\)"),
        ({"a.table.y[0,1]": (0.0, 1.0)}, r"not an element of a\.table\.y"),
        ({"b.v": (0.0, 1.0)}, r"b\.v has no start value"),
        ({"a.table.y": (0.0, 9.0), "a.table.y[1]": (0.0, 9.0)}, r"a\.table\.y\[1\] is named twice"),
        ({("a.bore", "temperature"): (0.0, 1.0)}, "cannot share a value: their units are K, m"),
        ({("a.table.y", "a.bore"): (0.0, 1.0)}, "must have equally many"),
        ({3: (0.0, 1.0)}, "named by its path"),
    ],
)
def test_wrong_names_are_told(free: Any, said: str) -> None:
    with pytest.raises(ModelError, match=said):
        free_parameters(rig(), free)


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        (("25 mm", "15 mm"), r"a\.bore: the lower bound must be below the upper one, got 25 to 15 mm"),
        ((0.02, 0.02), "must be below"),
        (("15 K", "25 mm"), r"a\.bore is in m.*given in"),
        (("fifteen", 1.0), "must be a real number, .* got 'fifteen'"),
        (("30 mm", "40 mm"), r"a\.bore is 20 mm, outside its bounds 30 to 40 mm"),
        ((0.01, 0.02, 0.03), "bounds must be a pair"),
        (0.02, "bounds must be a pair"),
        (([0.01, 0.02], 0.03), "2 bounds are given for 1 numbers"),
        ((object(), 0.03), "expected a number"),
    ],
)
def test_wrong_bounds_are_told(bounds: Any, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        free_parameters(rig(), {"a.bore": bounds})


def test_bounds_stay_in_the_declared_range() -> None:
    from components.rotational import IdealGear, Inertia

    with pytest.raises(ParameterError, match="ratio must be nonzero, also at its bounds, got -1 to 2"):
        free_parameters(IdealGear(ratio=1.0), {"ratio": (-1.0, 2.0)})
    with pytest.raises(ParameterError, match="J must be"):
        free_parameters(Inertia(J=1.0), {"J": (-1.0, 2.0)})


def test_what_is_shared_starts_from_one_value() -> None:
    model = Rig(a=source(bore=0.02), b=source(bore=0.03))
    with pytest.raises(ParameterError, match=r"must start from the same one: a\.bore = 20 mm, b\.bore = 30 mm"):
        free_parameters(model, {("a.bore", "b.bore"): (0.01, 0.05)})


def test_constructor_arguments_are_free() -> None:
    """They have the unit of the parameter that they are; several arguments of one component change together."""
    motor = DCMotor(R=0.3, L=1e-4, k=0.04, J=1e-5)
    free = free_parameters(motor, {"R": ("0.1 ohm", "2 ohm"), "J": (1e-6, 1e-4), "emf.k": (0.01, 0.1)})
    assert free.units == ("ohm", "kg.m2", "N.m/A")
    np.testing.assert_allclose(free.values(motor), [0.3, 1e-5, 0.04])
    changed = jax.jit(lambda x: free.with_values(motor, x))(np.array([1.0, 2e-5, 0.05]))
    found = parameters(changed)
    np.testing.assert_allclose([found["resistor.R"], found["rotor.J"], found["emf.k"]], [1.0, 2e-5, 0.05])
    np.testing.assert_allclose(found["inductor.L"], 1e-4)
    design = optimise(motor, {"R": (0.1, 2.0)}, {"cost": lambda m: (m.resistor.R - 0.7) ** 2}, sensitivities=False)
    assert design.values["R"] == pytest.approx(0.7, rel=1e-6)


def test_studies_vary_constructor_arguments() -> None:
    motor = DCMotor(R=0.3, L=1e-4, k=0.04, J=1e-5)
    scatter = Tolerance(motor, {"R": Normal(std=0.02)}, lambda m: 2.0 * m.resistor.R).first_order()
    assert float(scatter["result"].std) == pytest.approx(0.04, rel=1e-9)
    data = Experiment(lambda m: {"drop": 2.0 * m.resistor.R}, {"drop": 1.4}, {"drop": 0.01})
    assert float(identify(motor, {"R": (0.1, 2.0)}, [data]).model.resistor.R) == pytest.approx(0.7, rel=1e-6)
    swept = sweep(motor, {"R": [0.1, 0.2]}, lambda m: m.resistor.R, progress=False)
    np.testing.assert_allclose(swept["result"], [0.1, 0.2])


def test_arguments_of_which_a_constructor_needs_the_value_are_not_free() -> None:
    pipe = Pipe(n=3, length=1.0, diameter=0.01, liquid=iso_vg_46(temperature=313.15), p=1e5)
    with pytest.raises(ModelError, match="n cannot be varied: the constructor of Pipe needs its value"):
        free_parameters(pipe, {"n": (2, 5)})
