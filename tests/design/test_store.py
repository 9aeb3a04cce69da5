"""When the results of a store are still right: what is computed decides, wherever it is written."""

import sys
import types
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rigs import rig

from acausal import ModelError
from acausal.design import choose, sweep

pytest.importorskip("xarray")
pytest.importorskip("zarr")

HELPERS = """
import numpy as np
EXPONENT = 2.0
TABLE = np.linspace(0.0, 1.0, 2000)
def drag(x):
    return x**EXPONENT + np.sum(TABLE)
"""

STUDY = """
import jax
import jax.numpy as jnp
import helpers
from acausal import Component, Energy, Param, Record, Scalar, Var, at, eq, positive, require, simulate, when

class Law(Record):
    factor = 3.0
    def loss(self, w):
        return helpers.drag(w) * self.factor

class Rotor(Component):
    torque = 4.0
    J: Param[Scalar, "kg.m2", positive]
    law: Law
    w: Var[Scalar, "rad/s"] = 1.0
    @property
    def energy_now(self):
        return 0.5 * self.J * self.w**2
    def requirements(self):
        return (require(self.J < 50.0, "J must be below 50"),)
    def equations(self, d):
        return dict(newton=eq(self.J * d.w, self.torque - self.law.loss(self.w), check_units=False))
    def events(self):
        return dict(kick=at(0.05, w=self.w + 0.25))

def model():
    return Rotor(J=2.0, law=Law(), w=1.5)

def run(m):
    return simulate(m, 0.1, save="end", rtol=1e-4)

def at_end(s):
    return s.final.energy_now

def speed(s):
    return s.final.w

def at_once(m):
    return m.energy_now + m.law.loss(m.w)
"""

# Each of them alone makes other results: what is changed in the study or in the module of its helpers.
OF_A_RUN = {
    "an equation": ("- self.law.loss", "- 2.0 * self.law.loss"),
    "an event": ("self.w + 0.25", "self.w - 0.25"),
    "a class attribute": ("torque = 4.0", "torque = 5.0"),
    "an option of the run": ("rtol=1e-4", "rtol=1e-5"),
    "the time of an event": ("at(0.05", "at(0.06"),
}
OF_A_MODEL = {
    "a property": ("0.5 * self.J", "0.25 * self.J"),
    "a method of a record": ("(w) * self.factor", "(w) / self.factor"),
    "a class attribute of a record": ("factor = 3.0", "factor = 3.5"),
    "a helper in another module": ("x**EXPONENT +", "x**EXPONENT -"),
    "a constant that a helper reads": ("EXPONENT = 2.0", "EXPONENT = 3.0"),
    "an array that a helper reads": ("np.linspace(0.0, 1.0, 2000)", "np.geomspace(0.5, 1.0, 2000)"),
    "a requirement": ("self.J < 50.0", "self.J < 3.0"),
    "a range": ('"kg.m2", positive', '"kg.m2"'),
    "a result": ("m.energy_now +", "m.energy_now -"),
}
SAME = {
    "a remark": ("class Rotor", "# A rotor with drag.\nclass Rotor"),
    "the name of a function": ("at_once", "at_once_and_here"),
    "the name of a variable of a helper": ("drag(x):\n    return x**", "drag(speed):\n    return speed**"),
}
OVER = {"J": [1.0, 2.0]}


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes the module of a study, as a new process would import it, with some text changed."""

    def made(old: str = "", new: str = "") -> Any:
        assert old in STUDY + HELPERS
        for name, text in (("helpers", HELPERS), ("study", STUDY)):
            module = types.ModuleType(name)
            monkeypatch.setitem(sys.modules, name, module)
            exec(compile(text.replace(old, new) if old else text, name, "exec"), vars(module))
        return sys.modules["study"]

    return made


def of_a_model(module: Any, store: Path) -> np.ndarray:
    result = getattr(module, "at_once", None) or module.at_once_and_here
    return sweep(module.model(), OVER, {"f": result}, store=store)["f"].values


@pytest.mark.parametrize("case", OF_A_MODEL)
def test_results_of_another_model_are_refused(case: str, study: Any, tmp_path: Path) -> None:
    first = of_a_model(study(), tmp_path / "kept")
    np.testing.assert_array_equal(of_a_model(study(), tmp_path / "kept"), first)
    with pytest.raises(ModelError, match="its model, run or results have another definition"):
        of_a_model(study(*OF_A_MODEL[case]), tmp_path / "kept")


def test_what_is_written_otherwise_is_the_same(study: Any, tmp_path: Path) -> None:
    first = of_a_model(study(), tmp_path / "kept")
    for change in SAME.values():
        np.testing.assert_array_equal(of_a_model(study(*change), tmp_path / "kept"), first)


@pytest.mark.thorough
def test_results_of_another_run_are_refused(study: Any, tmp_path: Path) -> None:
    def swept(module: Any) -> np.ndarray:
        results = {"f": module.at_end, "w": module.speed}
        return sweep(module.model(), OVER, results, run=module.run, store=tmp_path / "kept")["f"].values

    first = swept(study())
    np.testing.assert_array_equal(swept(study()), first)
    for change in OF_A_RUN.values():
        with pytest.raises(ModelError, match="its model, run or results have another definition"):
            swept(study(*change))


def test_a_choice_of_another_model_is_refused(study: Any, tmp_path: Path) -> None:
    tables = {"rotor": [{"J": 1.0}, {"J": 2.0}]}
    module, other = study(), study(*OF_A_MODEL["a property"])
    for _ in range(2):
        choose(module.model(), tables, module.at_once, store=tmp_path / "kept")
    with pytest.raises(ModelError, match="its model, run or results have another definition"):
        choose(other.model(), tables, other.at_once, store=tmp_path / "kept")


CALLS: dict[str, Any] = {
    "a callback": lambda m: jax.pure_callback(
        np.sin, jax.ShapeDtypeStruct((), float), m.link.c, vmap_method="sequential"
    ),
    "a print": lambda m: (jax.debug.print("{}", m.link.c), m.link.c)[1],
}


@pytest.mark.parametrize("case", CALLS)
def test_what_python_computes_is_not_stored(case: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"a result calls Python, .* Leave out these calls, or the store"):
        sweep(rig(), {"link.c": [1.0]}, {"f": CALLS[case]}, store=tmp_path / "kept")
    assert not (tmp_path / "kept").exists()


@pytest.mark.parametrize("make", [np.asarray, jnp.asarray])
def test_long_arrays_count_to_the_last_number(make: Any, tmp_path: Path) -> None:
    numbers = np.arange(3000.0)

    def swept(values: Any) -> None:
        sweep(rig(), {"link.c": [1.0]}, {"f": lambda m: jnp.sum(make(values) * m.link.c)}, store=tmp_path / "kept")

    for _ in range(2):
        swept(numbers)
    with pytest.raises(ModelError, match="its model, run or results have another definition"):
        swept(np.where(numbers == 2000.0, 0.0, numbers))
