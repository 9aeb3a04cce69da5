"""What is said about wrong models, wrong numbers and failed runs: each message names the culprit and a remedy."""

from typing import Any, Self

import equinox as eqx
import jax.numpy as jnp
import pytest
from _models import oscillator, rc

from acausal import (
    Component,
    Equations,
    ModelError,
    Scalar,
    StructureError,
    Var,
    compile,
    eq,
    simulate,
)


class Loose(Component):
    """A variable that no equation mentions."""

    x: Var[Scalar, "m"] = 1.0
    loose: Var[Scalar, "m"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x))


class Empty(Component):
    x: Var[Scalar, "m"] = 1.0


class Holder(Component):
    part: Loose


def test_variable_in_no_equation() -> None:
    with pytest.raises(StructureError, match=r"Too few equations(.|\n)*part\.loose(.|\n)*Remedy"):
        simulate(Holder(part=Loose()), 1.0)


def test_model_without_equations() -> None:
    with pytest.raises(StructureError, match=r"(?s)Too few equations.*x"):
        simulate(Empty(), 1.0)


def test_system_of_another_model() -> None:
    with pytest.raises(ModelError, match="compile"):
        simulate(oscillator(), 1.0, system=compile(rc()))


READERS = {
    "t1": lambda sol: sol.t1,
    "final": lambda sol: sol.final.c.v,
    "trajectory": lambda sol: sol["c.v"],
    "integrals": lambda sol: sol.integrals["charge"],
}


@pytest.mark.parametrize("reader", READERS)
def test_failure_under_jit_shows_whatever_is_read(reader: str) -> None:
    """A result that is not the end time must not hide that the run went wrong."""

    @eqx.filter_jit
    def run(R: Any) -> Any:
        model = eqx.tree_at(lambda m: m.r.R, rc(), R)
        sol = simulate(model, 0.1, save=jnp.array([0.05, 0.1]), integrals=lambda s: {"charge": s.c.i})
        return READERS[reader](sol)

    run(jnp.asarray(100.0))
    with pytest.raises(RuntimeError, match=r"r\.R must be nonnegative"):
        run(jnp.asarray(-100.0))


@pytest.mark.parametrize(("option", "value"), [("save", "step"), ("direction", "upwards")])
def test_unknown_option(option: str, value: str) -> None:
    keywords: dict[str, Any] = {option: value}
    with pytest.raises((ModelError, ValueError), match=f"(?s){option}.*{value}"):
        simulate(rc(), 1.0, until=lambda s: s.c.v - 1.0, **keywords)


def test_condition_of_wrong_shape() -> None:
    with pytest.raises(ModelError, match="until"):
        simulate(rc(), 1.0, until=lambda s: jnp.stack([s.c.v - 1.0, s.c.v - 2.0]))


def test_condition_that_is_a_truth_value() -> None:
    with pytest.raises(ModelError, match="until"):
        simulate(rc(), 1.0, until=lambda s: s.c.v > 1.0)
