"""The packages of components import their modules lazily."""

import compileall
import importlib
import json
import pickle
import pkgutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import components

PACKAGES = [item.name for item in pkgutil.iter_modules(components.__path__) if item.ispkg]

# The modules of components that are there after one component was named.
PROGRAM = """
import json, sys
from components.electrical import Resistor
assert Resistor(R=1.0).R == 1.0
print(json.dumps([name for name in sys.modules if name.startswith("components.electrical.")]))
"""


@pytest.mark.thorough
def test_a_component_brings_only_what_it_needs() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    names = {name.rpartition(".")[2] for name in json.loads(done.stdout)}
    assert "_passive" in names
    assert not names & {"_battery", "_pmsm", "_solenoid", "_switches"}


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_has_all_the_names_that_it_lists(name: str) -> None:
    """The names in `dir` and in a star import agree, except for `load`, which the latter leaves out."""
    package = importlib.import_module(f"components.{name}")
    scope: dict[str, object] = {}
    exec(f"from components.{name} import *", scope)
    assert len(dir(package)) > 10
    assert scope.keys() - {"__builtins__"} == set(package.__all__) == set(dir(package)) - {"load"}
    for public in dir(package):
        item = getattr(package, public)
        assert not public.startswith("_")
        if isinstance(item, type):
            assert item.__module__.startswith("components.")
            assert pickle.loads(pickle.dumps(item)) is item


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match=r"module 'components.thermal' has no attribute 'HeatCapacitator'"):
        _ = importlib.import_module("components.thermal").HeatCapacitator
    with pytest.raises(ImportError, match=r"cannot import name 'Spoon' from 'components.thermal'"):
        exec("from components.thermal import Spoon")


PACKAGE = """
from typing import TYPE_CHECKING

from components._lazy import when_asked

if TYPE_CHECKING:
    from ._one import First as First
    from ._one import Second as Second
    from ._two import Third as Third
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
"""


@pytest.mark.parametrize("kind", ["compiled", "zipped"])
def test_a_package_needs_no_source(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in frozen programs, and as read from an archive."""
    package = tmp_path / f"shelf_{kind}"
    package.mkdir()
    (package / "__init__.py").write_text(PACKAGE)
    (package / "_one.py").write_text("First, Second = 1, 2\n")
    (package / "_two.py").write_text("Third = 3\n")
    assert compileall.compile_dir(package, quiet=1, legacy=True)
    for source in package.glob("*.py"):
        source.unlink()
    place = tmp_path
    if kind == "zipped":
        place = tmp_path / "shelf.zip"
        with zipfile.ZipFile(place, "w") as archive:
            for file in package.glob("*.pyc"):
                archive.write(file, f"{package.name}/{file.name}")
                file.unlink()
    monkeypatch.syspath_prepend(place)
    shelf = importlib.import_module(package.name)
    assert dir(shelf) == shelf.__all__ == ["First", "Second", "Third"]
    assert (shelf.First, shelf.Third) == (1, 3)
    assert f"{package.name}._one" in sys.modules
