"""Reading a solution."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib as mpl
import numpy as np
import pytest
from _models import Chain, rc

from acausal import (
    ArgumentError,
    ModelError,
    ParameterError,
    Solution,
    UnknownNameError,
    quantity,
    repeat,
    simulate,
)
from components.rotational import Inertia, Spring

mpl.use("Agg")

RESISTANCES = jnp.array([50.0, 100.0])
CAPACITIES = jnp.array([1e-3, 2e-3, 3e-3])


@pytest.mark.thorough
def test_solutions_mapped_twice() -> None:
    def run(R: Any, C: Any) -> Solution:
        return simulate(eqx.tree_at(lambda m: (m.r.R, m.c.C), rc(), (R, C)), 0.1, save="end", rtol=1e-9)

    sols = jax.vmap(lambda C: jax.vmap(lambda R: run(R, C))(RESISTANCES))(CAPACITIES)
    expected = 5.0 * (1.0 - np.exp(-0.1 / (np.asarray(CAPACITIES)[:, None] * np.asarray(RESISTANCES))))
    np.testing.assert_allclose(sols.final.c.v, expected, rtol=1e-7)
    np.testing.assert_allclose(sols["c.v"][..., 0], expected, rtol=1e-7)


@pytest.mark.thorough
def test_dense_batch() -> None:
    def run(R: Any) -> Solution:
        return simulate(eqx.tree_at(lambda m: m.r.R, rc(), R), 0.1, save="dense", rtol=1e-9)

    sols = jax.vmap(run)(RESISTANCES)
    expected = 5.0 * (1.0 - np.exp(-0.05 / (1e-3 * np.asarray(RESISTANCES))))
    np.testing.assert_allclose(sols.at(0.05).c.v, expected, rtol=1e-7)


SPEEDS = np.array([1.0, -2.0, 0.5])


@pytest.fixture(scope="module")
def model() -> Chain:
    return Chain(masses=repeat(Inertia(J=jnp.array([1.0, 2.0, 3.0]), w=SPEEDS), 3), springs=repeat(Spring(c=3.0), 2))


@pytest.fixture(scope="module")
def chain(model: Chain) -> Solution:
    return simulate(model, 1.0, rtol=1e-8)


@pytest.mark.thorough
def test_names_of_members(chain: Solution) -> None:
    assert chain["masses[1].w"].shape == chain.ts.shape
    assert len(chain.ts) > 3
    np.testing.assert_array_equal(chain["masses[1].w"], chain.masses.item.w[:, 1])
    np.testing.assert_allclose([chain[f"masses[{i}].w"][0] for i in range(3)], SPEEDS, rtol=1e-12)
    np.testing.assert_allclose(chain.final.masses[2].w, chain["masses[2].w"][-1], rtol=1e-12)
    np.testing.assert_array_equal(chain["masses[1].J"], 2.0)
    momentum = chain["masses[0].w"] + 2.0 * chain["masses[1].w"] + 3.0 * chain["masses[2].w"]
    np.testing.assert_allclose(momentum, 1.0 - 4.0 + 1.5, rtol=1e-7)


def test_members_by_index(chain: Solution) -> None:
    np.testing.assert_array_equal(chain.masses[1].w, chain["masses[1].w"])
    np.testing.assert_array_equal(chain.masses[1].J, 2.0)


def test_members_at_any_time(model: Chain) -> None:
    sol = simulate(model, 1.0, save="dense", rtol=1e-8)
    times = jnp.array([0.0, 0.3, 0.31])
    np.testing.assert_allclose(jnp.stack([sol.at(0.0).masses[i].w for i in range(3)]), SPEEDS, rtol=1e-12)
    speeds = jnp.asarray(sol.at(times).masses.item.w)
    np.testing.assert_allclose(speeds[1], sol.at(0.3).masses.item.w, rtol=1e-12)
    assert speeds.shape == (3, 3)


@pytest.fixture(scope="module")
def charge() -> Solution:
    return simulate(rc(), 0.25, rtol=1e-8)


def exact(t: Any) -> np.ndarray:
    return 5.0 * (1.0 - np.exp(-10.0 * np.asarray(t)))


@pytest.mark.parametrize(("name", "hint"), [("c.w", r"c\.v"), ("capacitor.v", ""), ("r.r", r"r\.R")])
def test_unknown_name(charge: Solution, name: str, hint: str) -> None:
    with pytest.raises(UnknownNameError, match=f"no variable or parameter '{name}'.*{hint}"):
        charge[name]
    with pytest.raises(KeyError):
        charge[name]


@pytest.mark.parametrize("name", [0, None, ("c", "v")])
def test_a_solution_is_read_by_path(charge: Solution, name: Any) -> None:
    with pytest.raises(ArgumentError, match=r"read by path, as in sol\['source\.v'\]"):
        charge[name]


@pytest.mark.parametrize("t", ["soon", None, 1j])
def test_a_time_is_a_number(charge: Solution, t: Any) -> None:
    with pytest.raises(ParameterError, match="t must be a real number"):
        charge.at(t)
    np.testing.assert_array_equal(charge.at(quantity(100.0, "ms")).c.v, charge.at(0.1).c.v)


def test_unknown_attribute(charge: Solution) -> None:
    with pytest.raises(UnknownNameError, match=r"attribute 'sourc'.*Did you mean source"):
        _ = charge.sourc
    assert not hasattr(charge, "nothing")
    assert {"source", "r", "c", "ground"} <= set(dir(charge))


def test_steps_are_needed_for_other_times() -> None:
    ended = simulate(rc(), 0.25, save="end")
    for read in (lambda: ended.at(0.1), lambda: ended.peak(lambda s: s.c.v), lambda: ended.energy):
        with pytest.raises(ModelError, match='save="dense"'):
            read()


def test_to_numpy(charge: Solution) -> None:
    columns = charge.to_numpy()
    assert len(columns) == 1 + 20
    assert "r.R" not in columns
    np.testing.assert_array_equal(columns["t"], charge.ts)
    assert columns["t"][0] == 0.0
    assert columns["t"][-1] == 0.25
    np.testing.assert_allclose(columns["c.v"], exact(columns["t"]), rtol=1e-6, atol=1e-7)
    np.testing.assert_array_equal(columns["ground.p.v"], 0.0)


def test_to_pandas(charge: Solution) -> None:
    frame = charge.to_pandas()
    assert frame.index.name == "t"
    assert frame.shape == (len(charge.ts), 20)
    np.testing.assert_allclose(frame["c.v"], exact(frame.index), rtol=1e-6, atol=1e-7)


def test_to_xarray(charge: Solution) -> None:
    data = charge.to_xarray()
    assert data["c.v"].attrs["units"] == "V"
    assert data["c.v"].dims == ("t",)
    np.testing.assert_allclose(data["c.v"], exact(data["t"]), rtol=1e-6, atol=1e-7)


def test_a_column_with_the_name_of_the_time_is_labelled(charge: Solution) -> None:
    column = {"t": lambda s: 2.0 * s.c.v}
    with pytest.raises(ModelError, match=r"A column 't' has the name of the time axis: label it"):
        charge.to_xarray(column)


@pytest.mark.thorough
def test_a_batch_is_exported_run_by_run() -> None:
    sols = jax.vmap(lambda V: simulate(rc(V=V), 0.1, save="end"))(jnp.array([1.0, 5.0]))
    with pytest.raises(ModelError, match="batch"):
        sols.to_numpy()
    one = jax.tree_util.tree_map(lambda leaf: leaf[1], sols)
    np.testing.assert_allclose(one.to_numpy()["c.v"], exact([0.1]), rtol=1e-4)


def test_plot(charge: Solution) -> None:
    from matplotlib import pyplot as plt

    volts, amperes = charge.plot("c.v", "r.i", "source.v")
    assert [line.get_label() for line in volts.get_lines()] == ["c.v", "source.v"]
    assert [ax.get_ylabel() for ax in (volts, amperes)] == ["[V]", "[A]"]
    np.testing.assert_allclose(amperes.get_lines()[0].get_ydata(), charge["r.i"])
    (states,) = charge.plot()
    assert [line.get_label() for line in states.get_lines()] == ["c.v"]
    plt.close("all")
