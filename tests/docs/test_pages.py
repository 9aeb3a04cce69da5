"""The pages: their code runs, and what they show is what it gives."""

import re
from pathlib import Path

import pytest

from docs._compare import ALIKE, first_difference, picture_difference
from docs._execute import DOCS, PAGES, PICTURES, ROOT, named, refreshed
from docs._studies import commands, studied
from studies.__main__ import STUDIES

NOTEBOOKS = tuple(sorted(DOCS.glob("*.ipynb")))
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


@pytest.mark.thorough
@pytest.mark.parametrize("page", PAGES, ids=named)
def test_page_shows_what_its_code_prints_and_draws(page: Path, tmp_path: Path) -> None:
    difference = first_difference(page.read_text(), refreshed(page, tmp_path))
    assert difference is None, f"{page.name} is out of date, run `python -m docs {named(page)}`.\n{difference}"
    for drawn in tmp_path.iterdir():
        difference = picture_difference((PICTURES / drawn.name).read_bytes(), drawn.read_bytes())
        assert difference < ALIKE, f"{drawn.name} is out of date, run `python -m docs {named(page)}`."


@pytest.mark.parametrize("page", [*PAGES, *NOTEBOOKS], ids=named)
def test_links(page: Path) -> None:
    for target in LINK.findall(page.read_text()):
        path, _, anchor = target.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), f"{page.name} links to {path}, which does not exist"
        assert not anchor or anchor in _anchors(file), f"{page.name} links to {target}, which has no such heading"


def _anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_index_lists_every_page() -> None:
    listed = set(LINK.findall((ROOT / "docs" / "index.md").read_text()))
    there = {path.name for path in (ROOT / "docs").glob("*") if path.suffix in (".md", ".ipynb")}
    assert there - {"index.md"} <= listed


def test_every_study_has_a_page_that_the_overview_lists() -> None:
    listed = set(LINK.findall((DOCS / "studies.md").read_text()))
    assert {f"studies/{study}.md" for study, *_ in STUDIES} <= listed


@pytest.mark.parametrize("study", [study for study, *_ in STUDIES])
def test_page_of_a_study_names_its_command(study: str) -> None:
    assert f"python -m studies {study} " in (DOCS / "studies" / f"{study}.md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=named)
def test_page_shows_what_its_commands_print(page: Path, tmp_path: Path) -> None:
    difference = first_difference(page.read_text(), studied(page, tmp_path), rtol=1e-3, atol=1e-6)
    assert difference is None, f"{named(page)} is out of date, run `python -m docs {named(page)}`.\n{difference}"
    for drawn in tmp_path.iterdir():
        difference = picture_difference((PICTURES / drawn.name).read_bytes(), drawn.read_bytes())
        assert difference < ALIKE, f"{drawn.name} is out of date, run `python -m docs {named(page)}`."


@pytest.mark.thorough
def test_readme_shows_the_shared_model() -> None:
    """The model in the README is the one of the other pages."""
    source = (ROOT / "docs" / "drive.py").read_text()
    assert source[source.index("class Drive") :].strip() in (ROOT / "README.md").read_text()
