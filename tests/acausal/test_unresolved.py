"""Variables that are too small for the error tolerance are reported."""

import re
import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _sized_models import circuit, shaft

from acausal import Component, ModelError, Result, UnresolvedWarning, replace, simulate
from acausal._integrate.results.unresolved import are_unresolved


@pytest.mark.thorough
@pytest.mark.parametrize(("model", "names"), [(circuit(1e-5, 1e-5), ["l.i", "c.v"]), (shaft(1e-6, 1e-6), ["rotor.w"])])
def test_small_variables_are_reported(model: Component, names: list[str]) -> None:
    """With a remedy that is one."""
    with pytest.warns(UnresolvedWarning, match=re.escape(names[0])) as caught:
        solution = simulate(model, 20.0)
    assert set(names) <= solution.unresolved.keys()
    for name in names:
        np.testing.assert_allclose(solution.unresolved[name], np.max(np.abs(solution[name])))
    assert f"Not resolved: {names[0]}" in repr(solution)
    (warning,) = caught
    found = re.search(r"nominal=(\{.*\})", str(warning.message))
    assert found is not None
    assert not simulate(model, 20.0, nominal=eval(found[1])).unresolved
    assert warning.filename == __file__


ZERO = replace(circuit(), {"source.V": 0.0})


@pytest.mark.parametrize("model", [circuit(), shaft(), ZERO, circuit(1.0, 1e-7), circuit(1e-6, 1.0), shaft(1e6, 1e3)])
def test_others_are_not(model: Component) -> None:
    """Nor are small ones that are as accurate as a large one by which steps are chosen."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solution = simulate(model, 20.0)
    assert solution.unresolved == {}
    assert "resolved" not in repr(solution)


@pytest.mark.filterwarnings("ignore::acausal.UnresolvedWarning")
@pytest.mark.parametrize("seed", range(3))
def test_what_is_wrong_by_a_tenth_is_reported(seed: int) -> None:
    """Errors of random circuits at random sizes are reported."""
    random = np.random.default_rng(seed)
    R, L, C = random.uniform(0.3, 2.0, 3).tolist()
    times = jnp.linspace(0.0, 20.0, 41)
    plain = simulate(circuit(1.0, 1.0, R, L, C), 20.0, save=times)
    for volt in 10.0 ** random.uniform(-8.0, 0.0, 6):
        solution = simulate(circuit(volt, volt, R, L, C), 20.0, save=times)
        for name in ("c.v", "l.i"):
            exact = np.asarray(plain[name])
            error = np.max(np.abs(solution[name] / volt - exact)) / np.max(np.abs(exact))
            assert error < 0.1 or name in solution.unresolved
            assert error > 1e-4 or name not in solution.unresolved


@pytest.mark.thorough
def test_under_jit_and_vmap() -> None:
    """No warning there, but a solution that tells."""

    def run(volt: Any) -> Any:
        return simulate(circuit(volt, volt), 20.0, save="end")

    assert jax.jit(run)(1e-5).unresolved.keys() == {"l.i", "c.v"}
    batch = jax.vmap(run)(jnp.array([1.0, 1e-5]))
    assert batch.unresolved.keys() == {"l.i", "c.v"}
    assert batch.unresolved["c.v"] < 1e-4
    assert not jax.vmap(run)(jnp.array([1.0, 2.0])).unresolved
    with pytest.raises(ModelError, match="return the solution"):
        jax.jit(lambda volt: len(run(volt).unresolved))(1e-5)


def test_failed_runs_do_not_warn() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        failed = simulate(circuit(1e-5, 1e-5), 20.0, max_steps=2, throw=False)
    assert failed.result == Result.too_many_steps


def test_the_bounds() -> None:
    """Neither small values that are accurate, nor rounding, nor what a loose tolerance allows."""
    sizes = np.ones(6)
    largest = jnp.array([1e-5, 1e-5, 0.02, 1e-12, 0.0, 1e-5])
    total = jnp.array([1e-6, 1e-8, 0.01, 1e-12, 0.0, 9e-7])
    np.testing.assert_array_equal(are_unresolved(sizes, 1e-6, largest, total), [True, *4 * [False], True])
    np.testing.assert_array_equal(are_unresolved(sizes, 1e-2, largest, total), 6 * [False])
