"""Packages in files: which file holds a class, and the caches of trees and flat models."""

from pathlib import Path

import pytest

from acausal.modelica import ModelicaError
from acausal.modelica._frontend import library, stored
from acausal.modelica._frontend.flatten import flat_model
from acausal.modelica._frontend.library import Libraries
from acausal.modelica._frontend.source import Source
from acausal.modelica._syntax import expressions as e


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def test_classes_of_a_package_lie_in_files_and_folders(tmp_path: Path) -> None:
    root = written(
        tmp_path,
        {
            "Lib 1.2.0/package.mo": "within ; package Lib model A end A; end Lib;",
            "Lib 1.2.0/B.mo": "within Lib; model B end B;",
            "Lib 1.2.0/Sub/package.mo": "within Lib; package Sub end Sub;",
            "Lib 1.2.0/Sub/C.mo": "within Lib.Sub; model C end C;",
            "Lib 1.2.0/Resources/table.txt": "no class",
            "Lib 1.2.0/notes.txt": "no class",
            "Other.mo": "package Other end Other;",
        },
    )
    libraries = Libraries([], [root])
    lib = libraries.find("Lib")
    assert lib is not None
    assert sorted(lib.stored) == ["B", "Sub"]
    sub = lib.load("Sub")
    assert sub is not None
    inner = sub.load("C")
    assert inner is not None
    assert inner.tree.name == "C"
    assert inner.source.place(inner.tree.at).file.endswith("C.mo")
    assert libraries.find("Other") is not None
    assert libraries.find("Missing") is None


def test_a_root_may_be_the_library_itself(tmp_path: Path) -> None:
    root = written(tmp_path, {"Lib/package.mo": "package Lib end Lib;"}) / "Lib"
    assert Libraries([], [root]).find("Lib") is not None


def test_the_text_of_the_user_comes_first(tmp_path: Path) -> None:
    root = written(tmp_path, {"Lib.mo": "package Lib end Lib;"})
    found = Libraries([Source("<text>", "model Lib end Lib;")], [root]).find("Lib")
    assert found is not None
    assert found.tree.kind == "model"


def test_two_libraries_of_one_name_are_refused(tmp_path: Path) -> None:
    text = "package Lib end Lib;"
    roots = [written(tmp_path / "a", {"Lib.mo": text}), written(tmp_path / "b", {"Lib 2.0.mo": text})]
    with pytest.raises(ModelicaError, match=r"two libraries Lib: .*a/Lib\.mo and .*b/Lib 2\.0\.mo"):
        Libraries([], roots).find("Lib")


def test_a_file_must_hold_the_class_of_its_name(tmp_path: Path) -> None:
    root = written(tmp_path, {"Lib.mo": "package Other end Other;"})
    with pytest.raises(ModelicaError, match=r"Lib\.mo: the file must define Lib"):
        Libraries([], [root]).find("Lib")


def test_trees_of_large_files_come_from_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = f'package Lib "{"long" * 2000}" model A end A; end Lib;'
    root = written(tmp_path / "roots", {"Lib.mo": text})
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setattr(library.programs, "folder", cache)
    library.read(root / "Lib.mo")
    (stored,) = cache.iterdir()
    library._read.cache_clear()
    monkeypatch.setattr(library, "parse", None)  # the tree is not parsed again
    tree, source = library.read(root / "Lib.mo")
    assert tree.classes[0].name == "Lib"
    assert source.text == text
    assert stored.name.startswith("modelica-tree-")


PUMP = "within Plant;\nmodel Pump\n  parameter Real k = 1;\n  Real q;\nequation\n  q = k * time;\nend Pump;\n"


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    """A folder with a library."""
    return written(tmp_path / "roots", {"Plant/package.mo": "package Plant end Plant;", "Plant/Pump.mo": PUMP})


