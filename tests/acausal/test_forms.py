"""The dependence of equations on their unknowns, against derivatives of the same expressions computed here."""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from acausal import Scalar
from acausal._reduce.forms import ANY, POSITIVE, Form, constant, interpret, parameter, variable

N_UNKNOWNS, N_PARAMS = 3, 2
LARGEST = 1e4  # beyond, rounding blurs the comparison


class Dual(NamedTuple):
    """A value with its derivatives by the unknowns."""

    value: float
    slopes: np.ndarray

    def mapped(self, value: float, slope: float) -> "Dual":
        return Dual(value, slope * self.slopes)


Expression = tuple  # ("unknown" or "param", number), ("constant", value), or an operation with its operands
UNARY = {
    "neg": (lambda a: -a, lambda d: d.mapped(-d.value, -1.0)),
    "exp": (jnp.exp, lambda d: d.mapped(np.exp(d.value), np.exp(d.value))),
    "tanh": (jnp.tanh, lambda d: d.mapped(np.tanh(d.value), 1.0 / np.cosh(d.value) ** 2)),
}
BINARY: dict[str, tuple[Callable[..., Any], Callable[[Dual, Dual], Dual]]] = {
    "+": (lambda a, b: a + b, lambda a, b: Dual(a.value + b.value, a.slopes + b.slopes)),
    "-": (lambda a, b: a - b, lambda a, b: Dual(a.value - b.value, a.slopes - b.slopes)),
    "*": (lambda a, b: a * b, lambda a, b: Dual(a.value * b.value, a.slopes * b.value + a.value * b.slopes)),
    "/": (
        lambda a, b: a / b,
        lambda a, b: Dual(a.value / b.value, a.slopes / b.value - a.value / b.value**2 * b.slopes),
    ),
}

# Binary fractions, so that numbers found by adding and multiplying are exact.
leaves = st.one_of(
    st.tuples(st.just("unknown"), st.integers(0, N_UNKNOWNS - 1)),
    st.tuples(st.just("param"), st.integers(0, N_PARAMS - 1)),
    st.tuples(st.just("constant"), st.sampled_from([-2.0, -1.0, 0.0, 0.5, 1.0, 4.0])),
)
expressions = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(st.sampled_from(sorted(UNARY)), inner),
        st.tuples(st.sampled_from(sorted(BINARY)), inner, inner),
        st.tuples(st.just("pow"), inner, st.integers(-2, 3)),
    ),
    max_leaves=8,
)


def in_jax(e: Expression, inputs: Any) -> Any:
    match e:
        case ("unknown", i):
            return inputs[i]
        case ("param", i):
            return inputs[N_UNKNOWNS + i]
        case ("constant", c):
            return c
        case ("pow", a, n):
            return jnp.asarray(in_jax(a, inputs)) ** n
        case (op, a):
            return UNARY[op][0](in_jax(a, inputs))
        case (op, a, b):
            return BINARY[op][0](jnp.asarray(in_jax(a, inputs)), in_jax(b, inputs))
    raise AssertionError(e)


def by_hand(e: Expression, inputs: np.ndarray) -> Dual:
    """Value and slopes in forward mode; the example is dropped where they are too large to be compared."""
    match e:
        case ("unknown", i):
            return Dual(float(inputs[i]), np.eye(N_UNKNOWNS)[i])
        case ("param", i):
            return Dual(float(inputs[N_UNKNOWNS + i]), np.zeros(N_UNKNOWNS))
        case ("constant", c):
            return Dual(c, np.zeros(N_UNKNOWNS))
        case ("pow", a, n):
            d = by_hand(a, inputs)
            assume(n >= 0 or d.value != 0)
            result = d.mapped(d.value**n, n * d.value ** (n - 1) if n else 0.0)
        case (op, a):
            result = UNARY[op][1](by_hand(a, inputs))
        case (op, a, b):
            left, right = by_hand(a, inputs), by_hand(b, inputs)
            assume(op != "/" or right.value != 0)
            result = BINARY[op][1](left, right)
        case _:
            raise AssertionError(e)
    assume(np.max(np.abs([result.value, *result.slopes])) < LARGEST)
    assume(result.value == 0 or abs(result.value) > 1e-9)
    return result


