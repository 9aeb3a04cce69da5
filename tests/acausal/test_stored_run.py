"""Keys of stored programs, and cases without one."""

import dataclasses
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
from _models import gear_train, rc
from jax.extend.core import Primitive

from acausal import (
    Component,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    SimulationError,
    Var,
    _program_files,
    choose_states,
    eq,
    require,
    simulate,
    when,
)
from acausal._evaluate.building import system_of
from acausal._evaluate.groups import ModelParameters
from acausal._evaluate.starts import Inputs
from acausal._fingerprint import NoFingerprintError, fingerprint
from acausal._integrate.programs import program_digest, stored_program
from acausal._interpret import in_parts, program
from acausal._jax_settings import programs

pytestmark = pytest.mark.interpreted


def decay(
    *, rate: float = 1.0, slope: float = 1.0, level: float = 0.5, start: float = 1.0, most: float = 9.0
) -> type[Component]:
    """Classes of one name that differ in what their methods hold."""

    @jax.custom_jvp
    def same(x: Scalar) -> Scalar:
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


def digest(model: Component) -> str:
    return fingerprint(program_digest.contents(system_of(model)))


CHANGES: dict[str, dict[str, Any]] = {
    "a number in an equation": dict(rate=1.0 + 1e-15),
    "a derivative of its own": dict(slope=2.0),
    "a condition": dict(level=0.4),
    "a start value": dict(start=2.0),
    "a requirement": dict(most=8.0),
}


def test_the_same_stated_again_is_the_same() -> None:
    assert digest(decay()()) == digest(decay()(k=2.0))  # pyright: ignore[reportCallIssue]


@pytest.mark.parametrize("change", CHANGES)
def test_what_makes_another_program(change: str) -> None:
    assert digest(decay(**CHANGES[change])()) != digest(decay()())


def test_states_chosen_by_numbers_make_another_program() -> None:
    system = choose_states(rc())
    assert fingerprint(program_digest.contents(system)) != digest(rc())
    assert fingerprint(program_digest.contents(system)) == fingerprint(program_digest.contents(choose_states(rc())))


def test_a_function_has_no_fingerprint() -> None:
    def outside(x: Scalar) -> Scalar:
        return jax.pure_callback(np.sin, jax.ShapeDtypeStruct((), float), x)

    @jax.custom_vjp
    def reverse(x: Scalar) -> Scalar:
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


def product(rule: Callable[[Any, Any], Any]) -> Any:
    """A program whose derivative is stated."""

    @jax.custom_jvp
    def f(x: Scalar, y: Scalar) -> Scalar:
        return x * y

    f.defjvp(lambda point, rates: (f(*point), rule(point, rates)))
    return jax.make_jaxpr(lambda x, y: f(x, y))(1.0, 2.0)


def second_order(slope: float) -> Scalar:
    """A program whose second derivative is stated, by a function that its first one calls."""
    return product(lambda point, rates: scaled(slope)(point[0]) * rates[0])


def scaled(slope: float) -> Callable[[Any], Any]:
    @jax.custom_jvp
    def g(x: Scalar) -> Scalar:
        return x

    g.defjvp(lambda point, rates: (g(*point), slope * rates[0]))
    return g


TABLE = np.arange(3000.0)
SPOILT = np.where(TABLE == 1500.0, 0.0, TABLE)

# Pairs that are alike: in what they hold but not how, in what they print, in what they are equal to.
ALIKE: dict[str, tuple[Any, ...]] = {
    "nested otherwise": ([1, (5,)], [(1,), 5]),
    "pairs or a dictionary": ([("a", 1)], {"a": 1}),
    "a tuple or a list": ((1, 2), [1, 2]),
    "a number or its text": (1, "1"),
    "integer or truth value": (1, True),
    "integer or float": (1, 1.0),
    "signs of zero": (0.0, -0.0),
    "signs of zero in arrays": (np.zeros(1), -np.zeros(1)),
    "no elements or none": (np.zeros(()), np.zeros(1)),
    "other shapes of nothing": (np.zeros((0, 2)), np.zeros((2, 0))),
    "single or double": (np.zeros(2), np.zeros(4, np.float32)),
    "order of bytes": (np.zeros(1, ">f8"), np.zeros(1, "<f8")),
    "order of a dictionary": ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
    "the middle of a long array": (TABLE, SPOILT),
    "the middle of a long array that a program holds": tuple(
        jax.make_jaxpr(jax.jit(lambda x, table=table: x * table))(1.0) for table in (TABLE, SPOILT)
    ),
    "which number a derivative is along": (product(lambda p, r: p[1] * r[0]), product(lambda p, r: r[1] * p[0])),
    "a derivative of a derivative": (second_order(1.0), second_order(2.0)),
}


