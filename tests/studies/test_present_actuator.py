"""The present actuator as a linear system, against the corrected equations of the thesis written by hand.

The thesis (Meloni, Politecnico di Torino, 2012) derives them from a bond graph, equations (3.9) to (3.22); some signs
and factors are misprinted there. Momenta p, compressed volume q, stroke x, with tau1 = r_cam A_m / 38, tau2 = 1 / A_s:

    p3' = Ki I - (Cin + tau1^2 Cf) / Jin p3 - tau1 Kf q + tau1 Cf / (tau2 M) p13
    q' = tau1 / Jin p3 - p13 / (tau2 M)
    p13' = tau1 Cf / (tau2 Jin) p3 + Kf / tau2 q - (Cout + Cf / tau2^2) / M p13 - K x + F
    x' = p13 / M
"""

import numpy as np
import pytest

from acausal import bond_graph
from studies.actuators import ema_fise
from studies.validate import least_ratio, linear_actuator, matrices, modes, static_gains

KI, KF, M, K = 0.0064, 149408526513837.7, 0.3, 1.2e5
AREA = 0.25 * np.pi * 17.4625e-3**2
JIN, TAU1, TAU2 = 5370.0 / 9330.0**2, AREA / 9330.0, 1.0 / AREA
DAMPING = dict(friction=16e-4, line_damping=6.8e11, piston_damping=2e-3)


def by_hand(Cin: float, Cf: float, Cout: float) -> np.ndarray:
    return np.array(
        [
            [-(Cin + TAU1**2 * Cf) / JIN, -TAU1 * KF, TAU1 * Cf / (TAU2 * M), 0.0],
            [TAU1 / JIN, 0.0, -1.0 / (TAU2 * M), 0.0],
            [TAU1 * Cf / (TAU2 * JIN), KF / TAU2, -(Cout + Cf / TAU2**2) / M, -K],
            [0.0, 0.0, 1.0 / M, 0.0],
        ]
    )


def test_matrices() -> None:
    for keywords, damping in (({}, (0.0, 0.0, 0.0)), (DAMPING, (16e-4, 6.8e11, 2e-3))):
        found, A = matrices(linear_actuator(**keywords)), by_hand(*damping)
        np.testing.assert_allclose(found.A, A, rtol=1e-9, atol=1e-9 * np.min(np.abs(A[A != 0.0])))
        np.testing.assert_allclose(found.B, [[KI, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0]], atol=1e-12)
        C = [[1.0 / JIN, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0 / M, 0.0], [0.0, 0.0, 0.0, K]]
        np.testing.assert_allclose(found.C, C, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(found.D, np.zeros((3, 2)), atol=1e-12)


@pytest.mark.thorough
def test_modes_and_gains() -> None:
    """Against two masses with springs computed by hand, with displacements referred to the slave."""
    masses, liquid = np.array([5370.0, M]), KF * AREA**2
    squares, shapes = np.linalg.eig(np.array([[liquid, -liquid], [-liquid, liquid + K]]) / masses[:, None])
    order = np.argsort(squares)
    model = linear_actuator()
    for mode, i in zip(modes(model), order, strict=True):
        shape = shapes[:, i] / shapes[np.argmax(np.abs(shapes[:, i])), i]
        kinetic, potential = masses * shape**2, np.array([liquid * (shape[0] - shape[1]) ** 2, K * shape[1] ** 2])
        assert mode.frequency == pytest.approx(np.sqrt(squares[i]) / (2.0 * np.pi), rel=1e-9)
        for share, expected in (
            (mode.shape, shape),
            (mode.kinetic, kinetic / kinetic.sum()),
            (mode.potential, potential / potential.sum()),
        ):
            assert (share.motor, share.slave) == pytest.approx(expected, rel=1e-6)
    gain, ratio = static_gains(model)
    assert gain == pytest.approx(9330.0, rel=1e-9)
    assert ratio == pytest.approx(9330.0 * (1.0 + K / liquid), rel=1e-9)


@pytest.mark.thorough
def test_bond_graph() -> None:
    """Junctions and elements give the same frequencies and shares; the rotating parts have no state of their own."""
    model = linear_actuator()
    graph = bond_graph(model)
    assert set(graph.derivative) == {"actuator.gearbox", "actuator.cam"}
    for number, mode in enumerate(modes(model)):
        assert abs(graph.poles[2 * number]) / (2.0 * np.pi) == pytest.approx(mode.frequency, rel=1e-9)
        shares = {name: float(values[2 * number]) for name, values in graph.energy.items()}
        assert 2.0 * shares["I actuator.piston"] == pytest.approx(mode.kinetic.slave, rel=1e-6)
        assert 2.0 * shares["C actuator.line"] == pytest.approx(mode.potential.motor, rel=1e-6)


def test_least_ratio() -> None:
    """The closed form for the eccentric disc; 11.13 without compression of the liquid."""
    angle = np.linspace(0.0, np.pi, 200001)
    sine = np.sqrt(20e-3**2 - (5.5e-3 * np.sin(angle)) ** 2)
    lift = -5.5e-3 * np.cos(angle) + sine - (20e-3 - 5.5e-3)
    slope = 5.5e-3 * np.sin(angle) * (1.0 - 5.5e-3 * np.cos(angle) / sine)
    master = 0.25 * np.pi * 19.05e-3**2
    pressure = master * lift / (AREA**2 / 58e3 + 1.0 / KF)
    torque = np.max((master * slope * pressure)[pressure * AREA / 58e3 <= 12e-3])
    assert least_ratio(ema_fise(), 12.0 / 38.0, 12e-3) == pytest.approx(torque / (12.0 / 38.0), rel=1e-6)
