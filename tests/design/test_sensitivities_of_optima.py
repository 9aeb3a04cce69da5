"""Sensitivities of an optimum to the fixed parameters of its run, against a closed form."""

from typing import Self

import pytest

from acausal import Component, Equations, Param, Scalar, Var, eq, simulate
from acausal.design import optimise
from acausal.design._compute import evaluator


class Decay(Component):
    """The value exp(-k) after a second, and the weights of a compromise between a small value and a small k."""

    k: Param[Scalar, "1/s"] = 1.0
    weight: Param[Scalar, "1"] = 2.5
    scale: Param[Scalar, "s"] = 2.0
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x))


@pytest.mark.thorough
@pytest.mark.parametrize("few", [100, 0], ids=["forward mode", "reverse mode"])
def test_sensitivities_of_an_optimum(monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """The least scale k + weight exp(-k) is scale (1 + log(weight / scale))."""
    monkeypatch.setattr(evaluator, "FEW", few)
    design = optimise(
        Decay(), {"k": (0.01, 3.0)}, lambda s: s.final.scale * s.final.k + s.final.weight * s.final.x,
        run=lambda model: simulate(model, 1.0, save="end", rtol=1e-10),
    )  # fmt: skip
    model, found = Decay(), {row.parameter: row.per_unit for row in design.sensitivities.rows}
    assert found["weight"] == pytest.approx(float(model.scale / model.weight), rel=1e-6)
    assert found["scale"] == pytest.approx(design.values["k"], rel=1e-6)
