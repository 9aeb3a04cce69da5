"""Printed results of design have display units, in aligned columns."""

import math
from typing import Any

import jax.numpy as jnp
import pytest

from acausal import Component, Param, Scalar, SimulationError, positive
from acausal.design import Experiment, Fit, Normal, Tolerance, hessian, identify, optimise, pareto, sensitivities

DISPLACEMENT = 2.55404e-07  # m3/rad, 1.60475 cm3/rev
PER_TURN = 1e-6 / (2.0 * math.pi)  # cm3/rev in m3/rad
SHOWN = {
    "displacement": ("1.60475", "cm3/rev"), "delay": ("12.5", "ms"), "pressure": ("29", "bar"),
    "rate": ("58.8", "N/mm"), "ratio": ("8.5", "1"), "current": ("41.25", "A"), "stroke": ("17", "mm"),
}  # fmt: skip


class Pump(Component):
    """A parameter of each quantity."""

    displacement: Param[Scalar, "m3/rad", positive] = DISPLACEMENT
    delay: Param[Scalar, "s", positive] = 0.0125
    pressure: Param[Scalar, "Pa", positive] = 29e5
    rate: Param[Scalar, "N/m", positive] = 58.8e3
    ratio: Param[Scalar, "1", positive] = 8.5
    current: Param[Scalar, "A", positive] = 41.25
    stroke: Param[Scalar, "m", positive] = 0.017


NAMES = ("displacement", "delay", "pressure", "rate", "ratio")
FREE = {name: (0.5 * getattr(Pump(), name), 2.0 * getattr(Pump(), name)) for name in NAMES}


def torque(pump: Any) -> Any:
    return pump.displacement * pump.pressure * pump.ratio


def cells(text: str, name: str) -> list[str]:
    """The cells of the line that begins with a name."""
    return next(line for line in text.splitlines() if line.startswith(f"{name} ")).split()


def is_aligned(text: str) -> bool:
    """Whether the units of all parameters end in one column."""
    units = {unit for _, unit in SHOWN.values()}
    lines = [line for line in text.splitlines() if line and line.split()[0] in NAMES]
    ends = {line.index(f" {unit}") + len(unit) for line in lines for unit in line.split() if unit in units}
    return len(lines) == len(NAMES) and len(ends) == 1


def test_sensitivities() -> None:
    text = str(sensitivities(Pump(), (torque, "N.m")))
    for name, (value, unit) in SHOWN.items():
        assert float(cells(text, name)[1]) == pytest.approx(float(value), rel=5e-5)
        assert cells(text, name)[2] == unit
    assert is_aligned(text)
    slope, relative = map(float, cells(text, "displacement")[3:])
    assert slope == pytest.approx(29e5 * 8.5 * PER_TURN, rel=1e-4)
    assert relative == pytest.approx(1.0, rel=1e-4)


def test_bars_of_sensitivities() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    texts = {text.get_text().strip() for text in sensitivities(Pump(), torque).plot().texts}
    plt.close("all")
    assert texts == {"1.605 cm3/rev", "29 bar", "8.5"}


def test_second_derivatives() -> None:
    """d2(torque)/(dD dp) is the ratio."""
    text = str(hessian(Pump(), ["displacement", "pressure"], (torque, "N.m")))
    _, unit, own, mixed = cells(text, "displacement")
    assert (unit, float(own)) == ("cm3/rev", 0.0)
    assert float(mixed) == pytest.approx(8.5 * PER_TURN * 1e5, rel=1e-5)
    assert cells(text, "pressure")[1:3] == ["bar", mixed]


def test_kink_is_told_in_display_units() -> None:
    with pytest.raises(SimulationError, match="no second derivatives at stroke = 17 mm: "):
        hessian(Pump(), ["stroke"], lambda m: jnp.abs(m.stroke - Pump().stroke))


@pytest.fixture(scope="module")
def fit() -> Fit[Pump]:
    """Each parameter is measured twice, to 1 %."""

    def predict(pump: Pump) -> dict[str, Any]:
        return {name: jnp.full(2, getattr(pump, name) / getattr(Pump(), name)) for name in NAMES}

    measured: dict[str, object] = {name: [0.99, 1.01] for name in NAMES}
    return identify(Pump(), FREE, Experiment(predict, measured, dict.fromkeys(NAMES, 0.01)))


