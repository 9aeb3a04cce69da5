"""Symbols of all components."""

import importlib
import inspect
import sys
from typing import Any
from xml.etree import ElementTree

import pytest

from acausal import Component
from acausal._show.schematic.symbols import box, ports_of_class, symbol_of, symbol_svg

DOMAINS = ("blocks", "electrical", "hydraulic", "planar", "rotational", "thermal", "translational")
PACKAGES = {domain: importlib.import_module(f"components.{domain}") for domain in DOMAINS}
TABLES: dict[str, Any] = {
    domain: importlib.import_module(f"components.{domain}._symbols").SYMBOLS for domain in DOMAINS
}
CLASSES = [
    cls
    for package in PACKAGES.values()
    for cls in (getattr(package, name) for name in dir(package))
    if inspect.isclass(cls) and issubclass(cls, Component)
]
SEVERAL = {"StateMachine", "StateSpace", "WeightedSum"}  # numbers of ports that vary


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: f"{cls.__module__.split('.')[1]}.{cls.__name__}")
def test_symbol(cls: type) -> None:
    """Each class has a symbol of its own or of a base, with its ports and no others, as well-formed SVG."""
    symbol = symbol_of(cls)
    assert symbol.ports.keys() == ports_of_class(cls).keys()
    assert len(set(symbol.ports.values())) == len(symbol.ports)
    assert (symbol == box(cls.__name__, ports_of_class(cls))) == (cls.__name__ in SEVERAL)
    titles = [title.text for title in ElementTree.fromstring(symbol_svg(cls)).iter("{http://www.w3.org/2000/svg}title")]
    assert titles == [cls.__name__, *symbol.ports]


@pytest.mark.parametrize("domain", DOMAINS)
def test_symbols_belong_to_classes(domain: str) -> None:
    modules = [module for name, module in sys.modules.items() if name.startswith(f"components.{domain}.")]
    known = {name for module in modules for name, item in vars(module).items() if inspect.isclass(item)}
    assert not TABLES[domain].keys() - known