def form_of(function: Callable[..., Any], shapes: Any = ((),) * (N_UNKNOWNS + N_PARAMS)) -> Form:
    """The form of a function of three unknowns and two positive parameters."""
    forms = [variable(i) for i in range(N_UNKNOWNS)] + [parameter(POSITIVE)] * N_PARAMS
    closed = jax.make_jaxpr(lambda *inputs: jnp.asarray(function(*inputs), float))(
        *(jax.ShapeDtypeStruct(shape, jnp.float64) for shape in shapes)
    )
    return interpret(closed, forms[: len(shapes)])[0]


def points() -> np.ndarray:
    """Unknowns of either sign and zero, positive parameters."""
    unknowns = list(itertools.product((-1.1, 0.0, 0.7), repeat=N_UNKNOWNS))
    params = np.array([[0.3, 1.9], [1.4, 0.6]])
    return np.array([[*u, *params[i % 2]] for i, u in enumerate(unknowns)])


def close(a: Scalar, b: Scalar) -> bool:
    return np.allclose(a, b, rtol=1e-10, atol=1e-8)


@pytest.mark.thorough
@settings(max_examples=150, deadline=None, derandomize=True)
@given(expressions)
def test_forms_of_random_expressions(e: Expression) -> None:
    form = form_of(lambda *inputs: in_jax(e, inputs))
    for point in points():
        try:
            dual = by_hand(e, point)
        except (OverflowError, ZeroDivisionError):
            continue
        assert int(np.sign(dual.value)) in form.signs
        assert form.number is None or close(dual.value, form.number)
        for i in range(N_UNKNOWNS):
            check_unknown(form, i, dual.slopes[i])
        if not form.has_rest and not form.nonlinear:
            assert close(dual.value, dual.slopes @ point[:N_UNKNOWNS])


def check_unknown(form: Form, i: int, slope: float) -> None:
    coefficient = form.terms.get(i)
    if i not in form.inputs:
        assert close(slope, 0.0)
    elif coefficient is not None:
        assert coefficient.number is None or close(slope, coefficient.number)
        assert not coefficient.cannot_vanish or slope != 0.0
        if abs(slope) > 1e-8:
            assert int(np.sign(slope)) in coefficient.signs


@pytest.mark.thorough
@settings(max_examples=300, deadline=None, derandomize=True)
@given(expressions, st.integers(0, N_UNKNOWNS - 1), st.integers(0, N_UNKNOWNS - 1))
def test_coefficients_depend_on_nothing_else(e: Expression, i: int, moved: int) -> None:
    """The slope of a linear unknown depends only on the inputs named by its coefficient, and not on the unknown."""
    coefficient = form_of(lambda *inputs: in_jax(e, inputs)).terms.get(i)
    if coefficient is None or moved in coefficient.on:
        return
    assert i not in coefficient.on
    there = points() + 0.37 * np.eye(N_UNKNOWNS + N_PARAMS)[moved]
    for here, other in zip(points(), there, strict=True):
        assert close(by_hand(e, here).slopes[i], by_hand(e, other).slopes[i])


class Expected(NamedTuple):
    """The form of the first unknown."""

    kind: str  # "number", "regular" (its coefficient cannot vanish), "linear" or "nonlinear"
    number: float | None = None


