"""Reports of studies: a single file with all texts, tables and pictures."""

import base64
import html.parser
from pathlib import Path

from matplotlib.figure import Figure

from acausal import Table
from studies._output import save
from studies._report import write_report


class Tags(html.parser.HTMLParser):
    """Collects the elements of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.append(data)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def picture() -> Figure:
    figure = Figure()
    panel = figure.subplots()
    panel.set_title('of a "motor" & pump', loc="left")
    panel.set_xlabel("time [s]")
    panel.set_ylabel("pressure [bar]")
    return figure


def test_pictures_lie_in_the_page_and_are_said(tmp_path: Path) -> None:
    write_report(tmp_path, "page", "A page", [("Heading", "a < b", [picture()]), ("Shown", "", [picture()])], "About.")
    tags = Tags((tmp_path / "page.html").read_text()).found
    images = [attributes for tag, attributes in tags if tag == "img"]
    assert [image["alt"] for image in images] == [
        f'{heading}; of a "motor" & pump: pressure [bar] over time [s]' for heading in ("Heading", "Shown")
    ]
    assert all(str(image["src"]).startswith("data:image/png;base64,") for image in images)
    # The page loads nothing from elsewhere, and no box is empty.
    assert not [attributes for tag, attributes in tags if tag in ("script", "link") or "href" in attributes]
    assert sum(tag == "pre" for tag, _ in tags) == 1


def test_pictures_of_page_and_folder_are_the_same(tmp_path: Path) -> None:
    """They are drawn only once."""
    figure = picture()
    save(figure, tmp_path, "figure")
    figure.suptitle("too late")
    write_report(tmp_path, "page", "A page", [("Heading", "", [figure])])
    content = base64.b64encode((tmp_path / "figure.png").read_bytes()).decode()
    assert content in (tmp_path / "page.html").read_text()


def test_tables_are_those_of_the_page(tmp_path: Path) -> None:
    """There is a cell for each string; numbers are right-aligned, and other columns wrap."""
    numbers = Table(("part & size", "time [ms]", "why"), [("valve <a>", "-1.5e3", "x"), ("pump", "12 %", "-")], "Times")
    write_report(tmp_path, "page", "A page", [("Heading", ("before", numbers, Table(("empty",), [])), [])])
    page = Tags((tmp_path / "page.html").read_text())
    assert page.texts[page.texts.index("Times") : page.texts.index("empty")] == [
        "Times", "part & size", "time [ms]", "why", "valve <a>", "-1.5e3", "x", "pump", "12 %", "-",
    ]  # fmt: skip
    assert [attributes.get("class") for tag, attributes in page.found if tag == "td"] == [None, "number", None] * 2
    assert sum(tag == "table" for tag, _ in page.found) == 2
