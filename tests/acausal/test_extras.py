"""Functions that need a package that is not installed say how to install it."""

import sys
from collections.abc import Callable
from typing import Any

import pytest
from _models import rc

from acausal import ModelError, Solution, linearise, simulate
from acausal.design import train

USES: dict[str, Callable[[Solution], Any]] = {
    "matplotlib": lambda sol: sol.plot(),
    "pandas": lambda sol: sol.to_pandas(),
    "xarray": lambda sol: sol.to_xarray(),
    "control": lambda sol: linearise(rc()).to_control(),
    "optax": lambda sol: train(rc(), ["c.C"], lambda model: model.c.C),
}
EXTRA = {"matplotlib": "plots", "pandas": "tables", "xarray": "tables", "control": "control", "optax": "learn"}


@pytest.mark.parametrize("package", USES)
def test_missing_package(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [package, *(name for name in sys.modules if name.startswith(f"{package}."))]:
        monkeypatch.setitem(sys.modules, name, None)  # as if it were not installed
    with pytest.raises(ModelError, match=rf'needs {package}: pip install "acausal\[{EXTRA[package]}\]"\.'):
        USES[package](simulate(rc(), 0.1))
