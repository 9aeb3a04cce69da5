"""Packages imported with the library, for which every user waits."""

import json
import subprocess
import sys

import pytest

# Names of modules that importing everything adds, with all that the library builds on in place.
PROGRAM = """
import importlib, json, pkgutil, sys
import diffrax, equinox, jax, jax.scipy.linalg, lineax, optimistix
before = set(sys.modules)
import acausal
import components
for found in pkgutil.iter_modules(components.__path__, "components."):
    package = importlib.import_module(found.name)
    for name in dir(package):
        getattr(package, name)
print(json.dumps(sorted(sys.modules.keys() - before)))
"""


@pytest.mark.thorough
def test_what_only_some_calls_need_is_imported_by_them() -> None:
    """Only numpy and the root of scipy, which imports its parts on use; no pint, matplotlib, pandas or the like."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    names = json.loads(done.stdout)
    assert {"acausal", "components.electrical._pmsm", "components.hydraulic._pipes"} <= set(names)
    roots = {name.partition(".")[0].lstrip("_") for name in names} - sys.stdlib_module_names
    from_cython = {name for name in roots if name.startswith(("cyutility", "cython"))}  # of what scipy's root compiles
    assert roots - from_cython <= {"acausal", "components", "numpy", "scipy"}
    parts = {name.split(".")[1] for name in names if name.startswith("scipy.")}
    assert not {part for part in parts if not part.startswith("_")} - {"version"}
