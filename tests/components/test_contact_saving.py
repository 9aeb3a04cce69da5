"""The choice of saved times affects neither the steps nor the result of a run with contacts."""

import numpy as np
import pytest

from acausal import Component, Connections, Result, connect, simulate
from components.translational import ConstantForce, ElastoGap, Fixed, Mass


class Drop(Component):
    mass: Mass
    gap: ElastoGap
    weight: ConstantForce
    floor: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.mass.a, self.gap.b, self.weight.flange),
            connect(self.gap.a, self.floor.flange),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("d", [10.0, 5e4])
def test_runs_that_save_differently_take_the_same_steps(d: float) -> None:
    gap = ElastoGap(c=1e8, d=d, s_rel0=-1e-3)
    drop = Drop(mass=Mass(m=300.0, v=0.0), gap=gap, weight=ConstantForce(force=-2943.0))
    ways = ["end", "steps", "dense", np.linspace(0.0, 0.3, 11), np.linspace(0.0, 0.3, 101)]
    runs = [simulate(drop, 0.3, save=save) for save in ways]
    assert all(run.result == Result.reached_end for run in runs)
    assert len({(int(run.stats["num_steps"]), float(run.final.mass.v)) for run in runs}) == 1
