"""The comparison of models with references."""

from pathlib import Path

import numpy as np
import pytest

from acausal import StructureError, simulate
from acausal.modelica import ModelicaError, load
from acausal.modelica._scoreboard.compare import compared
from acausal.modelica._scoreboard.reference import TOLERANCE, deviation
from acausal.modelica._scoreboard.table import written
from acausal.modelica._signals import ModelicaSignals

LAG = """
package P
  connector RealInput = input Real;
  connector RealOutput = output Real;
  partial block Base
    RealInput u;
    RealOutput y;
  end Base;
  block Lag
    extends Base;
    Real s(start = 1, fixed = true);
  equation
    der(s) = u - s;
    y = 2 * s;
  end Lag;
  model Decay
    RealOutput y;
    Real s(start = 1, fixed = true);
  equation
    der(s) = -s;
    y = 2 * s;
  end Decay;
end P;
"""


def test_an_output_of_the_model_is_a_signal() -> None:
    model = load(LAG, "P.Decay")
    solution = simulate(model, 1.0, save="end")
    assert ModelicaSignals(model)["y"](solution) == pytest.approx(2.0 * np.exp(-1.0), rel=1e-4)


def test_a_parameter_is_a_constant_signal() -> None:
    text = "model M parameter Real p[2] = {3, 4}; Real x(start = 1, fixed = true); equation der(x) = -p[1] * x; end M;"
    model = load(text, "M")
    solution = simulate(model, 1.0, save="end")
    assert np.array_equal(np.asarray(ModelicaSignals(model)["p[2]"](solution)), [4.0] * len(solution.ts))


def test_a_signal_of_rounding_errors_has_no_range() -> None:
    """Noise of 1e-16 is zero; a rise to 1e-12 is not."""
    times = np.linspace(0.0, 1.0, 11)
    noise = 1e-17 * np.cos(40.0 * times)
    assert deviation(times, noise, times, 1e-16 * np.sin(40.0 * times)) < TOLERANCE
    assert deviation(times, noise, times, 1e-12 * times) > 0.9
    assert deviation(times, 1e-12 * times, times, 1.1e-12 * times) == pytest.approx(0.1, abs=2 * TOLERANCE)


def test_an_open_input_of_the_model_is_named() -> None:
    with pytest.raises(StructureError, match=r"nothing is connected to u\. Make the model a part"):
        simulate(load(LAG, "P.Lag"), 1.0)


def test_partial_models_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=r"the model P\.Base is partial"):
        load(LAG, "P.Base")
    (tmp_path / "P").mkdir()
    (tmp_path / "P" / "package.mo").write_text("package P partial model A end A; end P;")
    (tmp_path / "P" / "B.mo").write_text("within P; partial model B Real x; end B;")
    for name in ("P.A", "P.B"):
        with pytest.raises(ModelicaError, match=f"{name} is partial"):
            load("", name, roots=[tmp_path])


@pytest.mark.thorough
def test_the_gradient_of_an_element_of_a_signal_is_checked(tmp_path: Path) -> None:
    """Elements count from 1. The fixed value is a signal, too, which no parameter changes."""
    (tmp_path / "P.mo").write_text(
        "package P model Rise constant Real c = 3; parameter Real k = 2; Real y[2](each start = 0, each fixed = true);"
        " equation der(y[1]) = 1; der(y[2]) = k; end Rise; end P;"
    )
    folder = tmp_path / "P" / "Rise"
    folder.mkdir(parents=True)
    (folder / "comparisonSignals.txt").write_text("c\ny[1]\ny[2]\n")
    (folder / "Rise.csv").write_text("time,c,y[1],y[2]\n0,3,0,0\n1,3,1,2\n")
    row = compared("P.Rise", [tmp_path / "P.mo"], folder, gradient=True)
    assert (row.stage, row.gradient) == ("agrees", "right (d y[2] / d k)")
    assert set(row.deviations) == {"c", "y[1]", "y[2]"}


@pytest.mark.parametrize(
    "log", ["StartTime=1\nStopTime=3 // from model\n", "StartTime = 1.0    // set\nStopTime = 3.0\n"]
)
def test_a_model_without_a_reference_is_simulated_over_the_interval_of_its_log(tmp_path: Path, log: str) -> None:
    """The assertion fails outside of the interval."""
    (tmp_path / "P.mo").write_text(
        "package P model Short Real x(start = 0, fixed = true); equation der(x) = 1; "
        'assert(time >= 0.999 and time <= 3.001, "outside of the interval"); end Short; end P;'
    )
    folder = tmp_path / "P" / "Short"
    folder.mkdir(parents=True)
    (folder / "comparisonSignals.txt").write_text("x\n")
    row = compared("P.Short", [tmp_path / "P.mo"], folder, gradient=False)
    assert row.stage == "run"
    assert "Short has no Short.csv, and no creation.txt with StartTime and StopTime" in row.reason
    (folder / "creation.txt").write_text(f'[ResultCreationLog]\nmodelName="P.Short"\n{log}Interval=0.1\n')
    row = compared("P.Short", [tmp_path / "P.mo"], folder, gradient=True)
    assert (row.stage, row.reason, row.deviations, row.gradient) == ("no reference", "", {}, "")
    assert "| **all** | 1 | 1 | 1 | 0 | 0 | 0 of 0 |" in written([row], "about")
