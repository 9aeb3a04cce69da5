"""The pages of the documentation site, before Zensical builds them, and the check of its links."""

import ast
import re
import types
from pathlib import Path

import nbformat
import pytest

import acausal
from acausal import codegen, design, fmi, modelica, testing
from docs._execute import DOCS, ROOT
from docs.site._collect import collected
from docs.site._links import dead_links
from docs.site._mathml import Unreadable, formula
from docs.site._notebooks import rendered
from docs.site._pages import Pages, SiteError
from docs.site._reference import GROUPS, public


@pytest.fixture(scope="module")
def pages() -> Pages:
    return collected()


def test_every_page_and_notebook_is_part_of_the_site(pages: Pages) -> None:
    here = {path.relative_to(DOCS).with_suffix(".md").as_posix() for path in DOCS.rglob("*.md")}
    here |= {f"{path.stem}.md" for path in DOCS.glob("*.ipynb")}
    assert here | {"project/readme.md", "project/changelog.md", "project/citation.md"} <= pages.texts.keys()


def test_the_navigation_names_existing_pages_and_leaves_out_sources_only(pages: Pages) -> None:
    named = set(re.findall(r"[\w/]+\.md", (ROOT / "mkdocs.yml").read_text().partition("\nnav:")[2]))
    assert named <= pages.texts.keys()
    assert {path for path in pages.texts if not path.startswith("source/")} <= named


@pytest.mark.parametrize("module", [acausal, codegen, design, fmi, modelica, testing])
def test_every_public_name_has_an_entry(pages: Pages, module: types.ModuleType) -> None:
    text = pages.texts[f"reference/{module.__name__.rpartition('.')[2]}.md"]
    for name in public(module):
        assert text.count(f"### {name} {{ #{module.__name__}.{name} }}") == 1
    assert set(getattr(module, "__all__", ())) <= set(public(module))


def test_an_entry_has_signature_docstring_and_methods(pages: Pages) -> None:
    text = pages.texts["reference/acausal.md"]
    assert "simulate(\n    model: M,\n    t1: ArrayLike,\n    *,\n    t0: ArrayLike = 0.0," in text
    assert "- `until(s)`: a real function of the variables" in text
    assert "#### plot { #acausal.Solution.plot }" in text
    assert "### positive { #acausal.positive }\n\nOptions of an annotation: the admissible range.\n" in text
    assert "tree_flatten" not in text
    assert "states_requirements" not in text
    assert "studies" in GROUPS
    assert "### opening_time { #studies.opening_time }" in pages.texts["reference/studies.md"]


def test_links_to_files_of_the_repository_become_links_of_the_site(tmp_path: Path) -> None:
    pages = Pages()
    text = (
        "[a](../README.md#try-it) [b](first_model.ipynb) [c](drive.py) [d](#x)\n\n```python raises\nf[0](README)\n```\n"
    )
    pages.add(DOCS / "events.md", text)
    assert pages.texts["events.md"] == (
        "[a](project/readme.md#try-it) [b](first_model.md) [c](source/docs/drive.md) [d](#x)\n\n"
        "```python\nf[0](README)\n```\n"
    )
    pages.add_sources()
    assert "class Drive" in pages.texts["source/docs/drive.md"]
    with pytest.raises(SiteError, match=r"docs/events\.md links to none\.md, which does not exist"):
        pages.add(DOCS / "events.md", "[a](none.md)")
    with pytest.raises(SiteError, match=r"Makefile is not part of the site"):
        pages.add(DOCS / "events.md", "[a](../Makefile)")


def test_pages_that_are_gone_are_removed(tmp_path: Path) -> None:
    Pages({"a.md": "a", "b/c.md": "c"}).write(tmp_path)
    Pages({"a.md": "new"}).write(tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.rglob("*.md")} == {"a.md": "new"}


def test_a_notebook_shows_text_code_and_outputs(tmp_path: Path) -> None:
    output = nbformat.v4.new_output
    code = nbformat.v4.new_code_cell(
        "print(1)",
        outputs=[output("stream", text="1\n"), output("display_data", {"image/png": "aGk=", "text/plain": "<Figure>"})],
    )
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell("# Title"), code])
    nbformat.write(notebook, tmp_path / "n.ipynb")
    text, pictures = rendered(tmp_path / "n.ipynb")
    assert text == (
        "# Title\n\n```python\nprint(1)\n```\n\n```text\n1\n```\n\n![Output of the code above](pictures/n_1.png)\n"
    )
    assert pictures == {"n_1.png": b"hi"}


def test_dead_links_anchors_and_pictures_are_found(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "c.html").write_text('<h1 id="here"></h1><a href="../a.html">good</a>')
    links = ["b/c.html#here", "b/c.html", "#own", "https://example.org/x"]
    dead = ["b/c.html#there", "b/d.html", "#none"]
    body = "".join(f'<a href="{target}"></a>' for target in links + dead)
    (tmp_path / "a.html").write_text(f'<p id="own"></p>{body}<img src="none.png">')
    assert list(dead_links(tmp_path)) == [
        "a.html refers to b/c.html#there, which has no such anchor.",
        "a.html refers to b/d.html, which does not exist.",
        "a.html refers to #none, which has no such anchor.",
        "a.html refers to none.png, which does not exist.",
    ]


@pytest.mark.parametrize(
    ("code", "shown"),
    [
        ("d.w", "<mover><mi>w</mi><mo>˙</mo></mover>"),
        ("self.a.tau", "<msub><mi>τ</mi><mtext>a</mtext></msub>"),
        ("-(a + b)", "<mo>−</mo><mrow><mo>(</mo><mi>a</mi><mo>+</mo><mi>b</mi><mo>)</mo></mrow>"),
        ("a - (b - c)", "<mi>a</mi><mo>−</mo><mrow><mo>(</mo><mi>b</mi><mo>−</mo><mi>c</mi><mo>)</mo></mrow>"),
        ("jnp.sqrt(1e-3)", "<msqrt><mn>0.001</mn></msqrt>"),
        ("mass * b", "<mi>mass</mi><mo>⋅</mo><mi>b</mi>"),
        ("a**2 / 2e6", "<mfrac><mrow><msup><mrow><mi>a</mi></mrow><mrow><mn>2</mn></mrow></msup></mrow><mrow><mn>2</mn>"
         "<mo>⋅</mo><msup><mn>10</mn><mn>6</mn></msup></mrow></mfrac>"),
    ],
)  # fmt: skip
def test_formulas(code: str, shown: str) -> None:
    assert formula(ast.parse(code, mode="eval").body, "d") == shown


def test_code_that_is_no_formula_is_refused() -> None:
    with pytest.raises(Unreadable):
        formula(ast.parse("[x for x in y]", mode="eval").body, "d")
