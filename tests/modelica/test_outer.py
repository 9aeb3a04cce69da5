"""Parameters that follow an outer component: the branch of an if and the range of a loop have the modified value."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import simulate
from acausal.modelica import ModelicaError, load

MODEL = """
model Plant
  type Start = enumeration(Free, Given, Steady);
  model System
    parameter Start energy = Start.Free;
    parameter Start mass = energy;
    parameter Integer n = 1;
  end System;
  model Tank
    outer System system;
    parameter Start start = system.mass;
    final parameter Start own = start;
    parameter Integer n = system.n;
    Real level(start = 1);
    Real part[n];
  equation
    der(level) = 2 - level;
    for i in 1:n loop
      part[i] = i * level;
    end for;
  initial equation
    if own == Start.Given then
      level = 3;
    elseif own == Start.Steady then
      der(level) = 0;
    end if;
  end Tank;
  model Group
    Tank tank[2];
  end Group;
  inner System system;
  Tank tank;
  Group group;
end Plant;
"""


def starts(model: str, text: str = MODEL) -> list[float]:
    solution = simulate(load(text, model), 0.1)
    return [float(solution[name][0]) for name in ("tank.level", "group.tank[1].level", "group.tank[2].level")]


@pytest.mark.parametrize(
    ("modifiers", "start"),
    [
        ("system(energy = Plant.Start.Given)", 3.0),
        ("system(mass = Plant.Start.Given)", 3.0),
        ("system(energy = Plant.Start.Steady)", 2.0),
        ("system(energy = Plant.Start.Given, mass = Plant.Start.Steady)", 2.0),
        ("system(energy = Plant.Start.Given), tank(level(start = 5))", 3.0),
    ],
)
def test_the_modified_value_selects_the_initial_equations(modifiers: str, start: float) -> None:
    assert_allclose(starts(f"Plant({modifiers})"), start)


def test_a_modifier_of_the_follower_has_priority() -> None:
    model = "Plant(system(energy = Plant.Start.Given), tank(start = Plant.Start.Steady))"
    assert_allclose(starts(model), [2.0, 3.0, 3.0])


def test_the_modified_value_is_the_range_of_a_loop() -> None:
    solution = simulate(load(MODEL, "Plant(system(n = 3, energy = Plant.Start.Given))"), 0.1)
    assert_allclose(solution["tank.part"], np.outer(solution["tank.level"], [1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    ("old", "new", "remedy"),
    [
        ("parameter Start start = system", "final parameter Start start = system", "declare tank.start without final"),
        ("own = start", "own = system.mass", "declare tank.own without final"),
        ("own ==", "system.mass ==", "declare a parameter that equals the outer one"),
    ],
)
def test_a_value_that_no_modifier_gives_is_refused(old: str, new: str, remedy: str) -> None:
    with pytest.raises(ModelicaError, match=f"which the front end ignores.*{remedy}"):
        load(MODEL.replace(old, new), "Plant(system(energy = Plant.Start.Given))")


def test_unmodified_values_need_no_remedy() -> None:
    text = MODEL.replace("own ==", "system.mass ==").replace("energy = Start.Free", "energy = Start.Given")
    assert_allclose(starts("Plant", text), 3.0)


def test_an_expression_of_a_follower_selects_by_its_value() -> None:
    text = MODEL.replace("final parameter Start own = start", "final parameter Boolean own = start == Start.Given")
    text = text.replace("if own == Start.Given then", "if own then").replace(
        "elseif own == Start.Steady", "elseif start == Start.Steady"
    )
    assert_allclose(starts("Plant(system(energy = Plant.Start.Given))", text), 3.0)
    assert_allclose(starts("Plant(system(energy = Plant.Start.Steady))", text), 2.0)


def test_elements_of_an_array_with_values_of_their_own_are_refused() -> None:
    text = MODEL.replace("Tank tank[2];", "outer System system; Tank tank[2](start = {system.mass, Start.Free});")
    with pytest.raises(ModelicaError, match=r"group\.tank\[2\]\.start .*not all elements of its array"):
        load(text, "Plant(system(energy = Plant.Start.Given))")
