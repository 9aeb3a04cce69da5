"""Examples of the Modelica Standard Library against published results, and a motor against its closed form.

The rows are those of the public repository modelica/MAP-LIB_ReferenceResults, version 4.0.0: Dymola 2020x with DASSL,
at a tolerance of 1e-6 (DCPM_Start: 1e-7). They carry errors of their own, up to 5e-4 of the range of a signal, so the
agreement asked for is 1e-3 of the range that the whole published trajectory has.
"""

from collections.abc import Callable
from typing import NamedTuple

import _reference_models as models
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg

from acausal import Component, simulate


class Case(NamedTuple):
    """Rows of a published trajectory: the time, then the variables in the order of `names`."""

    source: str
    model: Callable[[], Component]
    names: str
    ranges: list[float]
    rows: list[list[float]]


CASES = (
    Case(
        source="Modelica.Mechanics.Rotational.Examples.First",
        model=models.first,
        names="damper.phi_rel damper.w_rel inertia3.b.phi inertia3.w",
        ranges=[0.164663, 0.541837, 0.165448, 0.646542],
        rows=[
            [0.125, -0.03239486319, -0.3672544328, 0.03357561039, 0.3514407059],
            [0.25, -0.04517152416, -0.1875817317, 0.04365390105, 0.2402010576],
            [0.375, -0.07978683265, -0.02218310773, 0.08074735082, -0.0658824818],
            [0.5, -0.09581282303, -0.3720168717, 0.09620011935, 0.4719307732],
            [0.625, -0.1097280082, 0.0004179919906, 0.108112071, -0.07998038349],
            [0.75, -0.1390332067, -0.1228103778, 0.1412265634, 0.1595172822],
            [0.875, -0.1432556668, -0.2849667026, 0.1415755555, 0.2908641578],
            [1, -0.1623281811, 0.1122186023, 0.162860012, -0.1383323791],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Translational.Examples.Accelerate",
        model=models.accelerate,
        names="accelerate.flange.s accelerate.v",
        ranges=[0.5, 1.0],
        rows=[
            [0.125, 0.007812500005, 0.125],
            [0.25, 0.03125000001, 0.25],
            [0.375, 0.07031250001, 0.375],
            [0.5, 0.125, 0.5],
            [0.625, 0.1953125, 0.625],
            [0.75, 0.28125, 0.75],
            [0.875, 0.3828125, 0.875],
            [1, 0.5, 1],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Translational.Examples.Oscillator",
        model=models.oscillator,
        names="spring2.s_rel spring2.v_rel mass1.s mass1.v",
        ranges=[0.00195235, 0.195503, 0.00850593, 0.833178],
        rows=[
            [0.1165, 1.000297729, 0.03446507001, -0.5003943633, -0.04619272746],
            [0.25, 1.000710701, 0.00852982952, -0.50124527, -0.01648708791],
            [0.3665, 1.000432206, 0.07242501713, -0.5009568383, -0.1587706035],
            [0.5, 1.000888387, 0.02356718609, -0.5024246894, -0.0654657788],
            [0.6165, 1.000367383, 0.08812814538, -0.5012157515, -0.2850162672],
            [0.75, 1.000901361, 0.03763910636, -0.5034743083, -0.1451647919],
            [0.8665, 1.000252209, 0.09540013792, -0.5011474199, -0.4187403484],
            [1, 1.000857011, 0.05019735152, -0.5043345946, -0.2527638195],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Rotational.Examples.EddyCurrentBrake",
        model=models.braking,
        names="inertia.b.phi capacitor.T brake.loss",
        ranges=[2.56228, 200.0, 1630.9],
        rows=[
            [0.025, 0.4737552771, 333.7837147, 1630.896806],
            [0.075, 1.246165194, 408.9819642, 1289.064471],
            [0.15, 1.961863226, 471.8088136, 437.4618296],
            [0.25, 2.363930802, 490.6932605, 54.53341597],
            [0.375, 2.513388082, 492.9994716, 3.370454148],
            [0.5, 2.550270318, 493.1407232, 0.2046461206],
            [0.625, 2.559354351, 493.1492949, 0.01241218455],
            [1, 2.562278062, 493.1498477, 2.770739619e-06],
        ],
    ),
    Case(
        source="Modelica.Electrical.Machines.Examples.DCMachines.DCPM_Start",
        model=models.motor_start,
        names="motor.inductor.i inertia.b.phi inertia.w",
        ranges=[123.073, 210.226, 158.518],
        rows=[
            [0.3, 99.45870113, 0.3429078282, 10.92906574],
            [0.6, 92.66913476, 12.85195622, 71.26690359],
            [1, 92.5273821, 57.06912627, 149.8125375],
            [1.2, -1.209982824, 88.44342241, 156.9048542],
            [1.43335, -0.05649504924, 125.088813, 157.0784199],
            [1.53335, 33.0752748, 140.6863434, 150.8760989],
            [1.6, 107.4863906, 150.5755358, 147.6712836],
            [1.8, 99.33532312, 180.3824384, 149.2243851],
            [2, 99.97434664, 210.2259837, 149.2278453],
        ],
    ),
    Case(
        source="Modelica.Electrical.Analog.Examples.ShowSaturatingInductor",
        model=models.saturation,
        names="inductance.i saturating.Psi",
        ranges=[2.5, 2.5],
        rows=[
            [0.785, 0.8835336792, 0.8835336792],
            [1.57, 1.249999343, 1.249999343],
            [2.355, 0.8849348659, 0.8849348659],
            [3.14, 0.001984971407, 0.001984971407],
            [3.925, -0.8821274115, -0.8821274115],
            [4.71, -1.249998881, -1.249998881],
            [5.5, -0.8819243626, -0.8819243626],
            [6.2832, 2.147787857e-05, 2.147787857e-05],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Rotational.Examples.Backlash",
        model=models.backlash,
        names="backlash.phi_rel backlash.w_rel spring.phi_rel spring.w_rel",
        ranges=[2.64916, 119.09, 2.79512, 156.431],
        rows=[
            [0.125, 1.142038264, 4.146095928, 0.04399179805, -53.32434558],
            [0.25, 0.5808074964, 30.0807325, -0.4513173109, 1.538605224],
            [0.375, -0.348738737, 21.56131929, 0.0004180669014, 15.23330038],
            [0.5, -0.3099397327, -17.22830512, 0.1292914533, -0.8802069042],
            [0.625, 0.5465380469, 7.94524176, -0.003849318611, -4.338992243],
            [0.75, -0.5354550239, -4.136563654, -0.03693148076, 0.3773353879],
            [0.875, 0.4178787572, 8.499271986, 0.002169533826, 1.232213922],
            [1, -0.1555703672, -7.022930403, 0.01051803482, -0.1437033139],
        ],
    ),
    Case(
        source="Modelica.Mechanics.Translational.Examples.ElastoGap",
        model=models.gaps,
        names="gap1.v_rel gap2.s_rel spring1.v_rel spring2.s_rel",
        ranges=[5.39618, 3.34571, 7.53061, 2.65341],
        rows=[
            [0.625, -3.427150207, 1.642662803, -1.809934929, 2.548402237],
            [1.25, -0.5640926029, 3.344309877, 1.238274851, 1.931525041],
            [1.875, 1.969028319, 2.54175225, -0.5695960626, 1.962746797],
            [2.5, 1.790589884, 1.316852189, 0.199793664, 2.035988155],
            [3.125, -0.9962974214, 1.167165417, -0.04933501347, 1.981091712],
            [3.75, -1.131288186, 1.867543169, 0.003118702786, 2.007417616],
            [4.375, -1.082456557, 2.573519891, 0.00542978153, 1.997826057],
            [5, 0.5375297097, 2.707887024, -0.004193237488, 2.000350379],
        ],
    ),
)


@pytest.mark.thorough
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.source.rsplit(".", 1)[-1])
def test_published_trajectory(case: Case) -> None:
    rows = np.array(case.rows)
    solution = simulate(case.model(), rows[-1, 0], save=jnp.asarray(rows[:, 0]), rtol=1e-8)
    found = np.stack([solution[name] for name in case.names.split()], axis=1)
    deviation = np.abs(found - rows[:, 1:]) / np.array(case.ranges)
    assert np.max(deviation) < 1e-3


def test_undamped_oscillator_in_closed_form() -> None:
    """The published trajectory is off by up to 5e-4 of its range here; this is the exact one.

    With u = s - s(0), from u'' + w0^2 u = sin(w t): u = [sin(w t) - w / w0 sin(w0 t)] / (w0^2 - w^2).
    """
    times = np.linspace(0.0, 1.0, 41)
    solution = simulate(models.oscillator(), 1.0, save=jnp.asarray(times), rtol=1e-8)
    w0, w = 100.0, 2.0 * np.pi * 15.9155
    exact = (np.sin(w * times) - w / w0 * np.sin(w0 * times)) / (w0**2 - w**2)
    np.testing.assert_allclose(solution["mass1.s"] + 0.5, exact, atol=1e-8)


@pytest.mark.thorough
def test_loaded_motor_in_closed_form() -> None:
    """ModelingToolkitStandardLibrary, test/multi_domain.jl: 10 V on the motor at t = 0, a load of 3 N.m from t = 3 s.

    x' = A x + b for x = (i, w), so that x = x_stationary + exp(A t) (x_0 - x_stationary) on either side of the step.
    """
    R, L, k, J, f = 0.5, 4.5e-3, 0.5, 0.02, 0.01
    matrix = np.array([[-R / L, -k / L], [k / J, -f / J]])

    def after(times: np.ndarray, start: np.ndarray, load: float) -> np.ndarray:
        stationary = -np.linalg.solve(matrix, [10.0 / L, -load / J])
        return np.stack([stationary + linalg.expm(matrix * t) @ (start - stationary) for t in times])

    before, later = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 3.0]), np.array([0.01, 0.02, 0.05, 0.1, 0.5, 3.0])
    unloaded = after(before, np.zeros(2), 0.0)
    exact = np.concatenate([unloaded, after(later, unloaded[-1], 3.0)])
    times = np.concatenate([before, 3.0 + later])
    solution = simulate(models.loaded_motor(), 6.0, save=jnp.asarray(times), rtol=1e-9)
    np.testing.assert_allclose(solution["inductor.i"], exact[:, 0], atol=1e-7)
    np.testing.assert_allclose(solution["inertia.w"], exact[:, 1], atol=1e-7)
    published = [[12.8165929508, 1.9360195936], [1.6644979122, 18.7685932777], [0.9729627410, 18.1645308612]]
    np.testing.assert_allclose(exact[[0, 3, 7]], published, rtol=1e-9)
