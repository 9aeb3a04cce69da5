"""Options of a run. Invalid ones are refused if they are known, and are a result of the run if they are not."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

from acausal import (
    Component,
    Connections,
    ModelError,
    ParameterError,
    Result,
    Scalar,
    check,
    choose_states,
    connect,
    initialise,
    linearise,
    parameters,
    quantity,
    replace,
    simulate,
    structure,
)
from acausal.design import free_parameters
from acausal.testing import check_component
from components.translational import HardStop, Mass, Spring

NAN, INF = float("nan"), float("inf")
TIMES = np.linspace(0.0, 0.1, 5)

# Numbers that are wrong, by option, and what is said of them.
WRONG: list[tuple[dict[str, Any], str]] = [
    (dict(t1=NAN), "t1 must be a finite time"),
    (dict(t1=INF), "t1 must be a finite time"),
    (dict(t0=NAN), "t0 must be a finite time"),
    (dict(t0=-INF), "t0 must be a finite time"),
    (dict(rtol=0.0), "rtol must be a positive number"),
    (dict(rtol=-1e-6), "rtol must be a positive number"),
    (dict(rtol=NAN), "rtol must be a positive number"),
    (dict(dt0=0.0), "dt0, the size of the first step in s, must be positive"),
    (dict(dt0=-1e-3), "dt0, the size of the first step in s, must be positive"),
    (dict(dtmin=-1e-9), "dtmin, a step in s, must be positive"),
    (dict(save=TIMES + 0.05), "times to save at must lie between t0 and t1"),
    (dict(save=TIMES * NAN), "times to save at must lie between t0 and t1"),
    (dict(save=TIMES[::-1]), "times to save at must be in the order in which the run reaches them"),
    (dict(save=TIMES, t0=0.1, t1=0.0), "times to save at must be in the order in which the run reaches them"),
]
# What is wrong whatever its numbers.
UNFIT: list[tuple[dict[str, Any], str]] = [
    (dict(t1=None), "t1 must be a real number"),
    (dict(t1="one"), "t1 must be a real number, with a unit as in '15 mm' or without, got 'one'"),
    (dict(t0=1j), "t0 must be a real number"),
    (dict(t1=np.ones(2)), r"t1 must be one number, got an array of shape \(2,\)"),
    (dict(rtol="tight"), "rtol must be a real number"),
    (dict(t1=quantity(1.0, "m")), "t1 is in s, but is given in m"),
    (dict(save="all"), "save='all' is not known"),
    (dict(save=0.05), "save must be an array of times"),
    (dict(save=["a"]), "save must be a real number or an array of them"),
    (dict(max_steps=0), "max_steps must be an integer of at least 1"),
    (dict(max_steps=10.5), "max_steps must be an integer of at least 1"),
    (dict(max_steps=None), "max_steps must be an integer of at least 1"),
    (dict(max_steps=True), "max_steps must be an integer of at least 1"),
    (dict(max_events=-1), "max_events must be an integer of at least 1"),
    (dict(direction="sideways"), "direction='sideways' is not known"),
    (dict(save=[]), "save must name at least one time"),
    (dict(until=0.5), "until must be a function of the variables, got 0.5"),
    (dict(until=lambda s, t: s.c.v), r"until is called with the variables, s, but takes \(s, t\): missing a required"),
    (dict(integrals=lambda: 0.5), r"integrals is called with the variables, s, but takes \(\): too many"),
    (dict(until=lambda s: None), "until must return one real number, but returned 0"),
    (dict(until=lambda s: "a"), "until must return real numbers, but returned 'a'"),
    (dict(integrals=0.5), "integrals must be a function of the variables, got 0.5"),
    (dict(integrals={"q": abs}), r"integrals must be a function.* must return the dictionary: .*=lambda s: {'q': ...}"),
    (dict(peaks={}), r"peaks must be a function.* must return the dictionary: peaks=lambda s: {'name': ...}"),
    (dict(solver="Tsit5"), "solver='Tsit5' is not valid: pass a solver of diffrax"),
    (dict(adjoint="direct"), "adjoint='direct' is not valid: pass one of diffrax"),
    (dict(system="rc"), r"system='rc' is not valid: pass choose_states\(model\)"),
    (dict(nominal=1e-3), "nominal=0.001 is not a dictionary of sizes"),
]
ids: Callable[[Any], str] = lambda case: str(case)[:30]  # noqa: E731


@pytest.mark.parametrize(("options", "message"), WRONG + UNFIT, ids=ids)
def test_what_is_known_is_refused(options: dict[str, Any], message: str) -> None:
    asked: dict[str, Any] = {"t1": 0.1, "throw": False, **options}
    with pytest.raises(ModelError, match=message):
        simulate(rc(), **asked)


@eqx.filter_jit
def _under_jit(numbers: dict[str, Any], throw: bool) -> Any:
    sol = simulate(rc(), **numbers, throw=throw)
    return sol.result, sol.final.c.v


def test_a_wrong_time_to_save_at_is_named() -> None:
    for save, message in (
        (np.linspace(0.0, 1.2, 1001), r"t0 and t1, got 1\.0008 with t0=0\.0 and t1=1\.0\."),
        ([0.5, 1.0000001], r"t0 and t1, got 1\.0000001 with t0=0\.0 and t1=1\.0\."),
        ([0.2, 0.5, 0.3, 0.4], r"run reaches them, got 0\.3 after 0\.5\."),
    ):
        with pytest.raises(ModelError, match=message):
            simulate(rc(), 1.0, save=save)


@pytest.mark.parametrize(("options", "message"), WRONG, ids=ids)
def test_what_is_not_known_is_a_result(options: dict[str, Any], message: str) -> None:
    """One compilation for each set of options: with numbers that are right, the run is as without jit."""
    right: dict[str, Any] = dict(t0=0.0, t1=0.1, rtol=1e-6, dt0=1e-3, dtmin=1e-12, save=TIMES)
    result, v = _under_jit(jax.tree_util.tree_map(jnp.asarray, right), False)
    assert result == Result.reached_end
    assert v == pytest.approx(float(simulate(rc(), **right).final.c.v), rel=1e-12)
    wrong = jax.tree_util.tree_map(jnp.asarray, right | options)
    assert _under_jit(wrong, False)[0] == Result.bad_option
    with pytest.raises(RuntimeError, match=message):
        _under_jit(wrong, True)


@pytest.mark.thorough
def test_members_of_a_batch_are_refused_one_by_one() -> None:
    sols = jax.vmap(lambda t1: simulate(rc(), t1, until=lambda s: s.c.v - 1.0, throw=False))(jnp.array([0.1, NAN]))
    np.testing.assert_array_equal(sols.result == Result.bad_option, [False, True])
    assert sols.t1[1] == INF


@pytest.mark.thorough
def test_times_of_every_kind() -> None:
    wanted = simulate(rc(), 1.0).final.c.v
    for t1 in (1, np.float32(1.0), np.int64(1), jnp.ones((), jnp.float32), quantity(1000.0, "ms")):
        np.testing.assert_array_equal(simulate(rc(), t1).final.c.v, wanted)


@pytest.mark.parametrize("value", ["a", 1j, np.array(1.0 + 1.0j)], ids=str)
def test_a_model_of_real_numbers_is_needed(value: Scalar) -> None:
    model = eqx.tree_at(lambda model: model.r.R, rc(), value)
    with pytest.raises(ParameterError, match="which is not a real number"):
        simulate(model, 1.0)


USES: dict[str, Callable[[Any], object]] = {
    "simulate": lambda model: simulate(model, 1.0),
    "initialise": initialise,
    "linearise": linearise,
    "replace": lambda model: replace(model, {"c.C": 1.0}),
    "parameters": parameters,
    "structure": structure,
    "check": check,
    "choose_states": choose_states,
    "free_parameters": lambda model: free_parameters(model, {"c.C": (1e-3, 2e-3)}),
    "check_component": check_component,
}


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("wrong", [3.0, None, type(rc())])
def test_a_model_is_needed(use: str, wrong: object) -> None:
    """A number is none, and neither is a class."""
    with pytest.raises(ModelError, match=r"is not a component: (pass a model|create one, as in RC)"):
        USES[use](wrong)


class Swinging(Component):
    mass: Mass
    spring: Spring
    stop: HardStop

    def connections(self) -> Connections:
        return (connect(self.mass.b, self.spring.a, self.stop.flange),)


def test_a_run_back_in_time_leads_back() -> None:
    """dv/dt = (V - v) / tau, with a first step that is given by its size."""
    there = simulate(rc(v0=1.0), 0.1, rtol=1e-9).final.c.v
    back = simulate(rc(v0=float(there)), 0.0, t0=0.1, dt0=1e-4, rtol=1e-9, save=TIMES[::-1])
    assert back.final.c.v == pytest.approx(1.0, abs=1e-7)
    np.testing.assert_array_equal(back.ts, TIMES[::-1])
    assert back.options["dt0"] == 1e-4


@pytest.mark.thorough
def test_events_cannot_be_undone() -> None:
    model = Swinging(mass=Mass(m=1.0), spring=Spring(c=1.0), stop=HardStop(s_max=1.0))
    with pytest.raises(ModelError, match=r"cannot undo the event stop\.\w+, got t1=-1"):
        simulate(model, -1.0)
    back = jax.jit(lambda t1: simulate(model, t1, throw=False).result == Result.bad_option)
    assert back(-1.0)
    assert not back(1.0)
