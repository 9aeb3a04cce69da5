"""Examples of the Modelica Standard Library with friction that sticks, against published results and their event times.

The rows and event times are those of the public repository modelica/MAP-LIB_ReferenceResults, version 4.0.0: Dymola
2020x with DASSL, at a tolerance of 1e-6. The agreement asked for is 1e-3 of the range that the whole published
trajectory has, and 1e-4 s for the events. Which of two rigidly coupled frictions that hold one motion slides first is
not determined by the laws, but when both do is: the last of them sets out at the published time.
"""

from collections.abc import Callable
from typing import NamedTuple

import _event_models as models
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, simulate


class Case(NamedTuple):
    """Rows of a published trajectory: the time, then the variables in the order of `names`; times of some events."""

    source: str
    model: Callable[[], Component]
    names: str
    ranges: list[float]
    events: dict[str, list[float]]
    rows: list[list[float]]


CASES = (
    Case(
        source="Modelica.Mechanics.Rotational.Examples.Friction",
        model=models.friction,
        names="clutch.phi_rel clutch.w inertia3.b.phi inertia3.w spring.phi_rel spring.w_rel",
        ranges=[47.2106, 80.3338, 102.254, 106.45, 1.19566, 30.7067],
        events={
            "clutch.stick": [0.006779709, 0.109289495, 1.66363978],
            "clutch.backward": [0.0593397659, 0.534248572],
            "brake.engage": [0.5],
            "brake.stick": [0.640613805],
        },
        rows=[
            [0.3, -0.1713906149, 1.252571247e-10, 28.70015585, 97.28019055, 0.3143669945, -3.233079667],
            [0.6, -2.275802844, -68.03939845, 57.00774138, 85.09124312, -0.7641206332, 11.57414755],
            [0.9, -23.87964681, -61.66427922, 78.93511432, 61.09124312, -0.5051049747, 0.5730361021],
            [1.5, -46.13952388, -13.09109907, 101.1898602, 13.09124312, -0.4999737812, -0.0001440520735],
            [1.8, -47.21062202, 9.816240262e-15, 101.7269598, -5.752699626, 0.03402477719, 5.752699626],
            [2.4, -47.21062202, 9.816240262e-15, 101.4337828, -1.457692072, 0.327201705, 1.457692072],
            [3, -47.21062202, 9.816240262e-15, 101.5649994, 2.289890998, 0.1959851559, -2.289890998],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Rotational.Examples.LossyGearDemo2",
        model=models.lossy_gears,
        names="inertia2.b.phi inertia2.w",
        ranges=[0.000589183, 0.0139911],
        events={"bearing.forward": [0.230374016, 0.308307009]},
        rows=[
            [0.05, -0.0004942665211, -0.008769907027],
            [0.1, -0.0005590461443, 5.002925776e-11],
            [0.2, -0.0005590461393, 5.002921083e-11],
            [0.25, -0.0005560631705, 0.0004205042737],
            [0.3, -0.0005051220402, 0.0007461850834],
            [0.35, -0.0005017719877, -5.001765402e-11],
            [0.45, -0.0005017719928, -5.001765202e-11],
            [0.5, -0.0005891833231, -0.009624278093],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Translational.Examples.Brake",
        model=models.braked,
        names="mass1.b.s mass1.v mass2.b.s mass2.v",
        ranges=[0.6, 1.0, 0.6, 1.0],
        events={"brake1.engage": [0.1], "brake1.stick": [1.1], "brake2.engage": [0.1], "brake2.stick": [1.1]},
        rows=[
            [0.2, 0.195, 0.9, 0.195, 0.9],
            [0.6, 0.475, 0.5, 0.475, 0.5],
            [1, 0.595, 0.1, 0.595, 0.1],
            [1.2, 0.6, -1.110223025e-16, 0.6, -1.110223025e-16],
            [2, 0.6, -1.110223025e-16, 0.6, -1.110223025e-16],
        ],
    ),
)


@pytest.mark.thorough
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.source.rsplit(".", 1)[1])
def test_published_results(case: Case) -> None:
    rows = np.array(case.rows)
    solution = simulate(case.model(), float(rows[-1, 0]), rtol=1e-8, save=jnp.asarray(rows[:, 0]))
    for column, name in enumerate(case.names.split()):
        atol = 1e-3 * case.ranges[column]
        np.testing.assert_allclose(solution[name], rows[:, 1 + column], rtol=0.0, atol=atol, err_msg=name)
    times, names = np.asarray(solution.events.times), solution.events.names
    for name, expected in case.events.items():
        found = [time for time, here in zip(times, names, strict=False) if here == name]
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-4, err_msg=name)
