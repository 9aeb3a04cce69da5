"""Models as compiled C code, called from Python."""

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acausal import Component
from acausal.codegen import export_c
from acausal.codegen.files import events_of, fields

COMPILER = shutil.which("cc") or shutil.which("gcc")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-ffp-contract=off")
TYPES: dict[str, Any] = {
    "double": ctypes.c_double,
    "int": ctypes.c_int,
    "long": ctypes.c_long,
    "const char *": ctypes.c_char_p,
}
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler (cc or gcc) on this machine")


def library(source: Path) -> ctypes.CDLL:
    """A C file as a library, compiled without a warning."""
    target = source.with_suffix(".so")
    command = [str(COMPILER), *STRICT, "-shared", "-fPIC", "-o", str(target), str(source), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    return ctypes.CDLL(str(target))


class Compiled:
    """An exported model; `struct` holds its numbers."""

    def __init__(self, model: Component, folder: Path, method: str = "implicit", step: float = 1e-3, **options: Any):
        self.model = export_c(model, folder, step=step, method=method, **options)
        self.library = library(folder / f"{self.model.name}.c")
        own = fields(self.model, events_of(self.model), has_matrix=method == "implicit" and self.model.n_states > 0)
        pairs = [(f.name, TYPES[f.type] * f.size if f.size is not None else TYPES[f.type]) for f in own]
        struct: Any = type("Struct", (ctypes.Structure,), {"_fields_": pairs})
        self.struct = struct()
        self.call("start")

    def call(self, name: str, *args: Any, gives: Any = ctypes.c_int) -> Any:
        function = self.library[f"{self.model.name}_{name}"]
        function.restype = gives
        return function(
            ctypes.byref(self.struct), *(ctypes.c_double(x) if isinstance(x, float) else _pointer(x) for x in args)
        )

    def array(self, name: str, size: int | None = None) -> np.ndarray:
        """A field of the struct, which can be changed in place."""
        return np.ctypeslib.as_array(getattr(self.struct, name))[:size]

    @property
    def x(self) -> np.ndarray:
        return self.array("x", self.model.n_states)

    @property
    def point(self) -> np.ndarray:
        """The states, guesses and discrete variables, as the functions of the engine read them."""
        n, m = len(self.model.start_guess), self.model.layout.n_discrete
        return np.concatenate([self.x, self.array("guess", n), self.array("d", m)])

    def vector(self, name: str, size: int, *args: Any) -> np.ndarray:
        """The vector that a function writes to its last argument."""
        found = np.zeros(max(size, 1))
        self.call(name, *args, found, gives=None)
        return found[:size]

    @property
    def outputs(self) -> dict[str, float]:
        values = self.vector("outputs", len(self.model.outputs))
        return {output.name: float(value) for output, value in zip(self.model.outputs, values, strict=True)}


def _pointer(array: np.ndarray) -> Any:
    return array.ctypes.data_as(ctypes.c_void_p)
