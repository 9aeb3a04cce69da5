"""What the tests share, since compiling takes longer than running."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studies import actuators
from studies.__main__ import main

DESIGNS: dict[str, Callable[..., Any]] = {
    name: getattr(actuators, name) for name in ("sila", "ema_fise", "ema_maxon", "ehs_maxon")
}


@pytest.fixture(scope="session")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pictures")


@pytest.fixture(scope="session")
def run_study(pictures: Path) -> Callable[[str], list[dict[str, Any]]]:
    """The rows that a study writes."""

    def run(study: str) -> list[dict[str, Any]]:
        main([study, "--json", str(pictures / f"{study}.json"), "--out", str(pictures / "new" / "folder")])
        return json.loads((pictures / f"{study}.json").read_text())["rows"]

    return run
