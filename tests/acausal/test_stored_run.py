"""What a stored program is found by, and when it is not."""

import os
import pickle
import subprocess
import sys
import uuid
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

from acausal import (
    Component,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    choose_states,
    eq,
    require,
    simulate,
    when,
)
from acausal._evaluate.building import system_of
from acausal._fingerprint import NoFingerprintError, fingerprint
from acausal._integrate import stored_run
from acausal._jax_settings import programs


def decay(
    *, rate: float = 1.0, slope: float = 1.0, level: float = 0.5, start: float = 1.0, most: float = 9.0
) -> type[Component]:
    """Classes of one name that differ in what their methods hold."""

    @jax.custom_jvp
    def same(x: Any) -> Any:
        return x

    same.defjvp(lambda x, dx: (same(*x), slope * dx[0]))

    class Decay(Component):
        k: Param[Scalar, "1/s"] = 1.0
        x: Var[Scalar, ""] = start

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(d.x, -self.k * rate * same(self.x)))

        def events(self) -> Events:
            return dict(renew=when(self.x < level, x=1.0))

        def requirements(self) -> Requirements:
            return (require(self.k < most, "k must be small"),)

    return Decay


def made_from(model: Component) -> str:
    return fingerprint(stored_run._system(system_of(model)))


CHANGES: dict[str, dict[str, float]] = {
    "a number in an equation": dict(rate=1.0 + 1e-15),
    "a derivative of its own": dict(slope=2.0),
    "a condition": dict(level=0.4),
    "a start value": dict(start=2.0),
    "a requirement": dict(most=8.0),
}


def test_the_same_stated_again_is_the_same() -> None:
    assert made_from(decay()()) == made_from(decay()(k=2.0))


@pytest.mark.parametrize("change", CHANGES)
def test_what_makes_another_program(change: str) -> None:
    assert made_from(decay(**CHANGES[change])()) != made_from(decay()())


def test_states_chosen_by_numbers_make_another_program() -> None:
    system = choose_states(rc())
    assert fingerprint(stored_run._system(system)) != made_from(rc())
    assert fingerprint(stored_run._system(system)) == fingerprint(stored_run._system(choose_states(rc())))


def test_a_function_has_no_fingerprint() -> None:
    def outside(x: Any) -> Any:
        return jax.pure_callback(np.sin, jax.ShapeDtypeStruct((), float), x)

    @jax.custom_vjp
    def reverse(x: Any) -> Any:
        return x

    reverse.defvjp(lambda x: (x, None), lambda _, g: (g,))
    for value in (outside, jax.make_jaxpr(outside)(1.0), jax.make_jaxpr(reverse)(1.0), Path()):
        with pytest.raises(NoFingerprintError):
            fingerprint(value)


@pytest.mark.parametrize("inside", [lambda x: x + 1.0, lambda x: jnp.asarray([1.0, 2.0]) @ jnp.stack([x, x])])
def test_numbers_in_programs_called_count(inside: Callable[[Any], Any]) -> None:
    other: Callable[[Any], Any] = lambda x: inside(2.0 * x)  # noqa: E731
    first, again, another = (jax.make_jaxpr(jax.jit(f))(1.0) for f in (inside, lambda x: inside(x), other))
    assert fingerprint(first) == fingerprint(again) != fingerprint(another)


def test_a_program_is_stored_read_and_made_again_where_it_is_spoilt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    versions = str(uuid.uuid4())
    monkeypatch.setattr(programs, "folder", tmp_path)
    monkeypatch.setattr(stored_run, "_versions", lambda: versions)  # so that jax has compiled no such program
    options: dict[str, Any] = dict(
        until=lambda s: s.c.v - 2.0, integrals=lambda s: dict(v=s.c.v), peaks=lambda s: s.c.v
    )

    def run() -> Any:
        stored_run._program.cache_clear()
        return simulate(rc(), 1.0, **options)

    first = run()
    (file,) = tmp_path.iterdir()
    monkeypatch.setattr(stored_run, "_compiled", None)
    second = run()
    assert jax.tree.structure(first) == jax.tree.structure(second)
    jax.tree.map(np.testing.assert_array_equal, first, second)
    assert second.system is first.system
    np.testing.assert_allclose(second["c.v"][-1], 2.0, rtol=1e-9)
    # One that is to be differentiated, or is part of a function that is compiled, is traced as ever.
    assert jax.make_jaxpr(lambda: simulate(rc(), 1.0, save="end").final.c.v)().eqns
    assert jax.grad(lambda t: simulate(rc(), t, save="end").final.c.v)(0.1) > 0.0
    monkeypatch.undo()
    monkeypatch.setattr(programs, "folder", tmp_path)
    monkeypatch.setattr(stored_run, "_versions", lambda: versions)
    file.write_bytes(pickle.dumps("spoilt"))
    assert run().t1 == first.t1


WITH_LAPACK = """
import jax.numpy as jnp
from acausal import Component, Param, Var, Vector, eq, shape, simulate
class Chain(Component):
    A: Param[Vector, "s"]
    x: Var[Vector, "1", shape(3)] = 1.0
    def equations(self, d):
        return dict(decay=eq(jnp.linalg.solve(self.A, d.x), -self.x))
print(simulate(Chain(A=jnp.diag(jnp.array([1.0, 2.0, 3.0]))), 1.0, rtol=1e-8, save="end").final.x)
"""


def test_a_program_with_lapack_runs_in_a_second_process(tmp_path: Path) -> None:
    """Nothing has loaded that library in it, as compiling does."""
    environment = {**os.environ, "ACAUSAL_CACHE": str(tmp_path)}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    said = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", WITH_LAPACK], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        said.append(done.stdout)
    assert said[0] == said[1]
    (file,) = tmp_path.glob("run-*-program")
    assert b"lapack_" in zlib.decompress(file.read_bytes())