LAWS: dict[str, tuple[Callable[..., Any], Expected]] = {
    "sum": (lambda x, y, z, p, q: x - y, Expected("number", 1.0)),
    "subtrahend": (lambda x, y, z, p, q: y - x, Expected("number", -1.0)),
    "halved": (lambda x, y, z, p, q: x / 2.0 + y, Expected("number", 0.5)),
    "twice": (lambda x, y, z, p, q: x + y + x, Expected("number", 2.0)),
    "to the first": (lambda x, y, z, p, q: x**1, Expected("number", 1.0)),
    "by jit": (lambda x, y, z, p, q: jax.jit(lambda a: 3.0 * a)(x), Expected("number", 3.0)),
    "positive factor": (lambda x, y, z, p, q: p * x, Expected("regular")),
    "positive sum": (lambda x, y, z, p, q: (1.0 + p * q) * x, Expected("regular")),
    "exponential": (lambda x, y, z, p, q: x * jnp.exp(y - z), Expected("regular")),
    "one plus a square": (lambda x, y, z, p, q: x / (1.0 + y**2), Expected("regular")),
    "negative": (lambda x, y, z, p, q: -x * (p + q) - x, Expected("regular")),
    "difference": (lambda x, y, z, p, q: (p - q) * x, Expected("linear")),
    "product": (lambda x, y, z, p, q: x * y, Expected("linear")),
    "odd factor": (lambda x, y, z, p, q: x * jnp.tanh(y), Expected("linear")),
    "square": (lambda x, y, z, p, q: x * x, Expected("nonlinear")),
    "power": (lambda x, y, z, p, q: x**3, Expected("nonlinear")),
    "divisor": (lambda x, y, z, p, q: p / x, Expected("nonlinear")),
    "branch": (lambda x, y, z, p, q: jnp.where(x > 0.0, p, q) * x, Expected("nonlinear")),
    "larger": (lambda x, y, z, p, q: jnp.maximum(x, y), Expected("nonlinear")),
    "through a product": (lambda x, y, z, p, q: (x * y) * (z - x), Expected("nonlinear")),
}


@pytest.mark.parametrize("law", LAWS)
def test_classification(law: str) -> None:
    function, expected = LAWS[law]
    form = form_of(function)
    coefficient = form.terms.get(0)
    if expected.kind == "nonlinear":
        assert 0 in form.nonlinear
        assert coefficient is None
        return
    assert 0 not in form.nonlinear
    assert coefficient is not None
    assert coefficient.number == expected.number
    assert coefficient.cannot_vanish == (expected.kind in ("number", "regular"))


def test_what_cancels_is_no_input() -> None:
    assert form_of(lambda x, y, z, p, q: x + y - x).inputs == {1}
    assert form_of(lambda x, y, z, p, q: 0.0 * x + z).inputs == {2}


@pytest.mark.parametrize(
    "moved",
    [lambda x: x[::-1], lambda x: jnp.roll(x, 1), lambda x: jnp.cumsum(x), lambda x: x[jnp.array([2, 0, 1])]],
    ids=["reversed", "rolled", "cumulated", "permuted"],
)
def test_moved_elements_are_not_elementwise(moved: Callable[..., Any]) -> None:
    coefficient = form_of(lambda x: moved(x), ((3,),)).terms.get(0)
    assert coefficient is None or not coefficient.cannot_vanish


def test_sum_over_elements_cannot_be_solved_for_the_array() -> None:
    form = form_of(lambda x, y: jnp.sum(x) + y, ((3,), ()))
    assert not form.terms[0].cannot_vanish
    assert form.terms[1].number == 1.0


@pytest.mark.thorough
def test_elementwise_factor() -> None:
    """One number for all elements, or none where they differ."""
    assert form_of(lambda x: 2.0 * x, ((3,),)).terms[0].number == 2.0
    uneven = form_of(lambda x: jnp.array([1.0, 2.0, 3.0]) * x, ((3,),)).terms[0]
    assert uneven.number is None
    assert uneven.cannot_vanish
    assert not form_of(lambda x: jnp.array([1.0, 0.0, 3.0]) * x, ((3,),)).terms[0].cannot_vanish


def test_a_constant_that_is_not_a_number_may_have_any_sign() -> None:
    assert constant(np.nan).signs == ANY
    assert constant(np.nan).has_rest
