"""Loaded Modelica models are components like any other."""

import pickle
import warnings
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import ParameterError, initialise, parameters, replace, simulate, structure
from acausal.modelica import ModelicaError, load
from acausal.modelica._translate import builtins

TEXT = """
package P
  model Cell "A body that cools"
    parameter Real c = 2;
    Real T(start = 10, fixed = true);
  equation
    c * der(T) = -T;
  end Cell;
  model Pack
    parameter Real base = 2;
    parameter Integer n = 2;
    Cell cell[n](c = {base, 3 * base});
    Real lambda;
  equation
    lambda = cell[1].T + cell[2].T;
  end Pack;
end P;
"""


@pytest.fixture(scope="module")
def pack() -> Any:
    return load(TEXT, "P.Pack")


def end(model: Any) -> Any:
    return simulate(model, 1.0, rtol=1e-10, save="end")["lambda_"][-1]


def exact(base: float) -> float:
    return 10.0 * (np.exp(-1.0 / base) + np.exp(-1.0 / (3.0 * base)))


def test_parameters_follow_others_in_values_and_derivatives(pack: Any) -> None:
    def changed(base: Any) -> Any:
        return eqx.tree_at(lambda m: m.base, pack, jnp.asarray(base))

    slope = 10.0 * (np.exp(-0.5) / 4.0 + np.exp(-1.0 / 6.0) / 12.0)
    assert end(pack) == pytest.approx(exact(2.0), rel=1e-8)
    assert end(changed(4.0)) == pytest.approx(exact(4.0), rel=1e-8)
    assert jax.grad(lambda b: end(changed(b)))(2.0) == pytest.approx(slope, rel=1e-6)
    assert jax.jvp(lambda b: end(changed(b)), (2.0,), (1.0,))[1] == pytest.approx(slope, rel=1e-6)
    several = jax.vmap(lambda b: end(changed(b)))(jnp.array([1.0, 2.0, 4.0]))
    assert np.allclose(several, [exact(1.0), exact(2.0), exact(4.0)], rtol=1e-8)


def test_a_parameter_that_follows_others_is_not_set(pack: Any) -> None:
    assert list(parameters(pack)) == ["base"]
    with pytest.raises(ParameterError, match=r"determined by other parameters .* load the model with a value of it\."):
        replace(pack, {"cell[1].c": 5.0})


def test_members_of_arrays_count_from_1(pack: Any) -> None:
    assert pack.cell[2].c == 6.0
    with pytest.raises(IndexError, match="counted from 1 to 2"):
        pack.cell[0]
    assert simulate(pack, 1.0, save="end")["cell[2].T"][-1] == pytest.approx(10.0 * np.exp(-1.0 / 6.0), rel=1e-4)


def test_a_stored_model_runs_like_the_first(pack: Any) -> None:
    changed = replace(pack, {"base": 3.0})
    assert end(pickle.loads(pickle.dumps(changed))) == end(changed)


def test_modifiers_set_what_is_fixed_and_reports_speak_of_lines(pack: Any) -> None:
    assert not hasattr(pack, "n")
    assert parameters(load(TEXT, "P.Pack(n=2, base=5)")) == {"base": 5.0}
    assert "cell[1]" in str(structure(pack))


def test_an_element_that_is_not_supported_is_refused_with_its_line() -> None:
    lines = ["model Late", "  Real x(start = 1, fixed = true);", "  Real y;", "equation", "  der(x) = -x;"]
    text = "\n".join([*lines, "  y = delay(x, x, 2.0);", "end Late;"])
    with pytest.raises(ModelicaError, match=r"mo:6, Late: the function delay is not supported"):
        load(text, "Late")


FOLLOWED = """
model Followed
  parameter Real p = 2;
  parameter Real J = 3 * p;
  Real x(start = 2 * p, fixed = true);
  discrete Real k(start = p, fixed = true);
equation
  J * der(x) = 1 - x;
  when sample(0.3, 0.3) then
    k = pre(k) + 1;
  end when;
end Followed;
"""


def test_start_values_follow_parameters_until_others_are_given() -> None:
    model: Any = load(FOLLOWED, "Followed")
    changed = replace(model, {"p": 5.0})
    assert changed.J == 15.0
    sol = simulate(changed, 1.0, rtol=1e-9, save="end")
    assert sol["k"][-1] == 8.0
    assert sol["x"][-1] == pytest.approx(1.0 + 9.0 * np.exp(-1.0 / 15.0), rel=1e-6)
    slope = jax.grad(lambda p: simulate(replace(model, {"p": p}), 1.0, save="end")["k"][-1])(2.0)
    assert slope == pytest.approx(1.0)
    steady = initialise(model, steady=True)
    assert simulate(steady, 1.0, save="end")["x"][-1] == pytest.approx(1.0, abs=1e-9)
    assert simulate(replace(model, {"x": 1.0}), 1.0, save="end")["x"][-1] == pytest.approx(1.0, abs=1e-9)


def test_real_parameters_that_decide_others_are_known() -> None:
    text = "model A parameter Real p = 2; parameter Boolean big = p > 1; Real y = if big then 3 else time; end A;"
    assert list(parameters(load(text, "A"))) == []


def test_replace_says_that_a_parameter_is_fixed() -> None:
    model = load("model A parameter Integer n = 2; parameter Real p = n; Real y[n] = fill(p * time, n); end A;", "A")
    with pytest.raises(ParameterError, match=r"^n is fixed, .* by a modifier when you load"):
        replace(model, {"n": 3})


def test_values_of_parameters_need_no_compiled_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(builtins, "jnp", None)
    text = "model A parameter Real p = 2, q[2] = {p, 3 * p}, r = max(q) + sum(q); Real x(start = r, fixed = true); "
    model = load(text + "equation der(x) = -x; end A;", "A")
    assert model.r == 14.0


def test_parameters_without_a_value_are_named_once() -> None:
    text = """model A parameter Real r; parameter Real given = 1; parameter Real start(start = 2); end A;
        model M parameter Real k; parameter Real open(fixed = false); A a[2]; Real x = k + a[1].r; Real y = open;
        initial equation open = 1; end M;"""
    with pytest.warns(
        UserWarning, match=r"no value, and are 0, false or empty: k, a\[1\].r, a\[2\].r\..*M\(k=...\)"
    ) as found:
        load(text, "M")
    assert len(found) == 1
    with pytest.warns(UserWarning, match=r"a\[1\].r, a\[2\].r\..*M\(a\(r=...\)\)"):
        load(text, "M(k=1)")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(text, "M(k=1, a(each r=2))")
