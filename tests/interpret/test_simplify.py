"""Simplified jaxprs give the results of the functions."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _functions import CALLING, FUNCTIONS, twice
from jax import lax
from jax.experimental import io_callback

from acausal._interpret.interpreter import JaxprInterpreter, as_numpy
from acausal._interpret.simplify import CALLS, IDENTITIES, NotPlainError, simplified
from acausal._interpret.tape import NotStorableError, tape_of
from acausal._jax_private import NAMED_PRIMITIVES, ClosedJaxpr, jaxpr_as_fun


def all_equations(closed: ClosedJaxpr) -> list[Any]:
    found = []
    for eqn in closed.jaxpr.eqns:
        found.append(eqn)
        for value in eqn.params.values():
            for inner in value if isinstance(value, tuple) else (value,):
                if isinstance(inner, ClosedJaxpr):
                    found += all_equations(inner)
    return found


def assert_equal_results(found: Any, expected: Any) -> None:
    for a, b in zip(found, jax.tree.leaves(expected), strict=True):
        assert (a.shape, a.dtype) == (b.shape, b.dtype)
        np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("case", [*FUNCTIONS, *CALLING])
def test_results_are_those_of_the_function(case: str) -> None:
    """Interpreted, and compiled."""
    function, values = (FUNCTIONS | CALLING)[case]
    expected = jax.jit(function)(*values)
    closed = simplified(jax.make_jaxpr(function)(*values))
    names = {eqn.primitive.name for eqn in all_equations(closed)}
    assert not names & {*CALLS, *IDENTITIES, "custom_linear_solve", "unvmap_any", "unvmap_all", "unvmap_max"}
    assert names <= {*NAMED_PRIMITIVES, "pure_callback", "noinline"}
    with np.errstate(all="ignore"):
        assert_equal_results(JaxprInterpreter().closed(closed)(*map(as_numpy, values)), expected)
    assert_equal_results(jax.jit(jaxpr_as_fun(closed))(*values), expected)


def test_equal_equations_occur_once_and_unused_ones_not_at_all() -> None:
    closed = simplified(jax.make_jaxpr(twice)(0.3, 2.0))
    names = [eqn.primitive.name for eqn in closed.jaxpr.eqns]
    assert names.count("sin") == 2  # of x y and y x
    assert not {"exp", "while"} & set(names)


def test_literals_of_other_types_and_signs_differ() -> None:
    def function(x: Any) -> Any:
        return x * 0.0, x * -0.0, lax.convert_element_type(x, np.float32) * 0.0

    closed = simplified(jax.make_jaxpr(function)(2.0))
    found = JaxprInterpreter().closed(closed)(np.float64(2.0))
    assert [bool(np.signbit(value)) for value in found] == [False, True, False]


def test_arrays_changed_afterwards_do_not_count() -> None:
    """A part that is compiled later has the same constants as one that is interpreted."""
    table, one = np.arange(3.0), np.array(7.0)

    def function(x: Any) -> Any:
        inner = lax.fori_loop(0, 3, lambda i, y: y + jnp.asarray(table)[i], x)
        return jnp.interp(x, np.arange(3.0), table) + x * one, inner

    closed = simplified(jax.make_jaxpr(function)(0.5))
    table[:], one[...] = 100.0, 100.0
    for run in (JaxprInterpreter().closed(closed), jaxpr_as_fun(closed)):
        assert list(map(float, run(np.float64(0.5)))) == [0.5 + 3.5, 0.5 + 3.0]


def test_an_unused_inner_result_stays() -> None:
    """The body of a loop returns all it carries."""

    def function(x: Any) -> Any:
        return lax.fori_loop(0, 3, lambda i, s: (s[0] + 1.0, s[1] * 2.0), (x, x))[0]

    closed = simplified(jax.make_jaxpr(function)(2.0))
    assert JaxprInterpreter().closed(closed)(np.float64(2.0)) == [5.0]


def printing(x: Any) -> Any:
    jax.debug.print("{}", x)
    return x + 1.0


def in_a_loop(x: Any) -> Any:
    return lax.fori_loop(0, 3, lambda i, y: printing(y), x)


def with_callback(x: Any) -> Any:
    return io_callback(lambda y: y, jax.ShapeDtypeStruct((), float), x)


@pytest.mark.parametrize("function", [printing, jax.jit(printing), in_a_loop, with_callback])
def test_effects_are_refused(function: Any) -> None:
    with pytest.raises(NotPlainError):
        simplified(jax.make_jaxpr(function)(1.0))


def test_pure_functions_of_python_are_called() -> None:
    def function(x: Any) -> Any:
        return jax.pure_callback(lambda y: np.sin(y), jax.ShapeDtypeStruct((), float), x) + 1.0

    for f in (function, lambda x: lax.fori_loop(0, 3, lambda i, y: function(y), x)):
        closed = simplified(jax.make_jaxpr(f)(1.0))
        np.testing.assert_allclose(JaxprInterpreter().closed(closed)(np.float64(1.0)), [jax.jit(f)(1.0)], rtol=1e-14)
        with pytest.raises(NotStorableError, match="pure_callback"):
            tape_of(closed)


def test_values_that_numpy_does_not_have_are_refused() -> None:
    """Keys of random numbers."""
    key = jax.random.key(0)

    def inside(x: Any) -> Any:
        return lax.fori_loop(0, 3, lambda i, y: y + jax.random.uniform(jax.random.PRNGKey(i)), x)

    for function in (inside, lambda x: x + jax.random.normal(key)):
        with pytest.raises(NotPlainError):
            simplified(jax.make_jaxpr(function)(1.0))
    with pytest.raises(NotPlainError):
        simplified(jax.make_jaxpr(lambda key: jax.random.split(key))(key))
    with pytest.raises(NotPlainError):
        simplified(jax.make_jaxpr(lambda x: x.astype(jnp.bfloat16) * 2)(1.0))
