"""Annotations that a load takes into account: `experiment`, `uses`, and the message of a missing inner component."""

import warnings
from pathlib import Path

import pytest

from acausal.modelica import ExperimentAnnotation, ModelicaWarning, load

LIBRARY = """package Lib
  constant Real k = 2;
  annotation(version = "4.1.0", conversion(noneFromVersion = {"4.0.0"}, from(version = {"3.2.3"}, script = "c.mos")));
end Lib;
"""


def _warnings(text: str, model: str, root: Path) -> list[str]:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        load(text, model, root)
    return [str(one.message) for one in found if issubclass(one.category, ModelicaWarning)]


@pytest.mark.parametrize(
    ("uses", "said"),
    [
        ('uses(Lib(version = "3.2.3"))', "conversion"),
        ('uses(Lib(version = "5.0"))', ""),
        ('uses(Lib(version = "4.0.0"))', None),
        ('uses(Lib(version = "4.1.0"))', None),
        ("uses(Lib)", None),
        ('uses(Other(version = "1"))', None),
    ],
)
def test_a_library_of_another_version_is_named(tmp_path: Path, uses: str, said: str | None) -> None:
    (tmp_path / "Lib.mo").write_text(LIBRARY)
    text = f"package P model M Real x = Lib.k; end M; annotation({uses}); end P;"
    for _ in range(2):  # the second time from the cache
        found = _warnings(text, "P.M", tmp_path)
        if said is None:
            assert found == []
            continue
        assert len(found) == 1
        wanted = uses.split('"')[1]
        assert found[0].startswith(f"<model>.mo: P uses Lib {wanted}, but the library found is Lib 4.1.0 (")
        assert str(tmp_path / "Lib.mo") in found[0]
        assert ("needs a conversion" in found[0]) == bool(said)


def test_a_library_that_the_model_does_not_read_has_no_warning(tmp_path: Path) -> None:
    (tmp_path / "Lib.mo").write_text(LIBRARY)
    text = 'package P model M Real x = 1; end M; annotation(uses(Lib(version = "1"))); end P;'
    assert _warnings(text, "P.M", tmp_path) == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("annotation(experiment(StopTime = 5));", ExperimentAnnotation(stop=5.0)),
        (
            "annotation(Icon(), experiment(StartTime = -1, StopTime = 2 * 3600, Tolerance = 1e-4, Interval = 0.1, "
            'Algorithm = "dassl"));',
            ExperimentAnnotation(-1.0, 7200.0, 1e-4, 0.1),
        ),
        ("constant Real T = 3; annotation(experiment(StopTime = T));", ExperimentAnnotation(stop=3.0)),
        ("extends B;", ExperimentAnnotation(stop=7.0)),
        ("extends B; annotation(experiment(StopTime = 1));", ExperimentAnnotation(stop=1.0)),
        ("", ExperimentAnnotation()),
    ],
)
def test_a_model_tells_its_experiment(text: str, expected: ExperimentAnnotation) -> None:
    base = "model B Real z = 1; annotation(experiment(StopTime = 7)); end B;"
    assert load(f"{base} model M Real x = 1; {text} end M;", "M").experiment == expected


def test_variables_may_have_the_names_of_attributes_of_models() -> None:
    model = load("model M parameter Real flat = 2, experiment = 3; Real x = flat * experiment; end M;", "M")
    assert (model.flat_, model.experiment_) == (2.0, 3.0)
    assert model.experiment == ExperimentAnnotation()


INNER = """package P
  model World parameter Real g = 9.81; {annotation} end World;
  model Body outer World world; Real a = world.g; end Body;
  model Fall Body body, other; end Fall;
  model Whole inner World world; Body body; end Whole;
end P;
"""


def test_a_missing_inner_component_is_named_with_the_message_of_its_class() -> None:
    text = INNER.format(annotation='annotation(missingInnerMessage = "No world" + "\n is defined.");')
    (found,) = _warnings(text, "P.Fall", Path.cwd())
    assert found.startswith("<model>.mo:4:26: body has no component `inner world` around it")
    assert "No world is defined. Remedy: declare `inner P.World world;`" in found
    assert _warnings(text, "P.Whole", Path.cwd()) == []


def test_a_missing_inner_component_without_a_message_is_named() -> None:
    (found,) = _warnings(INNER.format(annotation=""), "P.Fall", Path.cwd())
    assert "gets one with default values. Remedy: declare" in found


def test_the_end_of_a_run_triggers_nothing_and_a_warning_says_so(tmp_path: Path) -> None:
    text = """
package P
  model A
    discrete Real y(start = 1, fixed = true);
  equation
    when terminal() then
      y = 2;
    end when;
  end A;
  model M
    A a, b;
  end M;
end P;"""
    (found,) = _warnings(text, "P.M", tmp_path)
    assert found.startswith("<model>.mo:6:10: `terminal()` is false")
