"""Models and arguments that have no C code: the message names the place and the remedy."""

from pathlib import Path
from typing import Any, Self

import jax
import numpy as np
import pytest
from _c_models import Ball, Rig, motor_servo
from _compiled import Compiled, needs_compiler

from acausal import Component, Connections, Equations, ModelError, Param, Scalar, Var, connect, eq
from acausal.codegen import export_c
from acausal.codegen.expressions import HELPERS, identifier
from components import blocks


def in_python(t: Scalar) -> Any:
    return jax.pure_callback(np.sin, jax.ShapeDtypeStruct((), float), t)


def _wiring(source: Any, filter: Any) -> Connections:
    return (connect(source.y, filter.u),)


def test_names_of_c_are_changed() -> None:
    assert [identifier(name) for name in ("2 m", "power", "a.b[3]")] == ["_2_m", "power_", "a_b_3"]
    assert all(identifier(name) != name for name in HELPERS)


def test_a_callback_to_python(tmp_path: Path) -> None:
    parts = blocks.TimeFunction(function=in_python), blocks.FirstOrder(T=1.0)
    expected = r"parts\[0\]\.function of the Rig uses `pure_callback`, which has no C form\. Remedy: "
    with pytest.raises(ModelError, match=expected):
        export_c(Rig(parts=parts, wiring=_wiring), tmp_path, step=1e-3)


class Pendulum(Component):
    """A point mass on a massless rod."""

    L: Param[Scalar, "m"] = 1.0
    g: Param[Scalar, "m/s2"] = 9.81
    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = -1.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    f: Var[Scalar, "1/s2"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.f * self.x),
            newton_y=eq(d.v, -self.f * self.y - self.g),
            rod=eq(self.x**2 + self.y**2, self.L**2),
        )


def test_states_with_invariants(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"restricted by invariants \(.*rod.*\).* Remedy: declare a variable `never`"):
        export_c(Pendulum(), tmp_path, step=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(outputs="load.q"), r"The model has no variable 'load\.q'"),
        (dict(outputs=["load.q"]), r"The model has no variable 'load\.q'"),
        (dict(method="heun"), r"method must be one of implicit, explicit, rk4, not 'heun'\."),
        (dict(step=0.0), r"step must be a positive number of seconds, not 0\.0\."),
        (dict(step=float("nan")), "step must be a positive number of seconds, not nan"),
    ],
)
def test_arguments(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {"step": 1e-3, **options}
    with pytest.raises(ModelError, match=message):
        export_c(motor_servo(), tmp_path, **arguments)
    assert not any(tmp_path.iterdir())


def test_a_name_that_c_reserves(tmp_path: Path) -> None:
    assert export_c(Ball(), tmp_path, step=1e-3, name="for").name == "for_"


def test_numbers_that_are_not_known(tmp_path: Path) -> None:
    def traced(g: Scalar) -> Scalar:
        export_c(Ball(g=g), tmp_path, step=1e-3)
        return g

    with pytest.raises(ModelError, match=r"must have known numbers\. Remedy: export it outside of jax\.jit"):
        jax.jit(traced)(9.81)


class Awkward(Component):
    """Equations whose names are those of functions of C code."""

    rates: Var[Scalar, "1"] = 1.0
    exp: Var[Scalar, "1/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rates=eq(self.exp, d.rates), rates_along=eq(self.exp, -2.0 * self.rates, check_units=False))


@needs_compiler
def test_names_of_a_model_do_not_collide_with_those_of_its_code(tmp_path: Path) -> None:
    compiled = Compiled(Awkward(), tmp_path)
    np.testing.assert_array_equal(compiled.vector("rates", 1), [-2.0])
    np.testing.assert_array_equal(compiled.vector("along", 1, 0.0, np.ones(1)), [-2.0])
