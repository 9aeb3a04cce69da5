"""Designs by simulation: the constrained optimum of an actuator, and starts that do not work."""

import numpy as np
import pytest
from _actuator import free, limits, opening, start

from acausal import replace, simulate
from acausal.design import Design, optimise
from acausal.design._optimise.solve import Method
from docs.drive import drive

TIME = {"opening time": (lambda s: s.t1, "ms")}


def optimum(widest_bore: str, hold_current: str, starts: int = 1, method: Method = "SLSQP") -> Design:
    return optimise(
        start(), free(widest_bore), TIME, run=opening, constraints=limits(hold_current), starts=starts, method=method,
        sensitivities=False,
    )  # fmt: skip


def check_optimum(design: Design, time: float, values: list[float], multipliers: dict[str, float], bent: float) -> None:
    assert design.status == "optimal"
    assert design.kkt_residual < 1e-9
    assert design.objective == pytest.approx(time, abs=1e-12)
    np.testing.assert_allclose(list(design.values.values()), values, rtol=1e-7)
    assert design.multipliers == pytest.approx(multipliers, rel=1e-7)
    # The reference has seconds for the objective, here it is a fraction of what it is at the optimum.
    np.testing.assert_allclose(time * design.curvature.eigenvalues, [bent], rtol=1e-6)


@pytest.mark.parametrize("method", ["SLSQP", pytest.param("trust-constr", marks=pytest.mark.slow)])
def test_least_opening_time_under_limits(method: Method) -> None:
    multipliers = {
        "peak current": 0.005411405038892,
        "pressure angle": 0.051690735981756,
        "master.bore": 6.1285362414657,
    }
    check_optimum(
        optimum("13.65 mm", "12 A", method=method), 0.09891091660971675,
        [3.1301434299444684, 13.65e-3, 10e-3, 11.742], multipliers, 3.821090517442704,
    )  # fmt: skip


@pytest.mark.slow
def test_least_opening_time_with_less_current_to_hold() -> None:
    multipliers = {
        "peak current": 0.0053742304727783, "holding current": 7.430916448812e-06, "master.bore": 1.610378177593956,
    }  # fmt: skip
    check_optimum(
        optimum("14 mm", "11 A"), 0.09824297095358837, [3.14851396918547, 14e-3, 9.558452067847488e-3, 11.742],
        multipliers, 3.135741203172928,
    )  # fmt: skip


@pytest.mark.slow
def test_all_starts_lead_to_the_least_opening_time() -> None:
    design = optimum("13.65 mm", "12 A", starts=5)
    assert len(design.others) == 4
    assert design.objective == pytest.approx(0.09891091660971675, abs=1e-12)
    assert all(other.status != "optimal" or other.objective >= design.objective - 1e-12 for other in design.others)


@pytest.mark.thorough
def test_a_design_that_gets_nowhere_is_no_hindrance() -> None:
    def run(model: object) -> object:
        return simulate(model, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end", rtol=1e-9)  # pyright: ignore

    weak = replace(drive, {"gear.ratio": 2.0})
    design = optimise(weak, {"gear.ratio": (1.5, 30.0)}, {"time": (lambda s: s.t1, "ms")}, run=run)
    assert design.status == "optimal"
    assert "The stop condition was never met" in design.failed[0].why
    slopes = {row.parameter: row.per_unit for row in design.sensitivities.rows}
    assert set(slopes) >= {"supply.V", "motor.resistor.R", "load.J"}
    stronger = replace(drive, {"gear.ratio": design.values["gear.ratio"], "supply.V": 12.0 * (1 + 1e-4)})
    # Ratios beside it are no better, so what changes the time is the voltage alone.
    time = float(simulate(stronger, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end", rtol=1e-9).t1)
    assert slopes["supply.V"] == pytest.approx((time - design.objective) / 12e-4, rel=1e-3)
