"""jax's float type belongs to the process: another one in a part of it is refused, and leaves nothing behind."""

from collections.abc import Callable
from typing import Any, Self

import jax
import pytest

from acausal import (
    AcausalError,
    Component,
    Equations,
    Scalar,
    Solution,
    Var,
    check,
    choose_states,
    eq,
    initialise,
    linearise,
    simulate,
    structure,
)


def decay() -> Any:
    """A model of a class that nothing has traced."""

    class Decay(Component):
        x: Var[Scalar, "1"] = 1.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(d.x, -self.x, check_units=False))

    return Decay()


def run(model: Any) -> Solution[Any]:
    return simulate(model, 1.0, save="end")


uses: dict[str, Callable[[Any], object]] = {
    "simulate": lambda model: simulate(model, 1.0),
    "simulate in jit": lambda model: jax.jit(lambda t1: simulate(model, t1, save="end").t1)(1.0),
    "initialise": initialise,
    "linearise": linearise,
    "choose_states": choose_states,
    "check": check,
    "structure": structure,
}


@pytest.mark.parametrize("name", uses)
def test_another_float_type_is_refused_and_leaves_nothing_behind(name: str) -> None:
    model = decay()
    with jax.enable_x64(False), pytest.raises(AcausalError, match=r"32-bit floats here .* jax.enable_x64\(False\)"):
        uses[name](model)
    assert run(model).final.x == pytest.approx(0.36788, abs=1e-5)


def test_readings_of_a_run_refuse_another_float_type() -> None:
    sol = simulate(decay(), 1.0)
    reads: list[Callable[[], object]] = [
        lambda: sol["x"],
        lambda: sol.values,
        lambda: sol.final,
        lambda: sol.at(0.5),
        lambda: sol.peak(lambda s: s.x),
        lambda: sol.integral(lambda s: s.x),
        lambda: str(sol),
    ]
    for read in reads:
        with jax.enable_x64(False), pytest.raises(AcausalError, match="32-bit floats here"):
            read()
    assert sol.final.x == pytest.approx(0.36788, abs=1e-5)
