"""Models, solutions and parameters as trees and tables with units; pictures of variables and of several runs."""

import html.parser
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from _models import RC, rc

from acausal import Component, ModelError, Solution, UnitError, compare, parameters, repeat, replace, simulate
from acausal._units.parsing import quotient
from components.rotational import Inertia
from components.translational import Mass

TIMES = np.linspace(0.0, 0.1, 5)


@pytest.fixture(scope="module")
def charge() -> Solution[RC]:
    return simulate(rc(), 0.1, save=TIMES)


def test_model_as_a_tree() -> None:
    model = replace(rc(R=100.0), {"c.v": 1.5})
    lines = str(model).splitlines()
    assert lines[0] == "RC"
    assert "  r: Resistor" in lines
    assert lines[lines.index("  r: Resistor") + 1] == "    R = 100 ohm"
    assert "    v = 1.5 V" in lines  # the start value that is given, and no other
    assert sum(" v = " in line for line in lines) == 1


@pytest.mark.parametrize(
    ("model", "line"),
    [
        (repeat(Inertia(J=jnp.linspace(1.0, 2.0, 5)), 5), "  J = 5 values from 1 to 2 kg.m2"),
        (repeat(Inertia(J=jnp.full(5, 3.0)), 5), "  J = 5 values of 3 kg.m2"),
        (repeat(Inertia(J=jnp.array([1.0, 2.0])), 2), "  J = [1, 2] kg.m2"),
    ],
)
def test_arrays_in_a_tree(model: Any, line: str) -> None:
    lines = str(model).splitlines()
    assert lines[0] == f"{model.n} × Inertia"
    assert line in lines


def test_traced_values_in_a_tree() -> None:
    seen: list[str] = []
    jax.jit(lambda model: seen.append(str(model)))(Mass(m=1.0))
    assert seen == ["Mass\n  m = traced kg"]


def test_long_trees_are_cut() -> None:
    lines = str(_Many(parts=tuple(Inertia(J=1.0) for _ in range(200)))).splitlines()
    assert len(lines) == 201
    assert lines[-1] == "... and 201 more lines: print a part of it"


class _Many(Component):
    parts: tuple[Inertia, ...]


@pytest.mark.thorough
def test_solution_as_a_tree(charge: Solution[RC]) -> None:
    lines = str(charge).splitlines()
    assert lines[:3] == ["Solution of RC: 5 saved times, t1 = 0.1 s. The end time was reached.", "At the end:", "RC"]
    assert f"    v = {charge.final.c.v:.6g} V" in lines
    assert "    R = 100 ohm" in lines
    batch = jax.vmap(lambda R: simulate(rc(R=R), 0.1, save=TIMES))(jnp.array([50.0, 100.0]))
    assert str(batch) == repr(batch) == "<Solution of RC: t1 of shape (2,)>"


