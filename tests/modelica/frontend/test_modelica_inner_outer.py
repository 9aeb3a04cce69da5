"""Values of outer components that select equations, components and sizes: they are those of the inner component."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import replace, simulate
from acausal.modelica import ModelicaError, load
from acausal.modelica._frontend.flatten import flat_model

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
    ("old", "new"),
    [
        ("parameter Start start = system", "final parameter Start start = system"),
        ("own = start", "own = system.mass"),
        ("own ==", "system.mass =="),
    ],
)
def test_final_values_and_the_outer_ones_themselves_select(old: str, new: str) -> None:
    assert_allclose(starts("Plant(system(energy = Plant.Start.Given))", MODEL.replace(old, new)), 3.0)


def test_unmodified_values_select() -> None:
    text = MODEL.replace("own ==", "system.mass ==").replace("energy = Start.Free", "energy = Start.Given")
    assert_allclose(starts("Plant", text), 3.0)


def test_an_expression_of_a_follower_selects_by_its_value() -> None:
    text = MODEL.replace("final parameter Start own = start", "final parameter Boolean own = start == Start.Given")
    text = text.replace("if own == Start.Given then", "if own then").replace(
        "elseif own == Start.Steady", "elseif start == Start.Steady"
    )
    assert_allclose(starts("Plant(system(energy = Plant.Start.Given))", text), 3.0)
    assert_allclose(starts("Plant(system(energy = Plant.Start.Steady))", text), 2.0)


def test_elements_of_an_array_have_values_of_their_own() -> None:
    text = MODEL.replace("Tank tank[2];", "outer System system; Tank tank[2](start = {system.mass, Start.Free});")
    assert_allclose(starts("Plant(system(energy = Plant.Start.Given))", text), [3.0, 3.0, 1.0])


SELECTION = """
package P
  type S = enumeration(Free, Given);
  function f input Boolean b; output Boolean y; algorithm y := not b; end f;
  model Part Real y = 3; end Part;
  model System
    parameter Boolean flag = false;
    parameter Boolean inverse = not flag;
    parameter Integer n = 1;
    parameter Real k = 1;
    parameter S s = S.Free;
  end System;
  model Special extends System(flag = true, n = 3, k = 3, s = S.Given); end Special;
  model Redeclared
    extends System(n = 3, k = 3, s = S.Given);
    redeclare parameter Boolean flag = true;
  end Redeclared;
  model Tank
    outer System system;
    DECLARED
    Real y;
  equation
    EQUATIONS
  end Tank;
  model Room
    inner System system;
    Tank tank;
  end Room;
  model House
    replaceable model Kind = System;
    inner Kind system;
    Tank tank;
  end House;
  model Plant
    INNER
  end Plant;
