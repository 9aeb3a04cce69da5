"""Pages of the site as Markdown, by their path in the folder that Zensical reads."""

import dataclasses
import os
import posixpath
import re
from pathlib import Path

from .._execute import DOCS, ROOT

# Files at the top of the repository, as pages of the site.
PROJECT = {
    "README.md": "project/readme.md",
    "CHANGELOG.md": "project/changelog.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "CITATION.cff": "project/citation.md",
    "LICENSE": "project/licence.md",
}
_LINK = re.compile(r"(?P<code>^```.*?^```)|\]\((?P<path>[^)#\s]+)(?P<anchor>#[^)\s]*)?\)", re.DOTALL | re.MULTILINE)
_WORDS = re.compile(r"^```python .*$", re.MULTILINE)  # options of executed blocks
_HIDDEN = "---\nsearch:\n  exclude: true\nhide:\n  - navigation\n---\n\n"


class SiteError(Exception):
    """Raised if a page of the site cannot be made."""


@dataclasses.dataclass
class Pages:
    """Texts and files of the site by path; `sources` are the Python files of the repository that pages link to."""

    texts: dict[str, str] = dataclasses.field(default_factory=dict)
    files: dict[str, bytes] = dataclasses.field(default_factory=dict)
    sources: set[str] = dataclasses.field(default_factory=set)

    def add(self, source: Path, text: str) -> None:
        """A page whose text stands in a file of the repository, with links as on the site."""
        here = source.relative_to(ROOT).as_posix()

        def link(match: re.Match[str]) -> str:
            path = match["path"]
            if match["code"] or ":" in path:
                return match[0]
            target = posixpath.normpath(posixpath.join(posixpath.dirname(here), path))
            if not (ROOT / target).exists() and path_of(target) not in self.files:
                raise SiteError(f"{here} links to {path}, which does not exist.")
            return f"]({self._relative(target, path_of(here))}{match['anchor'] or ''})"

        self.texts[path_of(here)] = _WORDS.sub("```python", _LINK.sub(link, text))

    def source(self, file: str, line: int, page: str) -> str:
        """The link from a page to a line of a Python file of the repository."""
        return f"{self._relative(file, page)}#__codelineno-0-{line}"

    def _relative(self, target: str, page: str) -> str:
        if target.endswith(".py"):
            self.sources.add(target)
        return posixpath.relpath(path_of(target), posixpath.dirname(page) or ".")

    def add_sources(self) -> None:
        """A page for each Python file that others link to. The search leaves it out."""
        for file in sorted(self.sources):
            code = (ROOT / file).read_text()
            self.texts[path_of(file)] = f'{_HIDDEN}# `{file}`\n\n```` {{.python linenums="1"}}\n{code}````\n'

    def write(self, folder: Path) -> None:
        """Writes what has changed, and removes files that are no longer part of the site."""
        contents = self.files | {path: text.encode() for path, text in self.texts.items()}
        for path, content in contents.items():
            file = folder / path
            file.parent.mkdir(parents=True, exist_ok=True)
            if not file.exists() or file.read_bytes() != content:
                file.write_bytes(content)
        for base, _, names in os.walk(folder):
            for file in (Path(base, name) for name in names):
                if file.relative_to(folder).as_posix() not in contents:
                    file.unlink()


def path_of(file: str) -> str:
    """The path on the site of a file of the repository."""
    if file in PROJECT:
        return PROJECT[file]
    path = Path(file)
    if path.suffix == ".py":
        return f"source/{path.with_suffix('.md')}"
    if not (ROOT / path).is_relative_to(DOCS):
        raise SiteError(f"{file} is not part of the site. Add it to `PROJECT` in docs/site/_pages.py.")
    inside = path.relative_to("docs")
    return (inside.with_suffix(".md") if path.suffix == ".ipynb" else inside).as_posix()
