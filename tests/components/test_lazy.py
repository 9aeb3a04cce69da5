"""Packages of components import what is asked of them."""

import importlib
import json
import pickle
import pkgutil
import subprocess
import sys

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


def test_a_component_brings_only_what_it_needs() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    names = {name.rpartition(".")[2] for name in json.loads(done.stdout)}
    assert "_passive" in names
    assert not names & {"_battery", "_pmsm", "_solenoid", "_switches"}


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_has_all_the_names_that_it_lists(name: str) -> None:
    """Those of `dir`, of a star import and of its source."""
    package = importlib.import_module(f"components.{name}")
    scope: dict[str, object] = {}
    exec(f"from components.{name} import *", scope)
    assert len(dir(package)) > 10
    assert scope.keys() - {"__builtins__"} == set(dir(package)) == set(package.__all__)
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