@pytest.mark.parametrize("case", ALIKE)
def test_what_is_alike_is_told_apart(case: str) -> None:
    assert len({fingerprint(one) for one in ALIKE[case]}) == 2


class Seven(float):
    """A number that prints as another one."""

    def __repr__(self) -> str:
        return "7.0"


@jax.custom_batching.custom_vmap
def batched(x: Scalar) -> Scalar:
    return x


batched.def_vmap(lambda n, is_batched, x: (2.0 * x, True))
FOREIGN = Primitive("sin")  # by name; what it computes stands in its rules
FOREIGN.def_abstract_eval(lambda x: x)
UNTOLD: dict[str, Callable[[], Any]] = {
    "a rule for batches": lambda: jax.make_jaxpr(lambda x: batched(x))(1.0),
    "a primitive of somebody else's": lambda: jax.make_jaxpr(lambda x: FOREIGN.bind(x))(1.0),
    "keys of random numbers": lambda: jax.random.key(0),
    "objects in an array": lambda: np.array([object()]),
    "what prints as it likes": lambda: Seven(1.0),
    "what is printed": lambda: jax.make_jaxpr(lambda x: (jax.debug.print("{}", x), x))(1.0),
}


@pytest.mark.parametrize("case", UNTOLD)
def test_what_may_hold_anything_has_no_fingerprint(case: str) -> None:
    with pytest.raises(NoFingerprintError):
        fingerprint(UNTOLD[case]())


def test_what_has_no_derivative_does_not_fail() -> None:
    """An integer has none, nor has a function whose own rule fails."""

    @jax.custom_jvp
    def times(x: Scalar, n: Any) -> Any:
        return x * n

    times.defjvp(lambda point, rates: (times(*point), rates[0] * point[1]))
    assert fingerprint(jax.make_jaxpr(lambda x, n: times(x, n))(1.0, 2))
    with pytest.raises(NoFingerprintError, match="a failing derivative"):
        fingerprint(product(lambda point, rates: 1 / 0))


def test_settings_of_the_moment_keep_a_run_from_being_stored() -> None:
    assert in_parts.is_usual()
    with jax.numpy_rank_promotion("raise"):
        assert not in_parts.is_usual()
    with jax.debug_nans(True):
        assert not in_parts.is_usual()
    assert in_parts.is_usual()


