"""Widths of smooth transitions and thresholds of switches, other than their defaults."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, replace
from acausal._declare.layout import complete
from acausal.testing import check_law
from components import blocks, electrical, rotational
from components.hydraulic import MappedLosses, WilsonLosses

WIDTH, FADED = 5.0, np.tanh(1.0)  # a transition at its width


@pytest.mark.parametrize(
    ("component", "given", "name", "full"),
    [
        (rotational.IronLoss(T_h=2.0, w_0=WIDTH), {"w": WIDTH}, "flange.tau", 2.0),
        (
            rotational.ReleaseBearing(mu=0.01, diameter=0.04, w_0=WIDTH),
            {"w": WIDTH, "f": 1e3},
            "shaft.tau",
            0.2,
        ),
        (electrical.BrushDrop(V=1.5, i_0=WIDTH), {"i": WIDTH}, "v", 1.5),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Component) else "",
)
def test_friction_fades_out_within_its_width(component: Component, given: dict, name: str, full: float) -> None:
    check_law(component, given, {name: full * FADED})


def test_losses_of_pumps_fade_out_within_their_widths() -> None:
    def losses(of: Any, dp: float, w: float) -> list[float]:
        return [float(loss(1e-6, dp, w, 0.03, 870.0)) for loss in (of.slip, of.drag)]

    speeds, pressures = jnp.array([1.0, 100.0]), jnp.array([1.0, 1e7])
    slips, drags = jnp.full((2, 2), 3e-6), jnp.full((2, 2), 2.0)
    mapped = MappedLosses(speeds=speeds, pressures=pressures, slips=slips, drags=drags, p_t=4e4, w_t=WIDTH)
    np.testing.assert_allclose(losses(mapped, 4e4, WIDTH), [3e-6 * FADED, 2.0 * FADED], rtol=1e-12)
    np.testing.assert_allclose(losses(WilsonLosses(T_c=2.0, w_t=WIDTH), 0.0, WIDTH), [0.0, 2.0 * FADED], rtol=1e-12)


@pytest.mark.parametrize(
    ("switch", "signal"),
    [
        (electrical.IdealClosingSwitch(threshold=2.0), "u"),
        (electrical.IdealOpeningSwitch(threshold=2.0), "u"),
        (electrical.IdealCommutingSwitch(threshold=2.0), "u"),
        (blocks.Switch(threshold=2.0), "control"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Component) else "",
)
def test_a_switch_reacts_at_its_threshold(switch: Component, signal: str) -> None:
    for value in (1.9, 2.1):
        for high in (0.0, 1.0):
            here: Any = complete(replace(switch, {f"{signal}.value": jnp.asarray(value), "high": jnp.asarray(high)}))
            changes = [event.changes["high"] for event in here.events().values() if event.condition]
            assert all(change == (value > 2.0) for change in changes)
            assert changes or high == (value > 2.0)