end P;
"""
INNER = {
    "modifier": "inner System system(flag = true, n = 3, k = 3, s = S.Given); Tank tank;",
    "parameter": "parameter Boolean on = f(false); inner System system(flag = on, n = 3, k = 3, s = S.Given);"
    "Tank tank;",
    "extends": "inner Special system; Tank tank;",
    "redeclare": "inner Redeclared system; Tank tank;",
    "class": "extends House(redeclare model Kind = Special);",
    "component": "extends Room(system(flag = true, n = 3, k = 3, s = S.Given));",
}
EQUATIONS = "if d == S.Given then y = 3; der(z) = y; else y = z; z = 1; end if;"
DERIVED = {
    "if": "S d = if system.flag then S.Given else S.Free",
    "nested": "S d = if system.n > 2 then (if system.flag then S.Given else S.Free) else S.Free",
    "enumeration": "S d = system.s",
    "chain": "S e = if system.inverse then S.Free else S.Given; parameter S d = e",
    "function": "S d = if f(system.flag) then S.Free else S.Given",
    "real": "S d = if sqrt(system.k) > 1.7 then S.Given else S.Free",
}


def height(declared: str, equations: str, inner: str = INNER["modifier"], name: str = "tank.y") -> float:
    text = SELECTION.replace("DECLARED", declared).replace("EQUATIONS", equations).replace("INNER", inner)
    return float(simulate(load(text, "P.Plant"), 0.1)[name][-1])


@pytest.mark.parametrize(
    ("derived", "inner"), [*((derived, "modifier") for derived in DERIVED), *(("chain", inner) for inner in INNER)]
)
def test_an_expression_of_outer_values_selects_equations(derived: str, inner: str) -> None:
    assert height(f"parameter {DERIVED[derived]}; Real z;", EQUATIONS, INNER[inner]) == 3.0


@pytest.mark.parametrize(
    ("declared", "equations"),
    [
        ("parameter Integer m = system.n; Real p[3];", "for i in 1:m loop p[i] = 1; end for; y = sum(p);"),
        ("parameter Integer m = if system.flag then 3 else 1; Real p[m] = ones(m);", "y = sum(p);"),
        ("parameter Integer m = system.n; parameter Integer l = m;", "y = sum({1.0 for i in 1:l});"),
        ("parameter Real m[:] = fill(1.0, system.n);", "y = size(m, 1);"),
        ("Real p[system.n] = ones(system.n);", "y = sum(p);"),
        ("parameter Integer m = system.n; Part part[m];", "y = sum(part.y) / 3;"),
    ],
)
def test_ranges_and_sizes_have_the_outer_values(declared: str, equations: str) -> None:
    assert height(declared, equations) == 3.0


@pytest.mark.parametrize("condition", ["system.flag", "b", "d == S.Given"])
def test_a_component_is_present_by_the_outer_value(condition: str) -> None:
    declared = f"parameter Boolean b = system.flag; parameter {DERIVED['if']}; Part part if {condition};"
    assert height(declared, "y = 1;", name="tank.part.y") == 3.0


def test_the_nearest_inner_component_counts() -> None:
    inner = """inner System system; Tank tank; Room room(system(flag = true));
    Room rooms[2](system(flag = {false, true}));
    House house(system(flag = system.flag));"""
    declared = f"parameter {DERIVED['if']}; Real z;"
    values = [height(declared, EQUATIONS, inner, name) for name in ("tank.y", "room.tank.y", "house.tank.y")]
    assert values == [1.0, 3.0, 1.0]
    assert [height(declared, EQUATIONS, inner, f"rooms[{i}].tank.y") for i in (1, 2)] == [1.0, 3.0]


def test_a_component_that_an_outer_value_adds_has_outer_values() -> None:
    inner = "inner System system(flag = true); Floor floor;"
    floor = "model Floor outer System system; parameter Boolean b = system.flag; Tank tank if b; end Floor;"
    declared = f"parameter {DERIVED['if']}; Real z;"
    assert height(declared, EQUATIONS, f"{floor} {inner}", "floor.tank.y") == 3.0


def test_a_parameter_that_selects_equations_still_follows() -> None:
    text = SELECTION.replace("DECLARED", f"parameter {DERIVED['if']}; parameter Real k = 2 * system.k; Real z;")
    plant = load(text.replace("EQUATIONS", EQUATIONS).replace("INNER", INNER["extends"]), "P.Plant")
    assert replace(plant, {"system.k": 5.0}).tank.k == 10.0


@pytest.mark.parametrize(
    ("declared", "equations"),
    [
        ("Real z;", "if system.flag then y = 3; z = 1; else y = z; z = 1; end if;"),
        ("", "y = sum({1.0 for i in 1:system.n});"),
        ("", "algorithm y := 0; for i in 1:system.n loop y := y + 1; end for;"),
        ("final parameter Boolean b = system.flag;", "y = if b then 3 else 1;"),
    ],
)
@pytest.mark.parametrize("inner", ["modifier", "redeclare"])
def test_equations_read_the_outer_value_directly(inner: str, declared: str, equations: str) -> None:
    assert height(declared, equations, INNER[inner]) == 3.0
    assert height(declared, equations, "inner System system; Tank tank;") == 1.0


def test_elements_of_the_inner_class_that_the_outer_class_lacks_are_not_visible() -> None:
    text = """partial model Fewer Real p; end Fewer; model More extends Fewer(p = 3); Real q = 4; end More;
        model A outer Fewer w; Real y = w.{}; end A; model M inner More w; A a; end M;"""
    flat_model(text.replace("{}", "p"), "M")
    with pytest.raises(ModelicaError, match=r"w has no element q\.\n"):
        flat_model(text.replace("{}", "q"), "M")


@pytest.mark.parametrize(
    ("outer", "inner", "is_right"),
    [
        ("p", "p[2]", False),
        ("p[2]", "p", False),
        ("p[3]", "p[2]", False),
        ("p[2]", "p[2]", True),
        ("p[:]", "p[2]", True),
    ],
)
def test_an_outer_array_has_the_size_of_the_inner_one(outer: str, inner: str, is_right: bool) -> None:
    text = f"model A outer Real {outer}; end A; model M inner Real {inner}; A a; end M;"
    if is_right:
        flat_model(text, "M")
    else:
        with pytest.raises(ModelicaError, match="and the outer component another one"):
            flat_model(text, "M")
