"""Branches of `if` in when-clauses: what has an effect there has it only if the branch is taken."""

from typing import Any

import numpy as np
import pytest

from acausal import SimulationError, replace, simulate
from acausal.modelica import load

BRANCHES = """model Branches
  parameter Real top = 20, most = 20, stop = 9;
  Real x(start = 0, fixed = true);
  discrete Integer n(start = 0, fixed = true);
  Integer k(start = 0, fixed = true);
equation
  der(x) = 1;
  when sample(0.5, 0.5) then
    n = pre(n) + 1;
    if pre(n) == 1 then
      reinit(x, 10);
    elseif time > stop then
      terminate("it stops");
    else
      assert(x < top, "too high");
    end if;
    if pre(n) > 5 then
      terminate("it goes on");
    end if;
  end when;
algorithm
  when sample(0.5, 0.5) then
    k := pre(k) + 1;
    if k > 2 then
      assert(x < most, "too much");
    end if;
  end when;
end Branches;
"""
CLOCKED = """model Clocked
  parameter Real most = 20;
  Real x(start = 0, fixed = true);
  Real y;
  Integer n(start = 0);
  Clock c = Clock(1, 2);
equation
  der(x) = 1;
  when c then
    y = sample(x);
    n = previous(n) + 1;
    if y > 0.9 then
      assert(y < most, "too much");
    end if;
  end when;
end Clocked;
"""


@pytest.fixture(scope="module")
def branches() -> Any:
    return load(BRANCHES, "Branches")


def test_a_state_is_reset_in_a_branch_that_is_taken(branches: Any) -> None:
    sol = simulate(branches, 1.7, save=np.array([0.9, 1.2, 1.7]))
    assert np.allclose(sol["x"], [0.9, 10.2, 10.7], atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"top": 0.9}, r"t = 1\.5 s: .*too high"),
        ({"top": 0.9, "stop": 1.2}, r"t = 1\.5 s: .*it stops"),
        ({"most": 0.9}, r"t = 1\.5 s: .*too much"),
    ],
)
def test_a_run_ends_in_a_branch_that_is_taken(branches: Any, changes: dict[str, float], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        simulate(replace(branches, changes), 1.7)


def test_assertions_of_branches_of_clocked_equations() -> None:
    model: Any = load(CLOCKED, "Clocked")
    assert simulate(model, 1.7, save="end")["n"][-1] == 4
    with pytest.raises(SimulationError, match=r"t = 1 s: .*too much"):
        simulate(replace(model, {"most": 0.2}), 1.7)


def test_a_comparison_of_discrete_values_is_not_on_its_limit_in_an_assertion() -> None:
    text = """model Limit
  Real x(start = 0, fixed = true);
  discrete Integer n(start = 0, fixed = true);
equation
  der(x) = 1;
  when sample(0.5, 0.5) then
    n = pre(n) + 1;
  end when;
  assert(n <= pre(n) or x < 0.8, "too late");
end Limit;
"""
    with pytest.raises(SimulationError, match=r"t = 1 s: .*too late"):
        simulate(load(text, "Limit"), 1.2)


INITIAL = """model Initial
  parameter Real least = 0.5;
  Real x(start = 1, fixed = true);
initial equation
  assert(x >= least, "too little");
initial algorithm
  if least < -1 then
    assert(x < 0, "too much");
  end if;
equation
  der(x) = -1;
end Initial;
"""


def test_initial_assertions_hold_at_the_start_only() -> None:
    model: Any = load(INITIAL, "Initial")
    assert np.isclose(simulate(model, 1.0, save="end")["x"][-1], 0.0)
    for least, message in ((2.0, "t = 0 s: .*too little"), (-2.0, "t = 0 s: .*too much")):
        with pytest.raises(SimulationError, match=message):
            simulate(replace(model, {"least": least}), 1.0)
