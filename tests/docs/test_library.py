"""The pages of the library have a card for every component."""

import ast
import dataclasses
import functools as ft
import inspect
import re
from typing import Any

import pytest

from acausal import check
from components import hydraulic
from docs._exported import exported
from docs._fluid_power import NAMES, table
from docs._modelica import MODELICA
from docs._modelingtoolkit import MODELINGTOOLKIT
from docs._simscape import SIMSCAPE
from docs.site._cards import DOMAINS, cards
from docs.site._examples import examples
from docs.site._pages import Pages
from docs.site._programs import program
from docs.site._uses import uses

every_domain = pytest.mark.parametrize("domain", DOMAINS)


@ft.cache
def sections(domain: str) -> dict[str, str]:
    """The cards of a domain by the name of the component."""
    parts = re.split(r"^### (\w+)$", cards(domain, Pages(), {}), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@every_domain
def test_every_component_has_a_card_with_its_parameters_and_its_source(domain: str) -> None:
    found = sections(domain)
    assert found.keys() == {item.__name__ for item in exported(DOMAINS[domain])}
    for item in exported(DOMAINS[domain]):
        fields = {field.name: field.metadata.get("declaration") for field in dataclasses.fields(item)}
        for name in list(inspect.signature(item.__init__).parameters)[1:]:
            declaration = fields.get(name)
            if name not in fields or (declaration is not None and declaration.role == "param"):
                assert f"| `{name}` | " in found[item.__name__], f"{item.__name__}.{name} is not on its card"
        assert f"/{item.__module__.replace('.', '/')}" in found[item.__name__]


def test_a_card_shows_law_unit_range_energy_and_names_elsewhere() -> None:
    card = sections("electrical")["Resistor"]
    assert "<math" in card
    assert "<mi>v</mi><mo>=</mo><mi>R</mi>" in card
    assert "| `R` | ohm | nonnegative | resistance |" in card
    assert "| `p` | Pin | v in V, i in A |" in card
    assert '`dissipated` | W | <math><mi>R</mi><mspace width="0.15em"/><msup><mrow><mi>i</mi></mrow>' in card
    assert "MSL `Modelica.Electrical.Analog.Basic.Resistor`; ModelingToolkit `Electrical.Resistor`" in card


def test_equations_of_an_optional_port_say_so() -> None:
    card = sections("rotational")["IdealGear"]
    assert "<mtext>&#160;&#160;without support</mtext>" in card
    assert "<mtext>&#160;&#160;with support</mtext>" in card


def test_equations_define_the_methods_that_they_use() -> None:
    card = sections("hydraulic")["PilotReliefValve"]
    assert "<mi>excess</mi><mrow><mo>(</mo><mo>)</mo></mrow><mo>=</mo><mi>dp</mi><mo>−</mo><mi>pressure</mi>" in card


def test_equations_that_are_no_formulas_are_shown_as_code() -> None:
    card = sections("blocks")["WeightedSum"]
    assert "```python\ndef equations(self" in card
    assert "<math" not in card


def test_a_card_names_the_pages_that_use_the_component() -> None:
    pages = {"library/thermal.md": "Thermal", "drives.md": "Drives"}
    text = cards("thermal", Pages(), {("thermal", "HeatCapacitor"): pages})
    assert text.count("**Used in**: [the example above](#example), [Drives](../drives.md)\n") == 1
    assert "drives.md" in uses()["electrical", "BrushedMotor"]


def test_a_card_says_what_the_class_that_it_refers_to_says() -> None:
    assert "`SpringLoadedValve`: " in sections("hydraulic")["ReliefValve"]


@pytest.mark.parametrize("domain", MODELICA)
def test_names_of_other_libraries_belong_to_components(domain: str) -> None:
    here = {item.__name__ for item in exported(DOMAINS[domain])}
    assert MODELICA[domain].keys() | MODELINGTOOLKIT[domain].keys() | SIMSCAPE[domain].keys() <= here


def test_names_of_fluid_power_are_those_of_all_components() -> None:
    assert NAMES.keys() == {item.__name__ for item in exported(hydraulic)}
    lines = table(hydraulic).splitlines()
    assert any(line.split() == ["LoadSensingPump", "-", "PCLSPump", "-", "-"] for line in lines)
    assert "Jet Pump" in lines[-2]


@every_domain
def test_every_component_and_record_has_one_example(domain: str) -> None:
    found = examples(domain)
    assert found.keys() == {item.__name__ for item in exported(DOMAINS[domain])}
    for name, example in found.items():
        assert example.code.startswith(name)
        ast.parse(program(example))


def test_a_program_puts_a_component_between_partners_of_its_ports() -> None:
    code = program(examples("rotational")["IdealGear"])
    assert "from components.rotational import ConstantTorque, IdealGear, Inertia, ViscousFriction" in code
    assert "connect(self.rotor.b, self.part.a)," in code
    assert "connect(self.part.b, self.load.a)," in code
    assert "    part=IdealGear(ratio=20.0),\n" in code
    assert program(examples("rotational")["MeshLoss"]) == ""
    assert "part.u[2], self.signal_" in program(examples("blocks")["WeightedSum"])


@pytest.mark.slow
@every_domain
def test_programs_of_examples_are_models_without_errors(domain: str) -> None:
    for name, example in examples(domain).items():
        if code := program(example):
            values: dict[str, Any] = {"__name__": "docs_example"}
            exec(code.replace("solution = ", "run = lambda: "), values)
            assert not check(values["example"]).problems, name
