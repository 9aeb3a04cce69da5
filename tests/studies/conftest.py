"""Shared fixtures: compiling takes longer than running."""

import json
from pathlib import Path
from typing import Any

import pytest

from studies.__main__ import main


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("studies")


def _tables(study: str, folder: Path) -> dict[str, list[dict[str, Any]]]:
    file = folder / "rows" / f"{study}.json"
    main([study, "--json", str(file), "--out", str(folder / "pictures")])
    return json.loads(file.read_text())


@pytest.fixture(scope="session")
def validated(folder: Path) -> list[dict[str, Any]]:
    """The rows that `validate` writes."""
    return _tables("validate", folder)["rows"]


@pytest.fixture(scope="session")
def optimised(folder: Path) -> list[dict[str, Any]]:
    """The rows that `optimise` writes."""
    return _tables("optimise", folder)["rows"]


@pytest.fixture(scope="session")
def held(folder: Path) -> dict[str, list[dict[str, Any]]]:
    """The tables that `hold` writes."""
    return _tables("hold", folder)
