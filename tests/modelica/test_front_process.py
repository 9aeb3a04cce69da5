"""The front end runs in a process of its own: a text that ends it ends nothing else."""

import os
from pathlib import Path

import pytest

from acausal.modelica import ModelicaError, load
from acausal.modelica._front import session

pytest.importorskip("rumoca")

GOOD = "model Good\n  Real x(start = {start}, fixed = true);\nequation\n  der(x) = -x;\nend Good;\n"
DEEP = "model Deep\n  Real x = " + 100_000 * "(" + "1" + 100_000 * ")" + ";\nend Deep;\n"


def test_a_text_that_ends_the_front_end_is_refused_and_others_are_read(tmp_path: Path) -> None:
    file = tmp_path / "Deep.mo"
    file.write_text(DEEP)
    with pytest.raises(ModelicaError, match=r"Deep\.mo: the process of the front end ended while it read Deep \(") as e:
        load(file, "Deep")
    assert "Segmentation" in str(e.value) or "Aborted" in str(e.value)
    assert load(GOOD.format(start=3.0), "Good").x == 3.0


def test_one_process_reads_all_models() -> None:
    assert session.errors("model A end A;", "a.mo") == []
    worker = session._workers[os.getpid()]
    for start in (4.0, 5.0):
        assert load(GOOD.format(start=start), "Good").x == start
    assert session._workers[os.getpid()] is worker


def test_a_library_model_that_ends_the_front_end_is_named_with_its_file(tmp_path: Path) -> None:
    package = tmp_path / "Lib"
    package.mkdir()
    (package / "package.mo").write_text("package Lib\nend Lib;\n")
    (package / "Deep.mo").write_text("within Lib;\n" + DEEP)
    with pytest.raises(ModelicaError, match=r"Lib.Deep\.mo: .* ended while it read Lib\.Deep"):
        load("", "Lib.Deep", roots=tmp_path)
