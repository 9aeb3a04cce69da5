"""A process whose numbers have 32 bits: times that rounding does not tell apart are farther apart there."""

import os
import subprocess
import sys

import pytest

CODE = """
from typing import Self
from acausal import Component, Discrete, Equations, Events, Scalar, Var, at, eq, simulate, when

class Swing(Component):
    x: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1"] = 1.0
    passed: Discrete[Scalar, "1"] = 0.0
    ticks: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.v, check_units=False), v=eq(d.v, -9.0 * self.x, check_units=False))

    def events(self) -> Events:
        return dict(
            up=when(self.x > 0.2, passed=self.passed + 1.0), tick=at(0.0, every=0.1, ticks=self.ticks + 1.0)
        )

sol = simulate(Swing(), 3.05, rtol=1e-3, peaks=lambda s: dict(x=s.x))
print(sol.final.x.dtype, float(sol.final.passed), float(sol.final.ticks), round(float(sol.peaks["x"].value), 3))
"""


@pytest.mark.thorough
def test_events_clocks_and_peaks() -> None:
    env = os.environ | {"JAX_ENABLE_X64": "0", "ACAUSAL_CACHE": "off", "ACAUSAL_OPTIMISE": "off"}
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", CODE], env=env, capture_output=True, text=True, timeout=300, check=True
    )
    assert run.stdout.split() == ["float32", "2.0", "31.0", "0.333"]
