"""Loops and choices, evaluated by NumPy, against XLA."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from acausal._interpret.interpreter import JaxprInterpreter, as_numpy
from acausal._interpret.simplify import simplified
from acausal._jax_private import NAMED_PRIMITIVES


def interpreted(function: Callable[..., Any], *values: Any) -> list[Any]:
    closed = simplified(jax.make_jaxpr(function)(*values))
    with np.errstate(all="ignore"):
        return JaxprInterpreter().closed(closed)(*map(as_numpy, jax.tree.leaves(values)))


def assert_agrees(function: Callable[..., Any], *values: Any) -> None:
    expected = jax.tree.leaves(jax.jit(function)(*values))
    for found, x in zip(interpreted(function, *values), expected, strict=True):
        assert (found.shape, found.dtype) == (x.shape, x.dtype)
        assert type(found) is np.ndarray if x.shape else isinstance(found, np.generic)
        np.testing.assert_allclose(found, x, rtol=1e-13, atol=1e-15)


def collatz(n: Any) -> Any:
    """Steps of Collatz's sequence to 1, and the largest number on the way."""

    def step(state: Any) -> Any:
        n, steps, most = state
        n = jnp.where(n % 2 == 0, n // 2, 3 * n + 1)
        return n, steps + 1, jnp.maximum(most, n)

    return lax.while_loop(lambda state: state[0] != 1, step, (n, 0, n))


def summed(xs: Any, reverse: bool) -> Any:
    return lax.scan(lambda total, x: (total + x[0], (total * x[1], total > 1.0)), 0.5, xs, reverse=reverse)


def newton(x: Any, a: Any) -> Any:
    """A loop with constants in its condition and in its body, part of which stays the same."""
    most = jnp.sin(a) + 2.0
    return lax.while_loop(
        lambda s: (jnp.abs(s[0] ** 2 - jnp.exp(a)) > 1e-12) & (s[1] < most * 40),
        lambda s: (s[0] - (s[0] ** 2 - jnp.exp(a)) / (2 * s[0]), s[1] + 1),
        (x, 0),
    )


def nested(x: Any) -> Any:
    def outer(i: Any, x: Any) -> Any:
        inner = lax.fori_loop(0, i, lambda j, y: y + jnp.sin(y) / (j + 1), x)
        return lax.cond(
            inner > 2.0, lambda y: y / 2, lambda y: lax.scan(lambda c, k: (c * k, c), y, jnp.ones(2))[0], inner
        )

    return lax.fori_loop(0, 5, outer, x)


CASES: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "while": (collatz, (27,)),
    "while without an iteration": (collatz, (1,)),
    "batch of whiles": (jax.vmap(collatz), (np.array([27, 1, 6, 97]),)),
    "empty batch of whiles": (jax.vmap(collatz), (np.zeros(0, int),)),
    "batch of batches": (jax.vmap(jax.vmap(collatz)), (np.array([[27, 1], [6, 97]]),)),
    "while with constants": (newton, (2.0, 0.3)),
    "batch of whiles with constants": (jax.vmap(newton, (None, 0)), (2.0, np.array([0.3, 2.0, 5.0]))),
    "scan": (lambda xs: summed(xs, False), ((np.arange(4.0), np.ones(4)),)),
    "scan in reverse": (lambda xs: summed(xs, True), ((np.arange(4.0), np.ones(4)),)),
    "scan of length 0": (lambda xs: summed(xs, True), ((np.zeros(0), np.zeros(0)),)),
    "scan of rows": (
        lambda x: lax.scan(lambda c, row: (c @ row, (row[::-1], c)), x[0], jnp.stack([x, x.T])),
        (np.arange(9.0).reshape(3, 3) / 9,),
    ),
    "scan without rows": (lambda x: lax.scan(lambda c, _: (c * 2, c), x, None, length=3), (np.float32(1.5),)),
    "nest": (nested, (0.7,)),
    "batch of nests": (jax.vmap(nested), (np.array([0.7, -2.0, 1.3]),)),
    "derivative of a scan": (jax.grad(lambda x: summed((x, x), False)[0]), (np.arange(4.0),)),
    "derivative of a loop": (lambda x: jax.jvp(nested, (x,), (1.0,)), (0.7,)),
}


@pytest.mark.parametrize("case", CASES)
def test_loops(case: str) -> None:
    function, values = CASES[case]
    assert_agrees(function, *values)


@pytest.mark.parametrize("index", [-7, -1, 0, 1, 2, 3, 100])
def test_choices_out_of_range(index: int) -> None:
    def chosen(i: Any, x: Any) -> Any:
        return lax.switch(i, [jnp.sin, jnp.cos, lambda x: x * 3], x)

    def unclamped(i: Any, x: Any) -> Any:
        branches = tuple(jax.make_jaxpr(f)(x) for f in (jnp.sin, jnp.cos, lambda x: x * 3))
        return NAMED_PRIMITIVES["cond"].bind(i, x, branches=branches)

    i = np.int32(index)
    for function in (chosen, unclamped):
        assert_agrees(function, i, 0.4)
        assert_agrees(lambda x, f=function: f(i, x), 0.4)  # known already


def test_what_has_no_rule_is_compiled() -> None:
    a = np.array([[4.0, 1.0], [1.0, 3.0]])
    assert_agrees(lambda a: (jnp.linalg.cholesky(a), *jnp.linalg.eigh(a), jax.scipy.special.gammaln(a)), a)
    assert_agrees(lambda a: jnp.linalg.solve(jnp.stack([a, a + 1]), jnp.ones((2, 2, 1))), a)
    assert_agrees(lambda x: jnp.lexsort((x, x[::-1])), np.array([3.0, 1.0, 3.0, 2.0]))
    assert_agrees(lambda x: lax.reduce_precision(x, 8, 23), np.array([1 / 3]))


def test_equations_are_counted() -> None:
    interpreter = JaxprInterpreter()
    closed = simplified(jax.make_jaxpr(lambda x: lax.fori_loop(0, 10, lambda i, y: jnp.sin(y) + y, x))(1.0))
    interpreter.closed(closed)(np.float64(1.0))
    assert interpreter.spent > 30


def test_a_loop_goes_on_where_it_is_as_a_compiled_one() -> None:
    """After any number of iterations."""
    closed = simplified(jax.make_jaxpr(collatz)(27))
    (eqn,) = (eqn for eqn in closed.jaxpr.eqns if eqn.primitive.name == "while")
    compiled = jax.jit(lambda *values: eqn.primitive.bind(*values, **eqn.params))

    class Switching:
        def __init__(self, after: int) -> None:
            self.left, self.spent = after, 0

        def compiled(self) -> Any:
            self.left -= 1
            return compiled if self.left < 0 else None

        def spend(self, n: int) -> None:
            self.spent += n

    for after in (0, 1, 17, 110, 111, 112, 1000):
        interpreter, loop = JaxprInterpreter(), Switching(after)
        interpreter.loops[id(eqn)] = loop
        found = interpreter.closed(closed)(np.int64(27))
        assert [x.dtype for x in found] == [np.dtype(int)] * 3
        np.testing.assert_array_equal(found, [1, 111, 9232])
        assert (loop.spent > 0) == (after > 0)
