"""Loops broken at a signal: loop transfer functions and margins in closed form, and those of python-control."""

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Equations,
    Margins,
    ModelError,
    Param,
    Scalar,
    connect,
    eq,
    linearise,
    simulate,
)
from acausal._analyse.realisation import margins
from components.blocks import Constant, Gain, Sum, TransferFunction
from components.blocks._interfaces import SISO


class Square(SISO):
    """y = c u^2."""

    c: Param[Scalar, "1"] = 1.0

    def equations(self, d: "Square") -> Equations:
        return dict(square=eq(self.y.value, self.c * self.u.value**2))


class Loop(Component):
    """L(s) = k / (s + 1)^3, whose gain margin is 8 / k at sqrt(3) rad/s."""

    demand: Constant
    error: Sum
    controller: Gain
    shape: Square | Gain
    plant: TransferFunction

    def connections(self) -> Connections:
        return (
            connect(self.demand.y, self.error.u1),
            connect(self.plant.y, self.error.u2),
            connect(self.error.y, self.controller.u),
            connect(self.controller.y, self.shape.u),
            connect(self.shape.y, self.plant.u),
        )


class Machine(Component):
    """The loop as a part."""

    loop: Loop


def loop(k: float, shape: Square | Gain | None = None) -> Loop:
    return Loop(
        demand=Constant(k=1.0), error=Sum(k1=1.0, k2=-1.0), controller=Gain(k=k), shape=shape or Gain(k=1.0),
        plant=TransferFunction(b=[1.0], a=[1.0, 3.0, 3.0, 1.0]),
    )  # fmt: skip


@pytest.mark.parametrize("is_part", [False, True])
def test_margins_in_closed_form(is_part: bool) -> None:
    k = 4.0
    model, name = (Machine(loop=loop(k)), "loop.controller.y") if is_part else (loop(k), "controller.y")
    system = linearise(model, open=[name])
    assert (system.inputs, system.outputs) == ((name,), (name,))
    numerator, denominator = system.transfer_function()
    np.testing.assert_allclose(numerator, [-k], rtol=1e-9)
    np.testing.assert_allclose(denominator, [1.0, 3.0, 3.0, 1.0], rtol=1e-9)
    found = system.margins()
    crossover = np.sqrt(k ** (2.0 / 3.0) - 1.0)
    phase = 180.0 - 3.0 * np.degrees(np.arctan(crossover))
    np.testing.assert_allclose(found[:4], [8.0 / k, np.sqrt(3.0), phase, crossover], rtol=1e-9)
    assert found.delay == pytest.approx(np.radians(phase) / crossover, rel=1e-9)
    # The loop closed again: 1 + L = 0 at the poles of the model as it is.
    closed = linearise(model, inputs=["loop.demand.k" if is_part else "demand.k"]).poles
    np.testing.assert_allclose(np.polyval(denominator, closed) + k, 0.0, atol=1e-8)


@pytest.mark.parametrize(("k", "pole", "zero"), [(0.5, 1.0, 4.0), (3.0, 2.0, 0.1), (0.2, 0.5, -4.0)])
def test_margins_with_direct_feedthrough(k: float, pole: float, zero: float) -> None:
    """L(s) = k (s + zero)/(s + pole) has the magnitude 1 where k^2 (w^2 + zero^2) = w^2 + pole^2."""
    found = margins(([[-pole]], [[1.0]], [[k * (zero - pole)]], [[k]]))
    crossover = np.sqrt((k**2 * zero**2 - pole**2) / (1.0 - k**2))
    phase = np.degrees(np.angle(-(1j * crossover + zero) / (1j * crossover + pole)))
    np.testing.assert_allclose([found.phase, found.gain_crossover], [phase, crossover], rtol=1e-9)


@pytest.mark.thorough
def test_the_operating_point_is_that_of_the_closed_loop() -> None:
    # At rest y = c u^2 and u = k (1 - y), where the loop has the gain 2 c u k.
    k, c = 2.0, 0.5
    model = loop(k, Square(c=c))
    rest = simulate(model, 60.0, rtol=1e-10).final
    u = (-1.0 + np.sqrt(1.0 + 4.0 * k**2 * c)) / (2.0 * k * c)
    assert rest.controller.y.value == pytest.approx(u, rel=1e-6)
    system = linearise(model, at=rest, inputs=["demand.k"], outputs=["plant.y.value"], open="controller.y")
    assert system.inputs == ("demand.k", "controller.y")
    assert system.outputs == ("plant.y.value", "controller.y")
    found = system.margins("controller.y", "controller.y")
    assert found.gain == pytest.approx(8.0 / (2.0 * c * u * k), rel=1e-6)


@pytest.mark.parametrize("gain", [0.5, 4.0, 20.0])
def test_python_control_agrees(gain: float) -> None:
    control = pytest.importorskip("control")
    system = linearise(loop(gain), open=["controller.y"])
    expected = control.margin(-system.to_control())
    found = system.margins()
    if gain < 1.0:  # never as large as 1
        assert found.phase == found.gain_crossover == np.inf
    else:
        np.testing.assert_allclose([found.phase, found.gain_crossover], np.array(expected)[[1, 3]], rtol=1e-6)
    # Beyond the limit of stability, what counts is by how much the gain must shrink.
    gain_margin = found.gain if gain < 8.0 else found.least_gain
    assert gain_margin == pytest.approx(expected[0], rel=1e-6)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("controller", "not a signal: to open a loop"),
        ("controller.z", "not a signal: to open a loop"),
        ("controller.k", "not a signal: to open a loop"),
    ],
)
def test_what_is_no_signal_is_told(name: str, said: str) -> None:
    with pytest.raises(ModelError, match=said):
        linearise(loop(1.0), open=[name])


def test_a_signal_that_goes_nowhere_is_told() -> None:
    class Alone(Component):
        demand: Constant
        delay: TransferFunction

        def connections(self) -> Connections:
            return (connect(self.demand.y, self.delay.u),)

    alone = Alone(demand=Constant(k=1.0), delay=TransferFunction(b=[1.0], a=jnp.array([1.0, 1.0])))
    with pytest.raises(ModelError, match=r"delay\.y is not connected"):
        linearise(alone, open="delay.y")


def test_the_least_gain_is_shown_where_there_is_one() -> None:
    shown = [str(Margins(np.inf, np.inf, -20.0, 2.0, 3.0, least)) for least in (0.0, 0.43)]
    assert ["least gain 0.43" in text for text in shown] == [False, True]
