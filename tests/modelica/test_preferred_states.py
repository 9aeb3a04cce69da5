"""Variables that are preferred as states without being differentiated (Modelica 3.6, section 4.9.7.1)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import simulate, structure
from acausal.modelica import load

LEVEL = "Real level(start = 0.8, stateSelect = StateSelect.prefer), m(start = 5);"
STATES = {
    "an explicit function of a state": (
        "Real x, v(stateSelect = StateSelect.prefer);",
        "der(x) = 1; v = 2 * x;",
        {"v"},
    ),
    "a nonlinear function": (LEVEL, "der(m) = -m; 3 * m = level + level ^ 3;", {"level"}),
    "an array": (
        "Real x[2], v[2](each stateSelect = StateSelect.prefer);",
        "der(x) = {1, 2}; 3 * x = v + v .^ 3;",
        {"v"},
    ),
    "over other variables": (
        "Real x, y, v(stateSelect = StateSelect.prefer);",
        "der(x) = 1; y = 2 * x; y = 3 * v + v ^ 3;",
        {"v"},
    ),
    "always": ("Real x, v(stateSelect = StateSelect.always);", "der(x) = 1; v = 2 * x;", {"v"}),
    "the rate of a coordinate": (
        "Real x, y, v(stateSelect = StateSelect.prefer);",
        "der(x) = y; der(y) = -x; v = der(x) + x;",
        {"x", "v"},
    ),
    # An event may move these, and not the states.
    "a jump": (
        "Real x, y(stateSelect = StateSelect.prefer), s;",
        "der(x) = 1; y = x + s; s = if time < 0.5 then 0 else 2;",
        {"x"},
    ),
    "a law of time": ("Real x, y(stateSelect = StateSelect.prefer);", "der(x) = 1; y = x + sin(time);", {"x"}),
    # These are no functions of states, or not in every position.
    "a parameter": (
        "parameter Real p = 2; Real x, z(stateSelect = StateSelect.prefer);",
        "der(x) = z; z + z ^ 3 = p;",
        {"x"},
    ),
    "a turning point": ("Real x, v(stateSelect = StateSelect.prefer);", "der(x) = 1; v = sin(x);", {"x"}),
    "a vanishing coefficient": (
        "Real x, z, v(stateSelect = StateSelect.prefer);",
        "der(x) = 1; der(z) = 1; sin(x) = v + v ^ 3;",
        {"x", "z"},
    ),
}


@pytest.mark.parametrize(("variables", "equations", "states"), STATES.values(), ids=STATES)
def test_preferred_variables_are_states_where_the_derivative_of_a_state_follows_from_theirs(
    variables: str, equations: str, states: set[str]
) -> None:
    model = load(f"model M {variables} equation {equations} end M;", "M")
    assert set(structure(model).states) == states


@pytest.mark.thorough
def test_the_start_value_of_a_preferred_variable_holds() -> None:
    """The mass of a tank decays, from that of the level at the start."""
    equations = "der(m) = -m; 3 * m = level + level ^ 3;"
    solution = simulate(load(f"model M {LEVEL} equation {equations} end M;", "M"), 1.0, rtol=1e-9)
    level = solution["level"]
    assert level[0] == 0.8
    assert 3.0 * solution["m"][-1] == pytest.approx((0.8 + 0.8**3) * np.exp(-1.0), rel=1e-7)


@pytest.mark.thorough
def test_a_new_value_of_a_state_keeps_the_preferred_states() -> None:
    text = """model M
      Real a(start = 3, fixed = true, stateSelect = StateSelect.always), b(start = 1, fixed = true);
      Real relative(stateSelect = StateSelect.prefer);
    equation
      der(a) = 0; der(b) = 0; relative = a - b;
      when time > 0.5 then reinit(a, 0); end when;
    end M;"""
    solution = simulate(load(text, "M"), 1.0, save=np.array([0.4, 0.6]))
    assert_allclose(np.stack([solution[name] for name in ("a", "b", "relative")], 1), [[3, 1, 2], [0, -2, 2]])
