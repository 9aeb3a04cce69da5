"""Simultaneous equations left to the integrator: M dy/dt = f(t, y)."""

from typing import Any

import diffrax
import numpy as np
import pytest
from _models import rectifier
from test_evaluate import bridge

from acausal import ModelError, Rodas3P, choose_states, simulate

TIMES = np.linspace(0.0, 0.3, 4)


@pytest.mark.parametrize(("name", "make"), [("diode", lambda: rectifier(5.0)), ("arms", bridge)])
def test_both_forms_agree(name: str, make: Any) -> None:
    solved, integrated = choose_states(make()), choose_states(make(), algebraic="integrate")
    assert solved.mass is None
    assert integrated.mass is not None
    np.testing.assert_array_equal(integrated.mass[:1], [1.0])
    np.testing.assert_array_equal(integrated.mass[1:], 0.0)
    assert len(integrated.mass) > 1
    a, b = (simulate(make(), 0.3, save=TIMES, rtol=1e-10, system=system) for system in (solved, integrated))
    np.testing.assert_allclose(a["c.v"], b["c.v"], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(a["c.i"], b["c.i"], rtol=1e-6, atol=1e-9)


def test_solvers_for_ordinary_equations_are_refused() -> None:
    system = choose_states(rectifier(5.0), algebraic="integrate")
    with pytest.raises(ModelError, match=r"Rodas5P or Rodas3P; Kvaerno5 integrates ODEs only"):
        simulate(rectifier(5.0), 0.3, system=system, solver=diffrax.Kvaerno5())


def test_the_smaller_rosenbrock_method() -> None:
    system = choose_states(bridge(), algebraic="integrate")
    sol = simulate(bridge(), 0.3, save=TIMES, rtol=1e-8, system=system, solver=Rodas3P())
    # The resistance that the capacitor sees decides its time constant; its end value is that of the open bridge.
    a, b, c, d = 3.0, 5.0, 7.0, 2.0
    star = np.array([[1 / 1.5 + 1 / a + 1 / b, -1 / a, -1 / b], [-1 / a, 1 / a + 1 / c, 0], [-1 / b, 0, 1 / b + 1 / d]])
    probe = np.array([0.0, 1.0, -1.0])
    resistance = probe @ np.linalg.solve(star, probe)
    final = probe @ np.linalg.solve(star, [12.0 / 1.5, 0.0, 0.0])
    expected = final * (1.0 - np.exp(-TIMES / (resistance * 0.1)))
    np.testing.assert_allclose(sol["c.v"], expected, rtol=1e-6, atol=1e-8)
