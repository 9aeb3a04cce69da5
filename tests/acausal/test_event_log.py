"""The event log keeps periodic events apart and selects by part and kind; plots show modes and signals."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

import jax
import numpy as np
import pytest
from matplotlib import pyplot as plt

from acausal import Component, Discrete, Equations, Events, ModelError, Param, Scalar, Var, at, eq, simulate, when
from components.blocks import Constant, Output


class Ramp(Component):
    """A position that grows until it passes its limit, beside a clock."""

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"beyond": {0.0: "below", 1.0: "above"}}

    limit: Param[Scalar, "m"]
    v: Param[Scalar, "m/s"] = 1.0
    x: Var[Scalar, "m"] = 0.0
    beyond: Discrete[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(motion=eq(d.x, self.v), reading=eq(self.y.value, self.x))

    def events(self) -> Events:
        pass_ = when(self.x > self.limit, beyond=1.0)
        return {"pass": pass_, "tick": at(0.05, every=0.01, ticks=self.ticks + 1.0)}


class Ramps(Component):
    slow: Ramp
    fast: Ramp
    target: Constant


def run(limit: Any = 0.5) -> Any:
    model = Ramps(slow=Ramp(limit=limit), fast=Ramp(limit=1.5, v=2.0), target=Constant(k=0.7))
    return simulate(model, 1.0, rtol=1e-9)


@pytest.fixture(scope="module")
def ramps() -> Iterator[Any]:
    yield run()
    plt.close("all")


def test_periodic_events_are_apart(ramps: Any) -> None:
    log = ramps.events
    assert log.names == ["slow.pass", "fast.pass"]
    assert (len(log), int(log.count)) == (2, 2)
    np.testing.assert_allclose(log.times, [0.5, 0.75])
    assert [(tick.label, tick.count) for tick in log.ticks] == [("slow.tick", 95), ("fast.tick", 95)]
    np.testing.assert_allclose([log.ticks[0].first, log.ticks[0].last], [0.05, 0.99])
    assert str(log).splitlines()[-1] == "fast.tick 95 times, from 0.05 s to 0.99 s"


def test_events_are_selected_by_part_and_kind(ramps: Any) -> None:
    log = ramps.events
    assert log.of("fast").names == ["fast.pass"]
    assert [tick.label for tick in log.of("fast").ticks] == ["fast.tick"]
    assert log.of("pass").names == ["slow.pass", "fast.pass"]
    assert not log.of("pass").ticks
    assert not log.of("slow.tick").names
    with pytest.raises(ModelError, match=r"No part of the model and no kind is named 'pas'\. Did you mean pass"):
        log.of("pas")


@pytest.mark.thorough
def test_a_traced_run_has_the_same_log() -> None:
    times = jax.jit(lambda limit: run(limit).events.times)(0.5)
    np.testing.assert_allclose(times[:3], [0.5, 0.75, np.inf])


def test_modes_are_bands(ramps: Any) -> None:
    axes = ramps.plot(events="fast")
    assert [text.get_text() for text in axes[-1].get_yticklabels()] == ["slow.beyond", "fast.beyond"]
    assert [text.get_text() for text in axes[-1].get_legend().get_texts()] == ["below", "above"]
    (mark,) = axes[0].collections[0].get_paths()
    assert mark.vertices[0, 0] == pytest.approx(0.75)
    bands = [band.get_paths()[0].get_extents() for band in axes[-1].collections[:2]]
    np.testing.assert_allclose([[band.x0, band.x1] for band in bands], [[0.0, 0.5], [0.5, 1.0]])


def test_signals_have_the_units_of_their_sources(ramps: Any) -> None:
    assert ramps.unit("slow.y.value") == "m"
    assert ramps.unit("target.y.value") == ""
    assert ramps.to_pandas({"twice": lambda s: 2.0 * s.slow.y.value}).attrs["units"]["twice"] == "m"


def test_a_list_is_a_panel_in_one_unit(ramps: Any) -> None:
    axes = ramps.plot(["target.y.value", ("slow.x", "mm")], "fast.x", {"way": (lambda s: s.fast.x, "cm")})
    assert [ax.get_ylabel() for ax in axes] == ["[mm]", "[m]", "[cm]"]
    np.testing.assert_allclose(axes[0].lines[0].get_ydata(), 700.0)
    np.testing.assert_allclose(axes[0].lines[1].get_ydata()[-1], 1000.0)
    np.testing.assert_allclose(axes[2].lines[0].get_ydata()[-1], 200.0)
    with pytest.raises(ModelError, match=r"one panel, so they have one unit, got m, mm\. Remedy"):
        ramps.plot(["slow.x", ("fast.x", "mm")])
    with pytest.raises(ModelError, match="An item is a path or a function, or a pair of one and its unit, got"):
        ramps.plot(("slow.x", 3.0))