@pytest.mark.thorough
def test_fit(fit: Fit[Pump]) -> None:
    text = str(fit)
    for name in NAMES:
        found, (value, unit) = cells(text, name), SHOWN[name]
        assert found[1] == unit
        estimate, std, low, high = map(float, found[2:])
        assert estimate == pytest.approx(float(value), rel=1e-5)
        assert std == pytest.approx(0.01 / math.sqrt(2.0) * estimate, rel=1e-4)
        assert (low, high) == pytest.approx((estimate - 1.96 * std, estimate + 1.96 * std), rel=1e-4)
    assert is_aligned(text.partition("\nchi2")[0])


def test_profile(fit: Fit[Pump]) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    profile = fit.profile("displacement", points=2)
    _, _, low, _, high, unit, *_ = str(profile).split()
    assert unit == "cm3/rev"
    assert (float(low), float(high)) == pytest.approx((profile.low / PER_TURN, profile.high / PER_TURN), rel=1e-5)
    ax = profile.plot()
    assert ax.get_xlabel() == "displacement [cm3/rev]"
    assert ax.lines[0].get_xdata() == pytest.approx(profile.values / PER_TURN, rel=1e-9)
    plt.close("all")


def test_worst_case() -> None:
    scatter = {name: Normal(std="5 %") for name in NAMES}
    text = str(Tolerance(Pump(), scatter, (torque, "N.m")).worst_case())
    for name in ("displacement", "pressure", "ratio"):
        value, unit = SHOWN[name]
        found = cells(text, name)
        assert found[3] == unit
        assert (float(found[1]), float(found[2])) == pytest.approx((0.85 * float(value), 1.15 * float(value)), rel=1e-4)


def test_design() -> None:
    """Plain numbers are bounds in SI units and are shown in display units; the unit of a text stays."""
    free: dict[str, object] = {"displacement": (1e-7, 4e-7), "stroke": ("0.01 m", "0.03 m")}
    limit = {"work": (lambda m: m.rate * m.stroke**2, ">= 17 J")}
    design = optimise(Pump(), free, {"torque": (torque, "N.m")}, constraints=limit)
    text = str(design)
    assert cells(text, "displacement")[1:] == ["0.628319", "0.628319", "2.51327", "cm3/rev"]
    assert cells(text, "stroke")[2:] == ["0.01", "0.03", "m"]
    assert cells(text, "pressure")[1:3] == ["29", "bar"]
    price = next(line for line in text.splitlines() if line.startswith("displacement (lower bound)")).split()
    assert float(price[3]) == pytest.approx(29e5 * 8.5 * PER_TURN, rel=1e-5)
    assert price[4:] == ["per", "cm3/rev"]
    assert float(price[3]) == pytest.approx(design.price(design.active[0]), rel=1e-5)


def test_front() -> None:
    work = (lambda m: 1.0 / m.displacement, "1")
    front = pareto(Pump(), {"displacement": (1e-7, 4e-7)}, {"torque": (torque, "N.m"), "work": work}, points=2)
    assert "displacement [cm3/rev]" in str(front).splitlines()[0]
    assert "2.51327" in str(front)


class Oven(Component):
    """A temperature."""

    temperature: Param[Scalar, "K", positive] = 310.0


def test_differences_of_temperatures_have_no_zero() -> None:
    """A deviation of 1 K is one of 1 degC, and so are slopes and curvatures of a result in degC."""
    square = (lambda m: m.temperature**2, "degC")
    assert float(cells(str(hessian(Oven(), ["temperature"], square)), "temperature")[2]) == pytest.approx(2.0)
    assert float(cells(str(sensitivities(Oven(), square)), "temperature")[3]) == pytest.approx(620.0)
    experiment = Experiment(lambda m: {"T": jnp.full(2, m.temperature)}, {"T": [311.0, 313.0]}, {"T": 1.0})
    line = cells(str(identify(Oven(), {"temperature": ("20 degC", "80 degC")}, experiment)), "temperature")
    assert line[1] == "degC"
    assert [float(cell) for cell in line[2:4]] == pytest.approx([38.85, math.sqrt(0.5)], rel=1e-5)
    design = optimise(Oven(), {"temperature": ("30 degC", "80 degC")}, {"result": square})
    assert cells(str(design), "temperature")[1:] == ["30", "30", "80", "degC"]
    assert design.price(design.active[0]) == pytest.approx(2.0 * 303.15)
