"""References in the docstrings of components."""

import importlib
import re
from typing import Any

import pytest

PACKAGES = ("blocks", "electrical", "hydraulic", "planar", "rotational", "thermal", "translational")
_POINTER = re.compile(r"[Ss]ee `([A-Z]\w+)`")


@pytest.mark.parametrize("name", PACKAGES)
def test_laws_that_stand_elsewhere_can_be_read(name: str) -> None:
    """Every class to which a docstring refers is exported by the package."""
    package: Any = importlib.import_module(f"components.{name}")
    found = {
        (pointer, kind)
        for kind in package.__all__
        for pointer in _POINTER.findall(getattr(package, kind).__doc__ or "")
    }
    assert name not in ("hydraulic", "rotational") or len(found) > 1
    assert {(pointer, kind) for pointer, kind in found if not hasattr(package, pointer)} == set()
