"""The wheel holds the files that are needed and nothing else, and an installed copy runs the first model."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("acausal", "components", "studies")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """Built from a copy, since a build leaves folders beside its sources."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in (*PACKAGES, "tests", "docs", "benchmarks"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*build, "--wheel-dir", out, source], check=True, capture_output=True)
    (path,) = out.iterdir()
    return zipfile.ZipFile(path)


@pytest.mark.thorough
def test_wheel_holds_the_packages_with_their_data_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    suffixes = (".py", ".c", ".csv", ".json", "py.typed")
    there = {
        path.relative_to(ROOT).as_posix()
        for name in PACKAGES
        for path in (ROOT / name).rglob("*")
        if path.name.endswith(suffixes)
    }
    assert held == there
    assert {"acausal/py.typed", "components/py.typed"} <= held


def test_wheel_tells_its_licence_and_extras(wheel: zipfile.ZipFile) -> None:
    (metadata,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    text = wheel.read(metadata).decode()
    assert "\nLicense-Expression: Apache-2.0\n" in text
    assert any(name.endswith("/LICENSE") for name in wheel.namelist())
    assert {"tables", "plots", "control", "bench"} <= set(re.findall(r"^Provides-Extra: (.*)$", text, re.MULTILINE))


@pytest.mark.thorough
def test_first_model_runs_from_the_wheel(wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    """The first block of the README, in a process that sees the wheel, not the sources."""
    wheel.extractall(tmp_path)
    code, expected = re.findall(r"```(?:python|text)\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[:2]
    shown = "\nimport acausal, components; print(acausal.__file__, components.__file__, sep='\\n')"
    env = os.environ | {"PYTHONPATH": str(tmp_path), "ACAUSAL_PROGRESS": "off"}
    done = subprocess.run(
        [sys.executable, "-c", code + shown], check=True, capture_output=True, text=True, cwd=tmp_path, env=env
    )
    printed, *files = done.stdout.splitlines()
    assert printed == expected.strip()
    assert all(Path(file).is_relative_to(tmp_path) for file in files)


def test_citation_and_changelog_tell_the_version() -> None:
    found = re.search(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert found is not None
    assert f"\nversion: {found[1]}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {found[1]}" in (ROOT / "CHANGELOG.md").read_text()
