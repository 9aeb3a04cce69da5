"""Choices from catalogues: what is feasible, what rules others out, the front."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rigs import Rig, rig

from acausal import ModelError, SimulationError, quantity
from acausal.design import Choice, choose

SPRINGS = [{"name": "soft", "link.c": 10.0}, {"name": "middle", "link.c": "40 N/m"}, {"name": "hard", "link.c": 90.0}]
MASSES = [{"mass.m": 1.0, "link.d": 1.0}, {"mass.m": quantity(4000.0, "g"), "link.d": 2.0}]
TABLES = {"spring": SPRINGS, "mass": MASSES}


def frequency(model: Rig) -> Any:
    return jnp.sqrt(model.link.c / model.mass.m)


def chosen(**options: Any) -> Choice:
    limits = {"stiffness": (lambda m: m.link.c, "<= 50 N/m"), "decay": (lambda m: m.link.d / m.mass.m, ">= 0.6")}
    return choose(rig(), TABLES, {"frequency": (frequency, "1/s"), "mass": lambda m: m.mass.m}, constraints=limits)


def test_best_and_what_rules_others_out() -> None:
    found = chosen()
    assert [combination["spring"] for combination in found.combinations] == ["soft"] * 2 + ["middle"] * 2 + ["hard"] * 2
    np.testing.assert_allclose(found.values[:, 0], np.sqrt([10.0, 2.5, 40.0, 10.0, 90.0, 22.5]))
    assert found.combinations[0]["mass"] == "1, 1"
    assert found.is_feasible.tolist() == [True, False, True, False, False, False]
    assert found.best == 0
    assert found.order == [0, 2]
    assert found.ruled_out(1) == ("decay >= 0.6",)
    assert found.ruled_out(5) == ("stiffness <= 50 N/m", "decay >= 0.6")
    assert found.reasons == {"decay >= 0.6": (3, 2), "stiffness <= 50 N/m": (2, 1)}
    text = str(found)
    assert "6 combinations, 2 feasible" in text
    assert "ruled out by decay >= 0.6: 3, 2 of them by it alone" in text


def test_the_front() -> None:
    """Against a comparison of all pairs."""
    rng = np.random.default_rng(5)
    rows = [{"link.c": c, "link.d": d} for c, d in rng.uniform(1.0, 2.0, (200, 2))]
    found = choose(rig(), {"link": rows}, {"c": lambda m: m.link.c, "d": lambda m: m.link.d})
    better = np.all(found.values[:, None] <= found.values, axis=2) & np.any(
        found.values[:, None] < found.values, axis=2
    )
    assert sorted(found.front) == np.flatnonzero(~np.any(better, axis=0)).tolist()
    assert found.values[found.front[0], 0] == np.min(found.values[:, 0])


def test_what_cannot_be_computed_is_ruled_out() -> None:
    found = choose(rig(), TABLES, lambda m: jnp.log(m.link.c - 20.0))
    assert found.is_computed.tolist() == [False, False, True, True, True, True]
    assert found.ruled_out(0) == ("A result is not a finite number",)
    assert found.best == 2
    with pytest.raises(SimulationError, match="None of 6 combinations could be computed"):
        choose(rig(), TABLES, lambda m: jnp.log(-m.link.c))


def test_none_is_feasible() -> None:
    found = choose(rig(), TABLES, frequency, constraints={"c": (lambda m: m.link.c, ">= 100 N/m")})
    assert found.best is None
    assert found.front == []
    assert "6 combinations, 0 feasible" in str(found)


def test_picture() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    assert chosen().plot(beside=[2.0]).get_xlabel() == "frequency [1/s]"
    assert choose(rig(), TABLES, frequency).plot().get_ylabel() == "rank"
    plt.close("all")


@pytest.mark.parametrize(
    ("tables", "text"),
    [
        ({}, "at least one table"),
        ({"spring": []}, "spring: a table is a list of dictionaries"),
        ({"a": [{"link.c": 1.0}], "b": [{"link.c": 2.0}]}, "link.c stands in two tables"),
        ({"a": [{"link.c": 1.0}, {"link.d": 2.0}]}, "Member 1 names link.d, but the first one link.c"),
        ({"a": [{"link.k": 1.0}]}, "no parameter or start value 'link.k'"),
    ],
)
def test_bad_tables(tables: Any, text: str) -> None:
    with pytest.raises(ModelError, match=text):
        choose(rig(), tables, frequency)


def test_an_objective_is_one_number() -> None:
    with pytest.raises(ModelError, match="objective returned 2 numbers"):
        choose(rig(), TABLES, lambda m: jnp.stack([m.mass.m, m.link.c]))
