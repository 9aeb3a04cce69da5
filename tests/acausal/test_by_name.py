"""Parameters and start values by name, and settings that are checked or made on entry."""

import equinox as eqx
import numpy as np
import pytest
from _models import rc

from acausal import ModelError, ParameterError, parameters, replace, simulate
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


@pytest.mark.parametrize("rtol", [0.0, -1e-6])
def test_tolerance_must_be_positive(rtol: float) -> None:
    with pytest.raises(ModelError, match="rtol must be a positive number"):
        simulate(rc(v0=1.0), 1.0, rtol=rtol)
