"""Warnings of a linear system about the values that it holds constant."""

import warnings

import pytest

from acausal import Component, Connections, SampledWarning, connect, linearise
from components.blocks import FirstOrder, LimPI, Pulse, SampledPI, SawTooth


class Loop(Component):
    demand: Pulse | SawTooth
    controller: SampledPI | LimPI
    lag: FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.demand.y, self.controller.u_s),
            connect(self.lag.y, self.controller.u_m),
            connect(self.controller.y, self.lag.u),
        )


PULSE = Pulse(amplitude=1.0, period=0.1, width=0.5)


def loop(*, sampled: bool, demand: Pulse | SawTooth = PULSE) -> Loop:
    continuous = LimPI(k=10.0, Ti=2.0, y_max=1e3, y_min=-1e3)
    controller = SampledPI(period=0.01, k=10.0, T=2.0) if sampled else continuous
    return Loop(demand=demand, controller=controller, lag=FirstOrder(T=1.0))


@pytest.mark.parametrize("open_at", [(), "controller.y"])
def test_samples_are_named(open_at: tuple[str, ...] | str) -> None:
    with pytest.warns(SampledWarning, match=r"controller\.sample\. Remedy") as found:
        linearise(loop(sampled=True), open=open_at)
    assert len(found) == 1
    assert found[0].filename == __file__


@pytest.mark.parametrize("demand", [PULSE, SawTooth(amplitude=1.0, period=0.1)])
def test_a_continuous_loop_with_a_wave_is_whole(demand: Pulse | SawTooth) -> None:
    """A wave comes again and again, but takes nothing over."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        linearise(loop(sampled=False, demand=demand), open="controller.y")