def test_files_are_read_where_nobody_else_can_have_written_them(tmp_path: Path) -> None:
    file, other = tmp_path / "a-program", tmp_path / "b-program"
    assert _program_files.read(file) is None
    _program_files.write(file, b"program")
    assert _program_files.read(file) == b"program"
    assert _program_files.is_own(file.stat())
    assert file.stat().st_mode & 0o077 == 0
    other.write_bytes(file.read_bytes())
    other.chmod(0o600)
    assert _program_files.read(other) is None  # is another run's
    file.chmod(0o620)
    assert _program_files.read(file) is None
    with pytest.raises(OSError, match="Is a directory"):
        _program_files.write(tmp_path, b"program")
    assert sorted(tmp_path.iterdir()) == [file, other]  # no part is left behind
    assert not list(tmp_path.parent.glob("*-part-program"))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("saves", "last", "rtol"),
    [
        ({}, 2.0, 1e-9),
        (dict(save=[0.0, 0.02, 0.5]), 5.0 * (1.0 - np.exp(-0.2)), 1e-5),
        (dict(save="dense", dt0=1e-3), 2.0, 1e-9),
    ],
)
def test_a_program_is_stored_read_and_made_again_where_it_is_spoilt(
    saves: dict[str, Any], last: float, rtol: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = str(uuid.uuid4())
    monkeypatch.setattr(programs, "folder", tmp_path)
    monkeypatch.setattr(program_digest, "machine", lambda: other)  # so that jax has compiled no such program
    options: dict[str, Any] = dict(
        until=lambda s: s.c.v - 2.0, integrals=lambda s: dict(v=s.c.v), peaks=lambda s: s.c.v, **saves
    )

    def run() -> Any:
        stored_program._program.cache_clear()
        solution = simulate(rc(), 1.0, **options)
        np.testing.assert_allclose(solution["c.v"][-1], last, rtol=rtol)
        return solution

    monkeypatch.setattr(program, "PAYS", 10**9)
    first = run()
    files = sorted(tmp_path.iterdir())
    read = ["reading"] if "save" in saves and not isinstance(saves["save"], str) else []
    assert [file.name.partition("-")[0] for file in files] == ["end", *read, "start", "steps", "trajectories"]
    with monkeypatch.context() as patch:
        patch.setattr(stored_program, "traced", None)
        second = run()
    assert jax.tree.structure(first) == jax.tree.structure(second)
    jax.tree.map(np.testing.assert_array_equal, first, second)
    assert second.system is first.system
    # One that is to be differentiated, or is part of a function that is compiled, is not this program.
    assert jax.make_jaxpr(lambda: simulate(rc(), 1.0, save="end").final.c.v)().eqns
    assert jax.grad(lambda t: simulate(rc(), t, save="end").final.c.v)(0.1) > 0.0
    monkeypatch.setattr(program, "PAYS", 2)
    t1 = pytest.approx(float(first.t1), rel=1e-12)
    assert float(run().t1) == t1
    n_files = len(files)
    files = sorted(tmp_path.iterdir())
    assert len(files) > n_files  # with compiled parts
    for spoilt in (pickle.dumps("spoilt"), files[0].read_bytes()[:-1], b""):
        for file in files:
            file.write_bytes(spoilt)
        assert float(run().t1) == t1
    for file in files:
        _program_files.write(file, b"no program")
    assert float(run().t1) == t1


def test_a_start_that_fails_takes_no_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """So their program is not made, either."""
    made, whole = [], stored_program.traced

    def noted(function: Any, *others: Any) -> Any:
        made.append(function.name)
        return whole(function, *others)

    monkeypatch.setattr(stored_program, "traced", noted)
    stored_program._program.cache_clear()
    with pytest.raises(SimulationError, match="cannot have the value it is given"):
        simulate(gear_train(2.0, w1=3.0, w2=5.0), 0.1)
    failed = simulate(gear_train(2.0, w1=3.0, w2=5.0), 0.1, throw=False)
    assert failed.ts.tolist() == [0.0]
    assert failed.stats["num_steps"] == 0
    assert "start" in made
    assert "steps" not in made


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


@pytest.mark.thorough
def test_the_key_of_a_structure_does_not_depend_on_the_order_of_its_sets() -> None:
    sets = [frozenset(pair) for pair in ((0, 8), (8, 0))]
    inputs = [Inputs(ModelParameters(), jnp.zeros(2), given) for given in sets]
    same, also = map(jax.tree.structure, inputs)
    assert (str(same) != str(also), same == also) == (True, True)
    other = jax.tree.structure(dataclasses.replace(inputs[0], given=frozenset((0, 1))))
    keys = [program_digest.key_of([], structure, ()) for structure in (same, also, other)]
    assert keys[0] == keys[1] != keys[2]


def test_a_program_with_lapack_runs_in_a_second_process(tmp_path: Path) -> None:
    """Nothing has loaded that library in it, as compiling does."""
    environment = {**os.environ, "ACAUSAL_CACHE": str(tmp_path), "ACAUSAL_OPTIMISE": "on"}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    said = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", WITH_LAPACK], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        said.append(done.stdout)
    assert said[0] == said[1]
    (file,) = tmp_path.glob("steps-*-whole-optimised-program")
    content = _program_files.read(file)
    assert content
    assert b"lapack_" in zlib.decompress(content)


AT_THE_END = """
import atexit
from acausal import Component, Scalar, Var, eq, simulate
class Decay(Component):
    x: Var[Scalar, "1"] = 1.0
    def equations(self, d):
        return dict(decay=eq(d.x, -self.x, check_units=False))
atexit.register(lambda: print(simulate(Decay(), 1.0, save="end").final.x))
"""


def test_a_first_run_while_the_interpreter_ends(tmp_path: Path) -> None:
    """Its programs are compiled, though no thread starts any more."""
    environment = {**os.environ, "ACAUSAL_CACHE": str(tmp_path), "ACAUSAL_OPTIMISE": "on"}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    done = subprocess.run([sys.executable, "-c", AT_THE_END], env=environment, capture_output=True, text=True)
    assert done.stdout.startswith("0.3678"), done.stderr
    assert len(list(tmp_path.glob("*-program"))) >= 3
