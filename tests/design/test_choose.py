"""Choices from catalogues: what is feasible, what rules others out, the front."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rigs import Rig, Twins, rig

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


def test_what_a_failure_means_can_be_said() -> None:
    """A combination that failed is not judged further: what it alone rules out is not known."""
    limits = {"mass": (lambda m: m.mass.m, "<= 2 kg")}
    meaning = {"no_finite_result": "frequency > 5 Hz"}
    found = choose(rig(), TABLES, lambda m: jnp.log(m.link.c - 20.0), constraints=limits, failures=meaning)
    assert found.reasons == {"mass <= 2 kg": (2, 2), "frequency > 5 Hz": (2, 0)}
    assert "ruled out by frequency > 5 Hz: 2, and not judged further" in str(found)
    with pytest.raises(ModelError, match=r"'never_stoped' is not a failure\. Did you mean never_stopped"):
        choose(rig(), TABLES, frequency, failures={"never_stoped": "too late"})


def test_none_is_feasible() -> None:
    found = choose(rig(), TABLES, frequency, constraints={"c": (lambda m: m.link.c, ">= 100 N/m")})
    assert found.best is None
    assert found.front == []
    assert "6 combinations, 0 feasible" in str(found)


LIGHT = [{"name": "steel", "mass.m": 1.0, "figures": {"price": 3.0}}, {"mass.m": 0.5, "figures": {"price": "700 g"}}]
TWINS = {"both": [{("a.mass.m", "b.mass.m"): 4.0}, {("a.mass.m", "b.mass.m"): 0.25}]}


def slower(model: Any) -> Any:
    """The lower one of the frequencies of a rig, or of two of them."""
    return jnp.minimum(frequency(model.a), frequency(model.b)) if isinstance(model, Twins) else frequency(model)


def price(model: Any, parts: Any) -> Any:
    return parts["mass"]["price"] if "mass" in parts else 2.0


def several(**options: Any) -> Choice:
    models = {"one": rig(), "two": Twins(a=rig(), b=rig(c=90.0))}
    tables = {"one": {"spring": SPRINGS, "mass": LIGHT}, "two": TWINS}
    minimise = {"frequency": (slower, "1/s"), "price": price}
    return choose(models, tables, minimise, constraints={"f": (slower, ">= 4 1/s")}, **options)


def test_models_of_several_structures() -> None:
    found = several()
    c, m, prices = np.repeat([10.0, 40.0, 90.0], 2), np.tile([1.0, 0.5], 3), np.tile([3.0, 0.7], 3)
    np.testing.assert_allclose(found.values[:6, 0], np.sqrt(c / m), rtol=1e-14)
    np.testing.assert_allclose(found.values[6:, 0], np.sqrt(40.0 / np.array([4.0, 0.25])), rtol=1e-14)
    np.testing.assert_allclose(found.values[:, 1], [*prices, 2.0, 2.0])
    assert found.combination(0) == {"structure": "one", "spring": "soft", "mass": "steel"}
    assert found.combination(7) == {"structure": "two", "both": "0.25"}
    assert found.is_feasible.tolist() == [False, True, True, True, True, True, False, True]
    assert found.order[0] == 1
    assert float(found.model(7).b.mass.m) == 0.25
    assert float(found.model(3).link.c) == 40.0
    assert found.front == [1]
    assert "structure" in str(found)


def test_a_store_for_each_structure(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    first, second = several(store=tmp_path / "kept"), several(store=tmp_path / "kept", executor=Refusing())
    np.testing.assert_array_equal(first.values, second.values)
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == ["one", "two"]


class Refusing:
    """An executor that is never asked, as all is in the store."""

    def submit(self, *args: Any) -> Any:
        raise AssertionError(args)


def test_the_continuous_optimum_is_beside_the_best_product() -> None:
    """sqrt(c/m) that is 4 at least is least at c = 16 m."""
    found = several()
    design = found.continuous("link.c", i=found.order[1])
    assert design.objective == pytest.approx(4.0, rel=1e-9)
    assert design.values["link.c"] == pytest.approx(16.0 * float(found.model(found.order[1]).mass.m), rel=1e-8)
    # Numbers are shown in the units of the table.
    rows = [{"mass.m": "500 g"}, {"mass.m": quantity(4000.0, "g")}]
    lighter = choose(rig(), {"mass": rows}, lambda m: m.mass.m**2).continuous("mass.m", sensitivities=False)
    assert lighter.values == {"mass.m": 0.5}
    assert "mass.m      500   500  4000  g" in str(lighter)
    with pytest.raises(ModelError, match=r"The tables have no 'link.d', but link.c, mass.m"):
        found.continuous("link.d")
    plt = pytest.importorskip("matplotlib.pyplot")
    assert len(found.plot(beside={"continuous": design}).lines) == 4
    plt.close("all")


def test_functions_return_as_much_of_all_structures() -> None:
    def each(model: Any) -> Any:
        return (1.0, 2.0) if isinstance(model, Twins) else 1.0

    models = {"one": rig(), "two": Twins(a=rig(), b=rig())}
    with pytest.raises(ModelError, match="each returned 2 numbers for two, but 1 for the first model"):
        choose(models, {"one": TABLES, "two": TWINS}, slower, constraints={"each": (each, ">= 0")})
    with pytest.raises(ModelError, match="Give the tables of several models by the names of the models: one, two"):
        choose(models, TABLES, slower)


def test_picture() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    assert chosen().plot(beside=[2.0]).get_xlabel() == "frequency [1/s]"
    assert choose(rig(), TABLES, frequency).plot().get_ylabel() == "rank"
    plt.close("all")


@pytest.mark.parametrize(
    ("tables", "text"),
    [
        ({}, "at least one table"),
        ({"spring": []}, "spring: a table must be a list of dictionaries"),
        ({"a": [{"link.c": 1.0}], "b": [{"link.c": 2.0}]}, "link.c is in two tables"),
        ({"a": [{"link.c": 1.0}, {"link.d": 2.0}]}, "Member 1 names link.d, but the first member names link.c"),
        ({"a": [{"name": "A", "link.c": c} for c in (1.0, 2.0)]}, "a: two rows have the name 'A'"),
        ({"a": [{"link.k": 1.0}]}, "no parameter or start value 'link.k'"),
        ({"a": [{"link.c": 1.0, "figures": {"p": float("nan")}}]}, "a, 1: the figure p is not a number"),
        ({"a": [{"link.c": 1.0, "figures": {"p": 1.0}}, {"link.c": 2.0}]}, "a, 2: figures must be a dictionary"),
    ],
)
def test_bad_tables(tables: Any, text: str) -> None:
    with pytest.raises(ModelError, match=text):
        choose(rig(), tables, frequency)


def test_an_objective_is_one_number() -> None:
    with pytest.raises(ModelError, match="objective must return one number, but returned 2"):
        choose(rig(), TABLES, lambda m: jnp.stack([m.mass.m, m.link.c]))
