"""All pages of the site: those of docs/, notebooks, files at the top of the repository, and generated pages."""

from .._execute import DOCS, PICTURES, ROOT
from ._cards import DOMAINS, cards
from ._notebooks import rendered
from ._pages import PROJECT, Pages
from ._reference import GROUPS, reference
from ._uses import uses


def collected() -> Pages:
    """The pages of the site."""
    pages = Pages()
    for page in sorted(DOCS.rglob("*.md")):
        pages.add(page, page.read_text())
    for notebook in sorted(DOCS.glob("*.ipynb")):
        text, pictures = rendered(notebook)
        pages.files |= {f"pictures/{name}": picture for name, picture in pictures.items()}
        pages.add(notebook, text)
    for name in PROJECT:
        pages.add(ROOT / name, _project(name))
    for domain in DOMAINS:
        pages.texts[f"library/{domain}.md"] += cards(domain, pages, uses())
    for module in GROUPS:
        pages.texts[f"reference/{module}.md"] += reference(module, pages)
    pages.files |= {f"pictures/{picture.name}": picture.read_bytes() for picture in PICTURES.iterdir()}
    pages.files["site.css"] = (DOCS / "site" / "site.css").read_bytes()
    pages.add_sources()
    return pages


def _project(name: str) -> str:
    """A file at the top of the repository as Markdown."""
    text = (ROOT / name).read_text()
    if name == "CITATION.cff":
        return (
            f"# Citation\n\nTo cite the software, use the entries of its file `CITATION.cff`.\n\n```yaml\n{text}```\n"
        )
    return f"# Licence\n\n```text\n{text}```\n" if name == "LICENSE" else text
