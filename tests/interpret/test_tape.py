"""Jaxprs as data, read in the same and in another process."""

import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _functions import CALLING, FUNCTIONS
from jax.extend.core import Primitive
from jax.interpreters import mlir

from acausal._interpret.interpreter import JaxprInterpreter, as_numpy
from acausal._interpret.simplify import simplified
from acausal._interpret.tape import NotStorableError, closed_of, tape_of
from acausal._jax_private import ClosedJaxpr, jaxpr_as_fun, new_equation


def jaxpr_of(case: str) -> ClosedJaxpr:
    function, values = FUNCTIONS[case]
    return simplified(jax.make_jaxpr(function)(*values))


def results(closed: ClosedJaxpr, values: Any) -> list[Any]:
    with np.errstate(all="ignore"):
        return JaxprInterpreter().closed(closed)(*map(as_numpy, values))


def assert_same(found: list[Any], expected: list[Any]) -> None:
    for a, b in zip(found, expected, strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("case", FUNCTIONS)
def test_a_jaxpr_is_read_as_it_was_written(case: str) -> None:
    closed, values = jaxpr_of(case), FUNCTIONS[case][1]
    read = closed_of(pickle.loads(pickle.dumps(tape_of(closed))))
    assert [str(aval) for aval in read.in_avals] == [str(aval) for aval in closed.in_avals]
    assert [str(aval) for aval in read.out_avals] == [str(aval) for aval in closed.out_avals]
    texts = [re.sub(r"np\.int64\((\d+)\)", r"\1", str(jaxpr)) for jaxpr in (read, closed)]
    assert texts[0] == texts[1]  # except that parameters that compare equal are written once
    assert_same(results(read, values), results(closed, values))
    assert pickle.dumps(tape_of(read)) == pickle.dumps(tape_of(closed_of(tape_of(read))))


READ = """
import pickle, sys
import numpy as np
from acausal._interpret.interpreter import JaxprInterpreter
from acausal._interpret.tape import closed_of
with open(sys.argv[1], "rb") as file:
    tapes = pickle.load(file)
with np.errstate(all="ignore"):
    found = {name: JaxprInterpreter().closed(closed_of(tape))(*values) for name, (tape, values) in tapes.items()}
with open(sys.argv[2], "wb") as file:
    pickle.dump(found, file)
"""


def test_another_process_gets_the_same_numbers(tmp_path: Path) -> None:
    values = {case: list(map(as_numpy, FUNCTIONS[case][1])) for case in FUNCTIONS}
    written, answer = tmp_path / "tapes", tmp_path / "answer"
    written.write_bytes(pickle.dumps({case: (tape_of(jaxpr_of(case)), values[case]) for case in FUNCTIONS}))
    done = subprocess.run([sys.executable, "-c", READ, written, answer], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = pickle.loads(answer.read_bytes())
    for case in FUNCTIONS:
        assert_same(found[case], results(jaxpr_of(case), values[case]))


def test_a_read_jaxpr_is_compiled() -> None:
    for case in ("nest", "partly read", "lineax"):
        read = closed_of(tape_of(jaxpr_of(case)))
        values = FUNCTIONS[case][1]
        for a, b in zip(jax.jit(jaxpr_as_fun(read))(*values), results(read, values), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13)


@pytest.mark.parametrize("case", CALLING)
def test_what_calls_python_is_not_stored(case: str) -> None:
    function, values = CALLING[case]
    with pytest.raises(NotStorableError, match=r"pure_callback|noinline"):
        tape_of(simplified(jax.make_jaxpr(function)(*values)))


def new_primitive() -> Primitive:
    primitive = Primitive("unknown")
    primitive.def_abstract_eval(lambda x: x)
    mlir.register_lowering(primitive, mlir.lower_fun(jnp.sin, multiple_results=False))
    return primitive


def test_an_unknown_primitive_is_not_stored() -> None:
    """Nor is one that has the name of another."""
    (sine,) = (closed := jax.make_jaxpr(jnp.sin)(1.0)).jaxpr.eqns
    for name in ("unknown", "sin"):
        primitive = new_primitive()
        primitive.name = name
        eqn = new_equation(sine.invars, sine.outvars, primitive, {})
        with pytest.raises(NotStorableError, match=name):
            tape_of(ClosedJaxpr(closed.jaxpr.replace(eqns=[eqn]), ()))


def test_a_type_without_a_name_in_numpy_is_not_stored() -> None:
    closed = jax.make_jaxpr(lambda x: x.astype(jnp.bfloat16))(1.0)
    with pytest.raises(NotStorableError, match="bfloat16"):
        tape_of(closed)
