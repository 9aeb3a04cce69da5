"""Cards of the components of the library: a section of Markdown for each class, by family."""

import functools as ft
import inspect
import re
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from acausal import Component, Record
from acausal._declare.class_card import Row, card_of, own_text
from acausal._show.schematic.symbols import DARK, symbol_svg
from components import blocks, electrical, hydraulic, planar, rotational, thermal, translational

from .._execute import ROOT
from .._exported import exported
from .._fluid_power import HEADS, NAMES
from .._modelica import MODELICA
from .._modelica import PACKAGES as MODELICA_PACKAGES
from .._modelingtoolkit import MODELINGTOOLKIT, MODULES
from ._examples import Example, examples
from ._formulas import expression, law
from ._pages import Pages, SiteError
from ._programs import program
from ._tables import table

DOMAINS = {
    package.__name__.rpartition(".")[2]: package
    for package in (blocks, electrical, rotational, translational, planar, hydraulic, thermal)
}
_COLUMNS = {
    "Parameters": ("Name", "Unit", "Range", "Default", "Meaning"),
    "Options": ("Name", "Type", "Range", "Default", "Meaning"),
    "Parts": ("Name", "Class", "Variables", "", "Meaning"),
    "Ports": ("Name", "Class", "Variables", "", "Meaning"),
    "Variables": ("Name", "Unit", "Range", "Start", "Meaning"),
    "Energy": ("Term", "Unit", "", "", "Expression"),
}
_CODE = re.compile(r"`(\w+)`")


def cards(domain: str, pages: Pages, uses: Mapping[tuple[str, str], Mapping[str, str]]) -> str:
    """The cards of a domain by family, after a list of them; `uses` are the pages that use a class."""
    families = _families(DOMAINS[domain])
    lines = ["\n## All components\n"]
    for family, members in families.items():
        links = ", ".join(f"[{cls.__name__}](#{cls.__name__.lower()})" for cls in members)
        lines.append(f"- {family}: {links}")
    for family, members in families.items():
        lines.append(f"\n## {family}")
        for cls in members:
            lines += [*_card(cls, domain, pages), *_used(uses.get((domain, cls.__name__), {}), domain)]
    return "\n".join(lines) + "\n"


def _families(package: types.ModuleType) -> dict[str, list[type]]:
    """The classes of a package by the module that declares them, whose docstring is the name of the family."""
    found: dict[str, list[type]] = {}
    for cls in sorted(exported(package), key=lambda cls: (cls.__module__, _place(cls)[1])):
        title = (inspect.getdoc(inspect.getmodule(cls)) or "").split("\n")[0]
        found.setdefault(re.split(r"[.:] |\.$| \(as |, which | See ", title)[0], []).append(cls)
    return found


def _card(cls: type, domain: str, pages: Pages) -> Iterator[str]:
    example = examples(domain).get(cls.__name__)
    if example is None:
        raise SiteError(f"{domain}.{cls.__name__} has no example. Add one to docs/site/examples/{domain}.py.")
    card = card_of(cls)
    yield f"\n### {card.name}\n\n{_symbol(cls)}\n"
    for text in (card.text, *_said_by_bases(cls, card.text)):
        yield f"{_linked(text, card.name, domain)}\n"
    yield from law(cls)
    for heading, rows in card.tables.items():
        if len(rows) == 1 and not any(rows[0][1:]):
            yield f"\n**{heading}**: {rows[0].name}.\n"
        else:
            if heading == "Energy":
                rows = [row._replace(meaning=row.meaning and expression(row.meaning)) for row in rows]
            yield f"\n**{heading}**\n\n{table(_COLUMNS[heading], [_row(row) for row in rows])}"
    if names := "; ".join(_elsewhere(cls.__name__, domain)):
        yield f"\n**In other libraries**: {names}\n"
    yield from _example(example)
    file, line = _place(cls)
    yield f"\n**Source**: [{file}]({pages.source(file, line, f'library/{domain}.md')})\n"


def _example(example: Example) -> Iterator[str]:
    """The instance, and the program that runs it, folded."""
    yield f"\n**Example**\n\n```python\n{example.code}\n```\n"
    if code := program(example):
        yield '<details class="program" markdown="1">\n<summary>In a circuit</summary>\n'
        yield f"```python\n{code}\n```\n\n</details>\n"


def _said_by_bases(cls: type, text: str) -> Iterator[str]:
    """The texts of partial classes that a docstring refers to; they have no cards."""
    for base in cls.__mro__[1:]:
        if f"`{base.__name__}`" in text and vars(base).get("_partial") and issubclass(base, Component | Record):
            yield f"`{base.__name__}`: {own_text(base)}"


def _symbol(cls: type) -> str:
    """The symbol of a component, in the colour of the text."""
    if not issubclass(cls, Component):
        return ""
    return f'<div class="symbol" data-search-exclude>{symbol_svg(cls).replace(DARK, "currentColor")}</div>'


def _row(row: Row) -> tuple[str, ...]:
    return f"`{row.name}`", row.kind, row.range, row.default.removeprefix("= "), row.meaning


def _elsewhere(name: str, domain: str) -> Iterator[str]:
    """Names of components with the same purpose in other libraries."""
    if domain == "hydraulic":
        known = zip(HEADS[1:], NAMES[name], strict=True)
        yield from (f"{library} `{there}`" for library, there in known if there != "-")
        return
    if there := MODELICA[domain].get(name):
        yield f"MSL `{MODELICA_PACKAGES[domain]}.{there}`"
    if there := MODELINGTOOLKIT[domain].get(name):
        yield f"ModelingToolkit `{MODULES[domain]}.{there}`"


def _used(pages: Mapping[str, str], domain: str) -> Iterator[str]:
    own = f"library/{domain}.md"
    links = ["[the example above](#example)"] * (own in pages)
    links += [f"[{title}](../{path})" for path, title in pages.items() if path != own]
    if links:
        yield f"\n**Used in**: {', '.join(links)}\n"


def _linked(text: str, own: str, domain: str) -> str:
    """A docstring with links to the other classes of the library that it names, first to those of its domain."""

    def link(match: re.Match[str]) -> str:
        places = [place for place in (domain, *DOMAINS) if match[1] in _names(place) and match[1] != own]
        return f"[{match[0]}]({places[0]}.md#{match[1].lower()})" if places else match[0]

    return _CODE.sub(link, text)


@ft.cache
def _names(domain: str) -> set[str]:
    return {cls.__name__ for cls in exported(DOMAINS[domain])}


@ft.cache
def _place(cls: Any) -> tuple[str, int]:
    """The file of a class, and its first line there."""
    file = Path(inspect.getsourcefile(cls) or "").relative_to(ROOT).as_posix()
    return file, inspect.getsourcelines(cls)[1]
