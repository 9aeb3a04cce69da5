"""Second derivatives against closed forms; where they are not defined, an error."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _problems import GearedLoad

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    SimulationError,
    Var,
    connect,
    eq,
    positive,
    replace,
    simulate,
)
from acausal.design import Normal, Tolerance, hessian, optimise
from components.blocks import Integrator, Output, Table1D

PATHS = ("ratio", "J_load", "torque", "angle")


def test_closed_form() -> None:
    load = GearedLoad()
    found = hessian(load, PATHS, {"time": (lambda m: m.time, "ms"), "speed": lambda m: m.motor_speed})["time"]

    def time(x: Any) -> Any:
        return replace(load, dict(zip(PATHS, x, strict=True))).time

    x = jnp.array([getattr(load, path) for path in PATHS])
    np.testing.assert_allclose(found.matrix, jax.hessian(time)(x), rtol=1e-12)
    np.testing.assert_allclose(found.gradient, jax.grad(time)(x), rtol=1e-12)
    assert found.value == pytest.approx(float(load.time))
    assert found.units == ("1", "kg.m2", "N.m", "rad")
    assert "second derivatives [ms]" in str(found)


class Free(Component):
    """Two numbers, of whichever function a test has."""

    x: Param[Scalar, "1"] = 0.0
    y: Param[Scalar, "1"] = 0.0


def _larger(m: Any) -> Any:
    return jnp.maximum(m.ratio, m.ratio**2 / 10.0)


KINKS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "absolute value": (lambda m: jnp.abs(m.ratio - 10.0), "its one-sided derivatives differ"),
    "the larger of two": (_larger, "its one-sided derivatives differ"),
    "bend": (lambda m: jnp.maximum(m.ratio - 10.0, 0.0) ** 2, "its one-sided derivatives differ"),
    "stop_gradient": (lambda m: m.ratio * jax.lax.stop_gradient(m.ratio), "stop_gradient"),
    "no gradient at all": (lambda m: jax.lax.stop_gradient(m.ratio) + 0.0 * m.ratio, "stop_gradient"),
}


@pytest.mark.parametrize("name", KINKS)
def test_where_there_is_none_is_an_error(name: str) -> None:
    function, said = KINKS[name]
    with pytest.raises(SimulationError, match=f"bend has no second derivatives at ratio = 10: .*{said}"):
        hessian(GearedLoad(), ["ratio"], {"bend": function})


@pytest.mark.parametrize("ratio", [9.95, 9.9995])
def test_a_kink_beside_the_place_is_none(ratio: float) -> None:
    function = {"bend": lambda m: m.ratio**3 + jnp.abs(m.ratio - 10.0)}
    found = hessian(GearedLoad(ratio=ratio), ["ratio"], function)["bend"]
    assert found.matrix[0, 0] == pytest.approx(6.0 * ratio, rel=1e-12)


SMOOTH: dict[str, tuple[float, Callable[[Any], Any]]] = {
    "short waves": (2.0, lambda x: jnp.sin(1e4 * x)),
    "zero, on a small scale": (0.0, lambda x: jnp.exp(1e8 * x)),
    "zero, on a large scale": (0.0, lambda x: jnp.exp(1e-6 * x)),
    "all is zero": (0.0, lambda x: jnp.abs(x) ** 3),
    "flat": (3.0, lambda x: 1.0 + (x - 3.0) ** 4),
    "near a pole": (1e-30, jnp.log),
    "nothing depends on it": (3.0, lambda x: 2.0 + 0.0 * x),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_scales_that_the_value_does_not_tell(name: str) -> None:
    x, function = SMOOTH[name]
    found = hessian(Free(x=x), ["x"], lambda m: function(m.x)).matrix[0, 0]
    assert found == pytest.approx(float(jax.grad(jax.grad(function))(x)), rel=1e-12)


@pytest.mark.parametrize("share", [1.0, 1e-3], ids=["strong", "weak"])
def test_a_kink_of_a_parameter_that_matters_less(share: float) -> None:
    """Beside what depends on the other one a thousand times as much."""
    model = Free(x=2.0, y=3.0)
    with pytest.raises(SimulationError, match="no second derivatives at y = 3"):
        hessian(model, ["x", "y"], lambda m: m.x**2 + share * (m.y + jnp.abs(m.y - 3.0) * (m.y - 2.0)))
    # Both directions are smooth, but not what is between them.
    with pytest.raises(SimulationError, match="no second derivatives at x = 0"):
        hessian(Free(), ["x", "y"], lambda m: share * jnp.minimum(jnp.abs(m.x), jnp.abs(m.y)) * (m.x + m.y))


def test_second_order_of_a_tolerance_is_refused_where_there_is_none() -> None:
    study = Tolerance(GearedLoad(), {"ratio": Normal(std="5 %")}, {"larger": _larger})
    study.first_order()
    with pytest.raises(SimulationError, match="larger has no second derivatives"):
        study.second_order()


def test_a_certificate_does_not_call_a_kink_a_minimum() -> None:
    # x^2 on the left, -x^2 / 10 on the right: differences over both sides curve upwards, yet the right side falls.
    def bent(m: Any) -> Any:
        x = m.ratio - 10.0
        return 1.0 + jnp.where(x < 0.0, x**2, -0.1 * x**2)

    design = optimise(GearedLoad(), {"ratio": (5.0, 15.0)}, bent, sensitivities=False)
    assert design.values["ratio"] == 10.0
    assert design.curvature.eigenvalues[0] > 0.0
    assert design.status == "stationary"
    assert "the first derivatives have a kink" in str(design)
    smooth = optimise(GearedLoad(), {"ratio": (5.0, 15.0)}, lambda m: 1.0 + (m.ratio - 9.0) ** 4 + (m.ratio - 9.0) ** 2)
    assert smooth.status == "optimal"
    assert smooth.curvature.kink < 1e-3 * smooth.curvature.eigenvalues[0]


class Decay(Component):
    """dx/dt = -k x."""

    k: Param[Scalar, "1/s", positive] = 2.0
    x: Var[Scalar, "1"] = 1.0
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x), output=eq(self.y.value, self.x))


class Squares(Component):
    """The integral of a table with straight lines of a decaying x."""

    decay: Decay
    table: Table1D
    integral: Integrator

    def connections(self) -> Connections:
        return connect(self.decay.y, self.table.u), connect(self.table.y, self.integral.u)


@pytest.mark.slow
def test_moments_of_events_are_differentiated_twice() -> None:
    # From x to h it takes log(x/h) / k; as dt = -dx / (k x), the integral is that of y(x)/x from h to x, over k.
    points, h = np.linspace(0.0, 1.2, 7), 0.25
    table = Table1D(points=points, values=points**2, smooth=False)
    results = {"time": lambda s: s.t1, "integral": lambda s: s.final.integral.x}

    def run(m: Squares) -> Any:
        return simulate(m, 5.0, until=lambda s: s.decay.x - h, save="end", rtol=1e-10)

    def found(x: float) -> Any:
        model = Squares(decay=Decay(x=x), table=table, integral=Integrator())
        return hessian(model, ["decay.k", "decay.x"], results, run=run)

    k, x = 2.0, 1.1
    y, slope = np.interp(x, points, points**2), (1.44 - 1.0) / 0.2
    bent = found(x)
    expected = [[2.0 * np.log(x / h) / k**3, -1.0 / (k**2 * x)], [-1.0 / (k**2 * x), -1.0 / (k * x**2)]]
    np.testing.assert_allclose(bent["time"].matrix, expected, rtol=1e-7)
    value, mixed = bent["integral"].value, -y / (k**2 * x)
    expected = [[2.0 * value / k**2, mixed], [mixed, (slope * x - y) / (k * x**2)]]
    np.testing.assert_allclose(bent["integral"].matrix, expected, rtol=1e-6)
    # In the place of a point of the table, dI/dx = y / (k x) has a kink.
    with pytest.raises(SimulationError, match=r"integral has no second derivatives at decay\.x = 1"):
        found(1.0)
