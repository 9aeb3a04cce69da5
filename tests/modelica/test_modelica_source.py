"""`source` names the modifier or declaration that gives a value."""

from pathlib import Path

import pytest

from acausal import UnknownNameError
from acausal.modelica import SourcePlace, load, source

PART = """within Plant;
model Part
  record Data
    parameter Real a = 1;
    parameter Real b = 2;
  end Data;
  parameter Real R = 1;
  parameter Real lambda = 3;
  parameter Data data;
  Real x(start = R, fixed = true), y;
equation
  der(x) = -x;
  y = data.a;
end Part;
"""
WHOLE = """model Whole
  parameter Real k = 5;
  Plant.Part plain;
  Plant.Part part(
    R = 2,
    data(b = 7));
  Plant.Part parts[2](R = {1, 2}, each x(start = 4),
    each data = Plant.Part.Data(a = 3, b = 4));
end Whole;
"""


def test_a_value_comes_from_the_outermost_modifier(tmp_path: Path) -> None:
    (tmp_path / "Plant").mkdir()
    (tmp_path / "Plant" / "package.mo").write_text("package Plant end Plant;")
    (tmp_path / "Plant" / "Part.mo").write_text(PART)
    file = tmp_path / "Whole.mo"
    file.write_text(WHOLE)
    model = load(file, "Whole(\n  k = 6)", roots=tmp_path)
    library, own = str(tmp_path / "Plant" / "Part.mo"), str(file)
    assert source(model, "plain.R") == SourcePlace(library, 7)
    assert source(model, "plain.x") == SourcePlace(library, 10)
    assert source(model, "plain.y") == SourcePlace(library, 10)
    assert source(model, "plain.lambda") == source(model, "plain.lambda_") == SourcePlace(library, 8)
    assert source(model, "part.R") == SourcePlace(own, 5)
    assert source(model, "part.data.a") == SourcePlace(library, 4)
    assert source(model, "part.data.b") == SourcePlace(own, 6)
    assert source(model, "parts[2].R") == source(model, "parts[1].x") == SourcePlace(own, 7)
    assert source(model, "parts[2].data.a") == SourcePlace(own, 8)
    assert str(source(model, "k")) == "the modifiers of Whole:2"


def test_an_element_of_an_array_is_stated_with_the_array() -> None:
    model = load("model A\n  parameter Real a[2] = {1, 2};\nend A;", "A")
    assert str(source(model, "a[2]")) == str(source(model, "a")) == "<model>.mo:2"
    with pytest.raises(UnknownNameError, match="no parameter or variable 'aa'"):
        source(model, "aa")
