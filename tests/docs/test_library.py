"""The page of the library shows all of it."""

import dataclasses
import inspect
import types

import pytest

from components import blocks, electrical, hydraulic, rotational, thermal, translational
from docs._execute import DOCS
from docs._fluid_power import NAMES, table
from docs._modelica import MODELICA
from docs._modelingtoolkit import MODELINGTOOLKIT
from docs.library import exported, listing

PACKAGES = (blocks, electrical, hydraulic, rotational, thermal, translational)
page = pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)


@page
def test_every_exported_component_is_on_the_page(package: types.ModuleType) -> None:
    names = {line.split()[0] for line in (DOCS / "library.md").read_text().splitlines() if line[:1].isupper()}
    assert {item.__name__ for item in exported(package)} <= names


@page
def test_every_parameter_is_listed_with_its_unit(package: types.ModuleType) -> None:
    """Whether it is a field, or an argument of a constructor of its own."""
    entries = {entry.split()[0]: entry.splitlines()[1:] for entry in listing(package).split("\n\n")}
    for item in exported(package):
        shown = {line.split()[0]: line.split(maxsplit=1)[1] for line in entries[item.__name__]}
        fields = {field.name: field.metadata.get("declaration") for field in dataclasses.fields(item)}
        for name in list(inspect.signature(item.__init__).parameters)[1:]:
            declaration = fields.get(name)
            if name not in fields or (declaration is not None and declaration.role == "param"):
                assert shown.get(name), f"{item.__name__}.{name} is not listed with its unit"


def test_entries_read_as_they_should() -> None:
    electric = listing(electrical)
    assert "Resistor                      Basic.Resistor                          Ohm's law" in electric
    assert "\n    R                         ohm                                     winding resistance\n" in electric
    assert "\n    L                         H, optional                             inductance" in electric
    assert "\n    ports                     p: Pin, n: Pin, shaft: Flange, support: Flange (optional)" in electric
    assert "\n    parts                     profile: CamProfile" in listing(rotational)
    assert (
        "\n    frequency                 Hz                                      frequency (MSL f, freqHz)\n"
        in listing(blocks)
    )


@pytest.mark.parametrize("domain", MODELICA)
def test_names_of_other_libraries_belong_to_components(domain: str) -> None:
    packages = {package.__name__.rpartition(".")[2]: package for package in PACKAGES}
    here = {item.__name__ for item in exported(packages[domain])}
    assert MODELICA[domain].keys() | MODELINGTOOLKIT[domain].keys() <= here


def test_names_of_fluid_power_are_those_of_all_components() -> None:
    assert NAMES.keys() == {item.__name__ for item in exported(hydraulic)}
    lines = table(hydraulic).splitlines()
    assert any(line.split() == ["LoadSensingPump", "-", "PCLSPump", "-", "-"] for line in lines)
    assert "Jet Pump" in lines[-2]
