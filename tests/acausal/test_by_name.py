"""Parameters and start values by name, and settings that are checked or made on entry."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest
from _models import rc

from acausal import Component, Connections, ModelError, ParameterError, connect, parameters, replace, simulate
from components.blocks import PI, SISO, FirstOrder, Gain
from components.rotational import IdealGear


def test_replaced_values_are_those_of_the_path() -> None:
    model = rc(v0=1.0)
    changed = replace(model, {"r.R": 7, "c.v": 3})
    assert parameters(changed)["r.R"] == 7.0
    assert changed.c.v == 3.0
    same = {name: value for name, value in parameters(changed).items() if name != "r.R"}
    assert same == {name: value for name, value in parameters(model).items() if name != "r.R"}


def test_replaced_parameter_can_be_differentiated() -> None:
    gradient = eqx.filter_grad(lambda model: 1.0 / model.r.R)(replace(rc(v0=1.0), {"r.R": 4}))
    np.testing.assert_allclose(parameters(gradient)["r.R"], -1.0 / 16.0)


def test_unknown_name_is_answered_with_like_ones() -> None:
    with pytest.raises(ModelError, match=r"no parameter or start value 'r\.r'.*r\.R"):
        replace(rc(v0=1.0), {"r.r": 1.0})


def test_a_gear_has_no_ratio_of_zero() -> None:
    assert IdealGear(ratio=-2.0).ratio == -2.0
    with pytest.raises(ParameterError, match=r"IdealGear\.ratio must be nonzero and finite, got 0"):
        IdealGear(ratio=0.0)


class Loop(Component):
    """A lag behind a controller that can be replaced, and which has a default."""

    controller: SISO = dataclasses.field(default_factory=lambda: Gain(k=2.0))
    lag: FirstOrder
    is_open: bool = False

    def connections(self) -> Connections:
        return (connect(self.controller.y, self.lag.u),)


def test_parts_and_static_fields_are_replaced() -> None:
    loop = Loop(lag=FirstOrder(T=1.0))
    assert loop.controller is not Loop(lag=loop.lag).controller
    changed = replace(loop, {"controller": PI(k=3.0, T=2.0), "lag.T": 4.0, "is_open": True})
    assert parameters(changed) == {"controller.k": 3.0, "controller.T": 2.0, "lag.T": 4.0, "lag.k": 1.0}
    assert changed.is_open
    assert replace(loop, {"controller": PI(k=3.0, T=2.0), "controller.k": 5.0}).controller == PI(k=5.0, T=2.0)
    assert not loop.is_open
    assert isinstance(loop.controller, Gain)
    with pytest.raises(ModelError, match="controller is a Gain: replace it by a component, got 3"):
        replace(loop, {"controller": 3.0})
    with pytest.raises(ModelError, match=r"'is_opened'\. Did you mean is_open"):
        replace(loop, {"is_opened": True})


@pytest.mark.parametrize("rtol", [0.0, -1e-6])
def test_tolerance_must_be_positive(rtol: float) -> None:
    with pytest.raises(ModelError, match="rtol must be a positive number"):
        simulate(rc(v0=1.0), 1.0, rtol=rtol)