def test_a_model_is_found_in_a_text_a_file_and_a_package(plant: Path) -> None:
    text = "model Two Plant.Pump a, b(k = 2); end Two;"
    assert set(flat_model(text, "Two", [plant]).variables) == {"a.k", "a.q", "b.k", "b.q"}
    file = written(plant.parent, {"Two.mo": text}) / "Two.mo"
    assert set(flat_model(file, "Two", [plant]).variables) == {"a.k", "a.q", "b.k", "b.q"}
    for source in (plant / "Plant", plant / "Plant" / "package.mo", str(plant / "Plant" / "Pump.mo")):
        (equation,) = flat_model(source, "Plant.Pump").equations
        assert str(equation.place) == f"{plant / 'Plant' / 'Pump.mo'}:6"


def test_a_file_without_within_is_a_text_of_its_own_beside_a_package(plant: Path) -> None:
    file = written(plant, {"Plant/Alone.mo": "model Alone Real x = 1; end Alone;"}) / "Plant" / "Alone.mo"
    assert set(flat_model(file, "Alone").variables) == {"x"}


def test_a_library_that_changes_is_read_again(plant: Path) -> None:
    first = flat_model("", "Plant.Pump", [plant])
    fan = "within Plant; model Fan end Fan;"
    written(
        plant,
        {"Plant/Pump.mo": PUMP.replace("k * time", "k + time"), "Plant/Fan.mo": fan},
    )
    assert flat_model("", "Plant.Pump", [plant]).equations != first.equations
    assert flat_model("", "Plant.Fan", [plant]).variables == {}


def test_the_flat_model_comes_from_the_cache_until_a_text_changes(
    plant: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setattr(stored.programs, "folder", cache)
    first = stored.stored_model("", "Plant.Pump", [plant])
    with monkeypatch.context() as patch:
        patch.setattr(stored, "flat_model", None)  # the model is not flattened again
        assert stored.stored_model("", "Plant.Pump", [plant]) == first
    assert stored.stored_model("", "Plant.Pump(k = 2)", [plant]) != first
    written(plant, {"Plant/Pump.mo": PUMP.replace("k * time", "2 * k * time")})
    assert stored.stored_model("", "Plant.Pump", [plant]).equations != first.equations


def test_a_uri_names_a_file_of_a_package(tmp_path: Path) -> None:
    files = {"Lib 1.0/package.mo": "package Lib end Lib;", "Lib 1.0/Sub/package.mo": "within Lib; package Sub end Sub;"}
    libraries = Libraries([], [written(tmp_path, files)])
    assert libraries.resource("modelica://Lib/Data/a.txt") == str(tmp_path / "Lib 1.0" / "Data" / "a.txt")
    assert libraries.resource("modelica://Lib.Sub/a.txt") == str(tmp_path / "Lib 1.0" / "Sub" / "a.txt")
    assert libraries.resource("modelica://Lib/Data/") == f"{tmp_path / 'Lib 1.0' / 'Data'}/"
    assert libraries.resource("modelica://Lib") == str(tmp_path / "Lib 1.0")
    assert libraries.resource("modelica://Other/a.txt") == "modelica://Other/a.txt"
    text = 'model M parameter String file = "modelica://Lib/a.txt"; end M;'
    binding = flat_model(text, "M", [tmp_path]).variables["file"].binding
    assert binding == e.Const(str(tmp_path / "Lib 1.0" / "a.txt"))


LINES = """model M
  function count
    input String file;
    output Integer n;
  external "C" n = ModelicaInternal_countLines(file);
  end count;
  parameter String file;
  Real x[count(file)];
equation
  x = ones(count(file));
end M;
"""


def test_the_cached_flat_model_depends_on_data_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setattr(stored.programs, "folder", cache)
    data = written(tmp_path, {"data.txt": "a\nb\n"}) / "data.txt"
    for text, size in (("a\nb\n", 2), ("a\nb\n", 2), ("a\nb\nc\n", 3)):
        if data.read_text() != text:
            data.write_text(text)
        assert stored.stored_model(LINES, f'M(file = "{data}")').variables["x"].dims == (size,)