class _Balanced(html.parser.HTMLParser):
    """Raises where a tag is closed that is not open."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize(
    "shown",
    [lambda sol: rc(), lambda sol: sol, lambda sol: parameters(rc()), lambda sol: replace(rc(), {"c.v": 1.5})],
    ids=["model", "solution", "parameters", "model with a start value"],
)
def test_notebooks_get_tables_that_are_closed(shown: Callable[[Any], Any], charge: Solution[RC]) -> None:
    text = shown(charge)._repr_html_()
    parser = _Balanced()
    parser.feed(text)
    assert not parser.open
    assert "100 ohm" in text


def test_names_and_units_of_a_solution(charge: Solution[RC]) -> None:
    assert charge._ipython_key_completions_() == charge.keys()
    assert {"c.v", "r.R", "r.p.i"} <= set(charge.keys())
    assert "c.v" in charge
    assert "c.x" not in charge
    assert (charge.unit("c.v"), charge.unit("r.R")) == ("V", "ohm")
    with pytest.raises(ModelError, match=r"no variable or parameter 'c.u'. Did you mean c\."):
        charge.unit("c.u")


@pytest.mark.thorough
def test_parameters_and_sensitivities_with_units() -> None:
    gradient = eqx.filter_grad(lambda model: simulate(model, 0.1, save="end").final.c.v)(rc())
    found = parameters(gradient, of="V")
    assert found.units["r.R"] == "V/ohm"
    assert found["r.R"] == gradient.r.R
    assert f"r.R       {gradient.r.R:.6g} V/ohm" in str(found)
    doubled = jax.tree_util.tree_map(lambda x: 2.0 * x, parameters(rc(R=100.0)))
    assert doubled["r.R"] == 200.0
    assert "r.R       200 ohm" in str(doubled)
    with pytest.raises(UnitError, match="of: the unit 'Volts' is not known"):
        parameters(gradient, of="Volts")


@pytest.mark.parametrize(
    ("above", "below", "unit"),
    [
        ("s", "ohm", "s/ohm"),
        ("s", "N.m/A", "s.A/(N.m)"),
        ("N.m", "N.m.s/rad", "rad/s"),
        ("s", "m3/(s.Pa0.5)", "s.s.Pa0.5/m3"),
        ("1", "K", "1/K"),
        ("Pa", "1", "Pa"),
        ("m", "m", "1"),
    ],
)
def test_quotients_of_units(above: str, below: str, unit: str) -> None:
    assert quotient(above, below) == unit


ITEMS: list[tuple[Any, str, str, Callable[[Solution], Any]]] = [
    ("c.v", "c.v", "V", lambda sol: sol["c.v"]),
    ("r.R", "r.R", "ohm", lambda sol: np.full(5, 100.0)),
    ({"u": "c.v"}, "u", "V", lambda sol: sol["c.v"]),
    ({"heat": lambda s: s.r.v * s.r.i}, "heat", "W", lambda sol: sol["r.v"] * sol["r.i"]),
    ({"sum": lambda s: s.r.v + s.c.v}, "sum", "V", lambda sol: sol["r.v"] + sol["c.v"]),
    ({"law": lambda s: jnp.exp(s.c.v)}, "law", "", lambda sol: np.exp(sol["c.v"])),
    ({"one": lambda s: 1.0}, "one", "1", lambda sol: np.ones(5)),
    ({"root": lambda s: jnp.sqrt(s.c.v)}, "root", "kg^(1/2).m/(s^(3/2).A^(1/2))", lambda sol: np.sqrt(sol["c.v"])),
]


@pytest.mark.parametrize(("item", "label", "unit", "values"), ITEMS, ids=[label for _, label, _, _ in ITEMS])
def test_columns_of_variables_and_expressions(
    item: Any, label: str, unit: str, values: Callable[[Solution], Any], charge: Solution[RC]
) -> None:
    frame = charge.to_pandas(item, units=["rpm"])
    assert frame.attrs["units"] == {"t": "s", label: unit}
    np.testing.assert_allclose(frame[label], values(charge), rtol=1e-12)


def test_columns_in_other_units(charge: Solution[RC]) -> None:
    data = charge.to_xarray("c.v", {"heat": lambda s: s.r.v * s.r.i}, units=["mV", "kW"])
    assert [data[name].attrs["units"] for name in ("c.v", "heat", "t")] == ["mV", "kW", "s"]
    np.testing.assert_allclose(data["c.v"], 1e3 * charge["c.v"], rtol=1e-12)
    np.testing.assert_allclose(data["heat"], 1e-3 * charge["r.v"] * charge["r.i"], rtol=1e-12)


BAD: list[tuple[Any, Any, str]] = [
    ("c.u", (), "no variable or parameter 'c.u'"),
    ("c.v", ["voltz"], "units: the unit 'voltz' is not known"),
    ("c.v", "mV", r"pass a list of units, as in units=\['mV'\]"),
    ({"both": lambda s: (s.c.v, s.r.v)}, (), "An expression must be one real number, but this one returned 2"),
    ({"true": lambda s: s.c.v > 1.0}, (), "returned a truth value: return a real number"),
    ({"wrong": lambda s: s.c.u}, (), "An expression: .*no port, part, parameter or variable 'u'"),
]


@pytest.mark.parametrize(("item", "units", "message"), BAD)
def test_what_cannot_be_drawn_is_said(item: Any, units: Any, message: str, charge: Solution[RC]) -> None:
    with pytest.raises(ModelError, match=message):
        charge.plot(item, units=units)


@pytest.mark.parametrize("take", [Solution.plot, Solution.to_pandas, Solution.to_xarray])
def test_two_columns_of_one_name_need_labels(take: Callable[..., Any], charge: Solution[RC]) -> None:
    """Else the second one would take the place of the first in a table."""
    with pytest.raises(ModelError, match="two columns 'expression': label them"):
        take(charge, lambda s: s.c.v, lambda s: s.r.v)
    with pytest.raises(ModelError, match=r"two columns 'c\.v'"):
        take(charge, "c.v", {"c.v": "r.v"})


def test_panels_by_unit(charge: Solution[RC]) -> None:
    axes = charge.plot("c.v", {"over the resistor": "r.v"}, "r.i", units=["mA"])
    assert [ax.get_ylabel() for ax in axes] == ["[V]", "[mA]"]
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["c.v", "over the resistor"]
    np.testing.assert_allclose(axes[1].lines[0].get_ydata(), 1e3 * charge["r.i"])
    plt.close("all")


@pytest.mark.thorough
def test_several_runs(charge: Solution[RC]) -> None:
    other = simulate(rc(R=50.0), 0.1, save=TIMES)
    axes = compare({"slow": charge, "fast": other}, "c.v", {"heat": lambda s: s.r.v * s.r.i})
    assert [ax.get_ylabel() for ax in axes] == ["c.v\n[V]", "heat\n[W]"]
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["slow", "fast"]
    np.testing.assert_allclose(axes[0].lines[1].get_ydata(), other["c.v"])
    (states,) = compare({"slow": charge, "fast": other})
    assert states.get_ylabel() == "c.v\n[V]"
    plt.close("all")
    for runs in ({}, [charge], charge):
        with pytest.raises(ModelError, match="takes a dictionary of one or more solutions, as in"):
            compare(runs)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ModelError, match=r"one by one, not in a list, got \['c.v'\]"):
        charge.to_pandas(["c.v"])  # pyright: ignore[reportArgumentType]
    _, ax = plt.subplots()
    with pytest.raises(ModelError, match="There are 2 panels to draw, but 1 axes were given"):
        compare({"slow": charge}, "c.v", "r.v", axes=ax)
    plt.close("all")
    mass = simulate(Mass(m=1.0), 0.1)
    with pytest.raises(ModelError, match="no states in common"):
        compare({"circuit": charge, "mass": mass})
