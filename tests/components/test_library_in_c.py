"""Every equation, event and requirement of the library has a C form."""

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from _drive_examples import DRIVES
from _fluid_examples import FLUID
from _library import LIBRARY

from acausal import Component
from acausal._evaluate.events import events_of
from acausal._jax_private import ClosedJaxpr
from acausal._reduce.class_equations import required, templates
from acausal._reduce.flatten import flatten
from acausal.codegen.functions import CFunction, function_of
from acausal.codegen.values import Tables
from acausal.codegen.write import constants, helpers


def programs() -> Iterator[tuple[str, ClosedJaxpr]]:
    """The equations of each class with its static structure, and the events of each component, by name."""
    seen = set()
    for component in (*LIBRARY, *DRIVES, *FLUID):
        flat = flatten(component)
        for holder in flat.holders:
            kind, name = holder.kind, holder.kind.cls.__name__
            if (kind.cls, kind) in seen:
                continue
            seen.add((kind.cls, kind))
            yield f"{name}.requirements", required(kind).jaxpr
            if kind.cls.equations is not Component.equations:
                yield from ((f"{name}.{template.name}", template.jaxpr) for template in templates(kind))
        if events := events_of(flat, frozenset()):
            for function in (events.indicators, events.actions, events.times):
                yield f"{type(component).__name__}.events", function.closed


def in_c(number: int, name: str, closed: ClosedJaxpr, tables: Tables) -> CFunction:
    takes = [f"x{i}" for i in range(len(closed.in_avals))]
    gives = [f"y{i}" for i in range(len(closed.out_avals))]
    return function_of(f"f{number}", closed, takes, gives, tables, name, vectors=True)


@pytest.mark.slow
def test_the_library_in_c(tmp_path: Path) -> None:
    tables = Tables()
    texts = [in_c(i, name, closed, tables).text for i, (name, closed) in enumerate(programs())]
    assert len(texts) > 800
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no C compiler (cc or gcc) on this machine")
    body = "\n\n".join(texts)
    path = tmp_path / "library.c"
    path.write_text("\n\n".join(["#include <math.h>", *constants(tables), *helpers(body), body]))
    flags = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wno-unused-function", "-Werror", "-fsyntax-only")
    done = subprocess.run([compiler, *flags, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]
