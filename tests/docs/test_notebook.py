"""The notebooks run, and their committed outputs are those of their code."""

import base64
from pathlib import Path
from typing import Any

import nbformat
import pytest

from docs._compare import ALIKE, first_difference, picture_difference
from docs._execute import DOCS
from docs._notebook import executed

NOTEBOOKS = sorted(DOCS.glob("*.ipynb"))


def printed(notebook: Any) -> str:
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output.text for output in outputs if output.output_type == "stream")


def pictures(notebook: Any) -> list[bytes]:
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    drawn = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    return [base64.b64decode(picture) for picture in drawn]


@pytest.mark.thorough
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebook(path: Path) -> None:
    committed = nbformat.read(path, as_version=4)
    fresh = executed(path, compile_fast=True)
    difference = first_difference(printed(committed), printed(fresh))
    assert difference is None, f"{path.name} is out of date, run `python -m docs {path.name}`.\n{difference}"
    assert len(pictures(committed)) == len(pictures(fresh)) > 0
    for number, pair in enumerate(zip(pictures(committed), pictures(fresh), strict=True), start=1):
        assert picture_difference(*pair) < ALIKE, f"Picture {number} of {path.name} is out of date."
