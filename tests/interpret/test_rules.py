"""Each rule against XLA's result of the same primitive."""

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from jax.lax import GatherScatterMode

from acausal._interpret.interpreter import as_numpy
from acausal._interpret.rules import RULES, aval
from acausal._jax_private import NAMED_PRIMITIVES, ClosedJaxpr, JaxprEqn, Literal

NAN, INF = np.nan, np.inf
F64, F32, I32, I64, U32, BOOL = (np.dtype(name) for name in ("f8", "f4", "i4", "i8", "u4", "?"))
FLOATS, INTEGERS = (F64, F32), (I32, I64, U32)
NUMBERS = (*FLOATS, *INTEGERS)
TOLERANCE = {"f": 3e-6, "d": 1e-13, "D": 1e-13}
# Neither denormal numbers, which XLA flushes to zero, nor arguments of cosines so large that libraries differ.
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 1.5, -1.5, 2.5, -2.5, 0.49999999, 1e-8, -3e-5, 0.3, 7.2, -11.0, 40.0]
LARGE = [1e9, -1e9, 4294967296.0, -2147483648.0, 2147483647.0, 1e19, -1e19, 1e30, -1e30, 1e-30, INF, -INF, NAN]

Case = tuple[Callable[..., Any], tuple[Any, ...]]


def values_of(dtype: np.dtype[Any]) -> np.ndarray:
    """Usual and special values of a type."""
    if dtype.kind == "f":
        return np.array(SPECIAL + LARGE, dtype)
    if dtype.kind == "b":
        return np.array([False, True])
    info = np.iinfo(dtype)
    small = [0, 1, 2, 3, 5, 7, 31, 100] + ([-1, -2, -3, -7, -30] if dtype.kind == "i" else [])
    return np.array([*small, info.max, info.max - 1, info.min, info.min + 1, info.max // 3], dtype)


def evaluated(closed: ClosedJaxpr, values: tuple[Any, ...], used: set[str]) -> list[Any]:
    """The outputs of a jaxpr by rules. Each rule returns the types of its equation and changes no argument."""
    env = dict(zip(closed.jaxpr.constvars, map(as_numpy, closed.consts), strict=True))
    env.update(zip(closed.jaxpr.invars, values, strict=True))

    def value(atom: Any) -> Any:
        return np.asarray(atom.val, aval(atom).dtype)[()] if isinstance(atom, Literal) else env[atom]

    for eqn in closed.jaxpr.eqns:
        inputs = tuple(map(value, eqn.invars))
        is_call = "jaxpr" in eqn.params
        outputs = evaluated(eqn.params["jaxpr"], inputs, used) if is_call else by_rule(eqn, inputs, used)
        env.update(zip(eqn.outvars, outputs, strict=True))
    return [value(atom) for atom in closed.jaxpr.outvars]


def by_rule(eqn: JaxprEqn, inputs: tuple[Any, ...], used: set[str]) -> list[Any]:
    before = [np.array(x) for x in inputs]
    function = RULES[eqn.primitive.name](eqn)
    with np.errstate(all="ignore"):
        found = function(*inputs)
        again = function(*inputs)
    outputs = list(found) if eqn.primitive.multiple_results else [found]
    for x, kept in zip(inputs, before, strict=True):
        np.testing.assert_array_equal(x, kept)
    for i, (x, var) in enumerate(zip(outputs, eqn.outvars, strict=True)):
        shape, dtype = aval(var).shape, aval(var).dtype
        assert type(x) is np.ndarray if shape else isinstance(x, np.generic), eqn
        assert (x.shape, x.dtype) == (shape, dtype), eqn
        np.testing.assert_array_equal(x, again[i] if eqn.primitive.multiple_results else again)
    used.add(eqn.primitive.name)
    return outputs


def assert_close(found: Any, expected: Any, *, exact: bool, label: Any) -> None:
    found, expected = np.array(found), np.array(expected)
    assert (found.shape, found.dtype) == (expected.shape, expected.dtype), label
    tolerance = 0.0 if exact else TOLERANCE.get(expected.dtype.char, 0.0)
    if expected.dtype.kind == "f" and "nextafter" not in label:  # XLA flushes denormal numbers to zero
        found = np.where(np.abs(found) < np.finfo(found.dtype).tiny, np.copysign(found.dtype.type(0), found), found)
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance, err_msg=str(label))
    if exact and expected.dtype.kind == "f":
        for x in (found, expected):
            np.copysign(x, 1.0, out=x, where=np.isnan(x))  # the sign of NaN means nothing
        np.testing.assert_array_equal(np.signbit(found), np.signbit(expected), err_msg=f"sign of {label}")


def agree(name: str, cases: list[Case], *, exact: bool = False) -> None:
    """The rule's results are XLA's, for all cases, which are compiled together."""
    cases = [(function, tuple(map(as_numpy, values))) for function, values in cases]
    expected = jax.jit(lambda all_values: [f(*x) for (f, _), x in zip(cases, all_values, strict=True)])(
        [x for _, x in cases]
    )
    for i, (function, values) in enumerate(cases):
        closed, used = jax.make_jaxpr(function)(*values), set[str]()
        found = evaluated(closed, values, used)
        assert name in used, closed
        label = name, i, [(x.dtype, x.shape) for x in values]
        for a, b in zip(found, jax.tree.leaves(expected[i]), strict=True):
            assert_close(a, b, exact=exact, label=label)


def refuses(name: str, function: Callable[..., Any], *values: Any) -> None:
    """There is no rule for this equation, so XLA evaluates it."""
    (eqn,) = (eqn for eqn in jax.make_jaxpr(function)(*values).jaxpr.eqns if eqn.primitive.name == name)
    with pytest.raises(NotImplementedError):
        RULES[name](eqn)


# ---------------------------------------------------------------------------------------------------------------------
# Element by element
# ---------------------------------------------------------------------------------------------------------------------

EXACT = {  # by name: the function and the types it takes
    "add": (lax.add, NUMBERS),
    "add_any": (NAMED_PRIMITIVES["add_any"].bind, NUMBERS),
    "sub": (lax.sub, NUMBERS),
    "mul": (lax.mul, NUMBERS),
    "div": (lax.div, NUMBERS),
    "rem": (lax.rem, NUMBERS),
    "neg": (lax.neg, NUMBERS),
    "abs": (lax.abs, (*FLOATS, I32, I64)),
    "square": (lax.square, NUMBERS),
    "sign": (lax.sign, NUMBERS),
    "sqrt": (lax.sqrt, FLOATS),
    "floor": (lax.floor, FLOATS),
    "ceil": (lax.ceil, FLOATS),
    "is_finite": (lax.is_finite, FLOATS),
    "nextafter": (lax.nextafter, FLOATS),
    "and": (lax.bitwise_and, (*INTEGERS, BOOL)),
    "or": (lax.bitwise_or, (*INTEGERS, BOOL)),
    "xor": (lax.bitwise_xor, (*INTEGERS, BOOL)),
    "not": (lax.bitwise_not, (*INTEGERS, BOOL)),
    **{name: (getattr(lax, name), (*NUMBERS, BOOL)) for name in ("max", "min")},
    **{name: (getattr(lax, name), (*NUMBERS, BOOL)) for name in ("eq", "ne", "lt", "le", "gt", "ge")},
}
CLOSE = {
    **{name: (getattr(lax, name), FLOATS) for name in "rsqrt cbrt exp exp2 expm1 log log1p logistic erf erfc".split()},
    **{name: (getattr(lax, name), FLOATS) for name in "tan asin acos atan sinh cosh tanh asinh acosh atanh".split()},
    **{name: (getattr(lax, name), FLOATS) for name in "sin cos pow atan2".split()},
}
TWO = ("add add_any sub mul div rem max min and or xor eq ne lt le gt ge nextafter pow atan2").split()
OSCILLATING = ("sin", "cos", "tan")


def grid(name: str, dtype: np.dtype[Any]) -> tuple[np.ndarray, ...]:
    """All pairs of values for functions of two arguments."""
    values = values_of(dtype)
    if name in OSCILLATING:
        values = values[(np.abs(values) < 1e3) | ~np.isfinite(values)]
    if name not in TWO:
        return (values,)
    first, second = (x.ravel() for x in np.meshgrid(values, values))
    if name == "pow":  # for which NumPy takes a root, with the result NaN
        usual = ~((first == -INF) & (second == 0.5))
        return first[usual], second[usual]
    return first, second


@pytest.mark.parametrize("name", [*EXACT, *CLOSE])
def test_functions_of_elements(name: str) -> None:
    """Arrays, scalars, empty arrays and arrays of several dimensions."""
    function, dtypes = (EXACT if name in EXACT else CLOSE)[name]
    grids = [grid(name, dtype) for dtype in dtypes]
    if name in ("max", "min", "rem"):  # the sign of a zero is XLA's choice
        grids = [tuple(x + (x.dtype.kind == "f" and x.dtype.type(0)) for x in values) for values in grids]
    expected = jax.jit(lambda grids: [function(*x) for x in grids])(grids)
    for values, results in zip(grids, expected, strict=True):
        results, used = np.asarray(results), set[str]()
        dtype = values[0].dtype
        (found,) = evaluated(jax.make_jaxpr(function)(*values), values, used)
        assert used == {name}
        assert_close(found, results, exact=name in EXACT, label=(name, dtype))
        (found,) = evaluated(jax.make_jaxpr(function)(*(x[:0] for x in values)), tuple(x[:0] for x in values), used)
        assert found.shape == (0,)
        square = tuple(x[:4].reshape(2, 2).T for x in values) if len(values[0]) >= 4 else values
        (found,) = evaluated(jax.make_jaxpr(function)(*square), square, used)
        scalar = jax.make_jaxpr(function)(*(x[0] for x in values))
        rule = RULES[name](scalar.jaxpr.eqns[0])
        with np.errstate(all="ignore"):
            single = [rule(*(x[i] for x in values)) for i in range(len(results))]
        assert {(type(x), np.shape(x)) for x in single} == {(results.dtype.type, ())}
        assert_close(np.array(single), results, exact=name in EXACT, label=(name, dtype, "scalars"))


@pytest.mark.parametrize("y_type", [I32, I64])
def test_powers_with_integers(y_type: np.dtype[Any]) -> None:
    x = np.array([0.0, -0.0, 1.0, -1.5, 3.0, INF, -INF, NAN])
    y = np.array([0, 1, -1, 2, -2, 3, -3, 10], y_type)
    pairs = [a.ravel() for a in np.meshgrid(x, y)]
    cases: list[Case] = [(lax.pow, (pairs[0].astype(dtype), pairs[1])) for dtype in FLOATS]
    agree("pow", [*cases, *[(lax.pow, (dtype.type(1.5), y_type.type(-3))) for dtype in FLOATS]])


def test_whole_powers() -> None:
    cases: list[Case] = []
    for dtype, y in itertools.product(FLOATS, (0, 1, 2, 3, 7, -1, -2, -5)):
        cases += [(partial(lax.integer_pow, y=y), (x,)) for x in (values_of(dtype), dtype.type(-1.5))]
    for dtype, y in itertools.product(INTEGERS, (0, 1, 2, 3, 7)):
        cases += [(partial(lax.integer_pow, y=y), (x,)) for x in (values_of(dtype), dtype.type(3))]
    agree("integer_pow", [case for case in cases if case[0].keywords["y"] not in (0, 1)])  # pyright: ignore
    eqn = jax.make_jaxpr(partial(lax.integer_pow, y=2))(NAN).jaxpr.eqns[0]
    for y, power in ((0, 1.0), (1, NAN)):  # which jax evaluates while tracing
        np.testing.assert_equal(RULES["integer_pow"](eqn.replace(params={"y": y}))(np.float64(NAN)), power)


def test_roundings() -> None:
    ties = [
        0.5,
        -0.5,
        1.5,
        2.5,
        -2.5,
        0.49999999999999994,
        -0.49999999999999994,
        0.49999997,
        8388609.0,
        4503599627370497.0,
    ]
    cases: list[Case] = []
    for dtype, method in itertools.product(FLOATS, lax.RoundingMethod):
        x = np.concatenate([values_of(dtype), np.array(ties, dtype)])
        cases += [(partial(lax.round, rounding_method=method), (value,)) for value in (x, *x[-8:])]
    agree("round", cases, exact=True)


def test_conversions() -> None:
    cases: list[Case] = []
    for source, target in itertools.product((*NUMBERS, BOOL), repeat=2):
        convert = partial(lax.convert_element_type, new_dtype=target)
        if source != target:
            x = values_of(source)
            cases += [(convert, (value,)) for value in (x, x.reshape(1, -1), x[:0])]
    agree("convert_element_type", cases, exact=True)
    for convert, (x,) in cases[::3]:
        (eqn,) = jax.make_jaxpr(convert)(x[0]).jaxpr.eqns
        (whole,) = jax.make_jaxpr(convert)(x).jaxpr.eqns
        with np.errstate(all="ignore"):
            single, expected = (
                [RULES["convert_element_type"](eqn)(value) for value in x],
                RULES["convert_element_type"](whole)(x),
            )
        assert {type(value) for value in single} == {expected.dtype.type}
        np.testing.assert_array_equal(single, expected)


def test_values_within_limits() -> None:
    cases: list[Case] = []
    for dtype in FLOATS:
        x = values_of(dtype)
        limits: list[Any] = [(0.5, 2.0), (2.0, 0.5), (NAN, 1.0), (0.0, NAN), (-INF, INF)]
        for low, high in limits:
            a, b = dtype.type(low), dtype.type(high)
            cases += [(lax.clamp, (a, x + dtype.type(0), b)), (lax.clamp, (np.full_like(x, a), x, np.full_like(x, b)))]
            cases += [(lax.clamp, (a, x[0], b)), (lax.clamp, (a, dtype.type(NAN), b))]
    for dtype in INTEGERS:
        cases += [(lax.clamp, (dtype.type(2), x, dtype.type(5))) for x in (values_of(dtype), dtype.type(0))]
    agree("clamp", cases)


def test_choices() -> None:
    a, b, c = (np.arange(4.0) + 10.0 * i for i in range(3))
    whole = np.array([0, 1, 2, -1], I32)
    yes = np.array([True, False, True, True])
    cases: list[Case] = [
        (lax.select_n, (yes, a, b)),
        (lax.select_n, (whole, a, b)),
        (lax.select_n, (whole, a, b, c)),
        (lax.select_n, (whole, a, b, c, a)),
        (lax.select_n, (whole + I32.type(2), a, b, c)),
        (lax.select_n, (yes, yes, ~yes)),
        (lax.select_n, (yes.reshape(2, 2), a.reshape(2, 2), b.reshape(2, 2))),
        (lax.select_n, (yes[:0], a[:0], b[:0])),
        (lax.select_n, (whole, a)),
        *[(lax.select_n, (which, a, b)) for which in yes[:2]],
        *[(lax.select_n, (which, a, b, c)) for which in (*whole, I32.type(3))],
        *[(lax.select_n, (which, a[0], b[0])) for which in (*yes[:2], *whole, I32.type(3))],
        *[(lax.select_n, (which, a[0], b[0], c[0])) for which in (*whole, I32.type(3))],
    ]
    agree("select_n", cases, exact=True)
    refuses("select_n", lax.select_n, whole, *[a] * 70)  # more cases than NumPy takes


def test_precision_is_reduced_only_to_its_own() -> None:
    agree("reduce_precision", [(lambda x: lax.reduce_precision(x, 11, 52), (values_of(F64),))], exact=True)
    agree("reduce_precision", [(lambda x: lax.reduce_precision(x, 8, 23), (values_of(F32),))], exact=True)
    refuses("reduce_precision", lambda x: lax.reduce_precision(x, 8, 23), values_of(F64))


def test_complex_numbers() -> None:
    x, y = np.array([1.0 + 2.0j, -0.5j, 3.0, -1.0 + 1e-3j]), np.array([0.5 - 1.0j, 2.0, 1.0j, -4.0])
    pairs = dict(add=lax.add, sub=lax.sub, mul=lax.mul, div=lax.div, eq=lax.eq, ne=lax.ne, pow=lax.pow)
    alone = "neg abs square sign sqrt exp log sin cos tanh logistic rsqrt".split()
    for name, function in pairs.items():
        agree(name, [(function, (x, y)), (function, (x[0], y[0]))])
    for name in alone:
        agree(name, [(getattr(lax, name), (x,)), (getattr(lax, name), (x[0],))])
    agree("integer_pow", [(partial(lax.integer_pow, y=k), (x,)) for k in (3, -2)])
    agree("reduce_sum", [(jnp.sum, (x,))])
    agree("dot_general", [(jnp.dot, (x, y))])
    agree("gather", [(lambda x, i: x.at[i].get(mode="fill"), (x, np.array([0, 7])))])


# ---------------------------------------------------------------------------------------------------------------------
# Shapes
# ---------------------------------------------------------------------------------------------------------------------

BOX, ROW = np.arange(24.0).reshape(2, 3, 4), np.arange(5.0)


def every(function: Callable[..., Any], *shapes: tuple[int, ...]) -> list[Case]:
    """A function of one array, for each type and shape."""
    found = []
    for dtype, shape in itertools.product((F64, F32, I64, BOOL), shapes):
        found.append((function, (np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(dtype),)))
    return found


SHAPES: dict[str, list[Case]] = {
    "reshape": [
        *every(lambda x: lax.reshape(x, (6, 4)), (2, 3, 4), (24,)),
        *every(lambda x: lax.reshape(x, ()), (1,), (1, 1)),
        *every(lambda x: lax.reshape(x, (1,)), ()),
        *every(lambda x: lax.reshape(x, (1, 1)), (), (1,)),
        *every(lambda x: lax.reshape(x, (0, 3)), (0,)),
        *every(lambda x: lax.reshape(lax.transpose(x, (1, 0)), (6,)), (2, 3)),
    ],
    "squeeze": [
        *every(lambda x: lax.squeeze(x, (0,)), (1,), (1, 3), (1, 1)),
        *every(lambda x: lax.squeeze(x, (0, 2)), (1, 3, 1), (1, 0, 1)),
        *every(lambda x: lax.squeeze(x, (0, 1)), (1, 1)),
    ],
    "broadcast_in_dim": [
        *every(lambda x: lax.broadcast_in_dim(x, (3,), ()), ()),
        *every(lambda x: lax.broadcast_in_dim(x, (1,), ()), ()),
        *every(lambda x: lax.broadcast_in_dim(x, (0, 2), ()), ()),
        *every(lambda x: lax.broadcast_in_dim(x, (2, 3), (1,)), (3,), (1,)),
        *every(lambda x: lax.broadcast_in_dim(x, (3, 2), (0,)), (3,), (1,)),
        *every(lambda x: lax.broadcast_in_dim(x, (2, 3, 4), (0, 2)), (2, 4), (1, 4), (2, 1), (1, 1)),
        *every(lambda x: lax.broadcast_in_dim(x, (1, 3, 1), (1,)), (3,)),
        *every(lambda x: lax.broadcast_in_dim(x, (0, 3), (1,)), (3,)),
    ],
    "slice": [
        *every(lambda x: lax.slice(x, (1,), (4,)), (5,)),
        *every(lambda x: lax.slice(x, (0,), (5,), (2,)), (5,)),
        *every(lambda x: lax.slice(x, (1, 0, 3), (2, 3, 4), (1, 2, 1)), (2, 3, 4)),
        *every(lambda x: lax.slice(x, (2,), (2,)), (5,)),
        *every(lambda x: lax.slice(x, (), ()), ()),
    ],
    "concatenate": [
        (lambda *x: lax.concatenate(x, 0), (ROW, ROW[:1], ROW[:0])),
        (lambda *x: lax.concatenate(x, 1), (BOX, BOX[:, :1])),
        (lambda *x: lax.concatenate(x, 0), (ROW > 1, ROW > 2)),
    ],
    "stack": [
        (lambda *x: jnp.stack(x), (1.0, 2.0)),
        (lambda *x: jnp.stack(x), (np.float32(1.0), np.float32(2.0))),
        (lambda *x: jnp.stack(x), (np.True_, np.False_)),
        (lambda x: jnp.stack([x]), (1.0,)),
        (lambda *x: jnp.stack(x, 1), (ROW, ROW + 1)),
        (lambda *x: jnp.stack(x, -1), (BOX, BOX + 1)),
        (lambda *x: jnp.stack(x), (ROW[:0], ROW[:0])),
    ],
    "unstack": [
        *every(jnp.unstack, (3,), (1,), (2, 3), (2, 0)),
        *every(lambda x: jnp.unstack(x, axis=1), (2, 3, 4)),
    ],
    "split": [
        *every(lambda x: lax.split(x, (2, 0, 3)), (5,)),
        *every(lambda x: lax.split(x, (1, 3), axis=1), (2, 4)),
        *every(lambda x: lax.split(x, (5,)), (5,)),
    ],
    "transpose": [
        *every(lambda x: lax.transpose(x, (2, 0, 1)), (2, 3, 4)),
        *every(lambda x: lax.transpose(x, (1, 0)), (2, 3), (0, 3)),
    ],
    "rev": [
        *every(lambda x: lax.rev(x, (0,)), (5,), (0,), (1,)),
        *every(lambda x: lax.rev(x, (0, 2)), (2, 3, 4)),
    ],
    "iota": [
        *[(lambda x, d=dtype: x + lax.iota(d, 5), (dtype.type(1),)) for dtype in NUMBERS],
        *[(lambda x, k=k: x + lax.broadcasted_iota(F64, (2, 3), k), (1.0,)) for k in (0, 1)],
        (lambda x: x + lax.iota(I32, 0), (np.int32(1),)),
    ],
    "pad": [
        (lambda x, y, c=config: lax.pad(x, y, c), (values, fill))
        for values, fill, configs in (
            (
                ROW,
                9.0,
                [[(1, 2, 0)], [(0, 0, 2)], [(-1, 3, 0)], [(-2, -1, 1)], [(1, -3, 2)], [(-5, 1, 0)], [(-4, -4, 3)]],
            ),
            (ROW[:0], 9.0, [[(1, 2, 0)], [(0, 0, 3)]]),
            (BOX, NAN, [[(1, 0, 0), (0, -1, 1), (-1, 2, 2)], [(0, 0, 0)] * 3, [(-1, 0, 0), (-3, 0, 0), (1, 1, 0)]]),
            (BOX.astype(I32), I32.type(-7), [[(1, 0, 0), (0, -1, 1), (-1, 2, 2)]]),
            (ROW.astype(F32), F32.type(1), [[(1, 1, 1)]]),
            (ROW > 2, np.True_, [[(1, 1, 1)]]),
            (np.float64(2.0), 3.0, [[]]),
        )
        for config in configs
    ],
}


@pytest.mark.parametrize("name", SHAPES)
def test_shapes(name: str) -> None:
    agree(name, SHAPES[name], exact=True)


def test_numbers_in_the_order_of_other_axes_are_for_xla() -> None:
    refuses("reshape", lambda x: lax.reshape(x, (6,), (1, 0)), np.ones((2, 3)))


# ---------------------------------------------------------------------------------------------------------------------
# Reductions
# ---------------------------------------------------------------------------------------------------------------------


def arrays(dtype: np.dtype[Any]) -> Iterator[np.ndarray]:
    """Arrays with and without special values, and without any."""
    if dtype.kind == "f":
        plain = np.array([0.5, -1.5, 2.0, 2.0, 0.25, -3.0], dtype)
        yield from (
            plain,
            np.array([1.0, NAN, 3.0, NAN, INF, -INF], dtype),
            np.array([INF, 2.0, INF, -2.0, -INF, 0], dtype),
        )
    elif dtype.kind == "b":
        plain = np.array([True, False, False, True, True, True])
        yield plain
        yield np.zeros(6, bool)
    else:
        plain = np.array([3, 1, 4, 1, 5, 9], dtype)
        yield plain
        yield values_of(dtype)[-6:]
    yield plain.reshape(2, 3)
    yield plain[:0]
    yield plain.reshape(2, 3)[:, :0]
    yield plain.reshape(1, 2, 3)


@pytest.mark.parametrize("name", ["sum", "prod", "max", "min", "and", "or", "xor"])
def test_reductions(name: str) -> None:
    dtypes = (*NUMBERS, BOOL) if name in ("max", "min") else NUMBERS if name in ("sum", "prod") else (*INTEGERS, BOOL)
    primitive = NAMED_PRIMITIVES[f"reduce_{name}"]
    others = dict(out_sharding=None) if name in ("sum", "max", "min", "prod") else {}
    cases: list[Case] = []
    for dtype in dtypes:
        for x in arrays(dtype):
            for axes in {(0,), (x.ndim - 1,), tuple(range(x.ndim)), ()}:
                cases.append((partial(primitive.bind, axes=axes, **others), (x,)))
    agree(f"reduce_{name}", cases, exact=name not in ("sum", "prod"))


@pytest.mark.parametrize("name", ["argmax", "argmin"])
def test_places_of_extremes(name: str) -> None:
    cases: list[Case] = []
    for dtype, index in itertools.product((*NUMBERS, BOOL), (I32, I64)):
        for x in arrays(dtype):
            for axis in {0, x.ndim - 1}:
                if x.shape[axis]:
                    cases.append((partial(getattr(lax, name), axis=axis, index_dtype=index), (x,)))
    agree(name, cases, exact=True)


@pytest.mark.parametrize("name", ["cumsum", "cumprod", "cummax", "cummin", "cumlogsumexp"])
@pytest.mark.parametrize("reverse", [False, True])
def test_cumulations(name: str, reverse: bool) -> None:
    cases: list[Case] = []
    for dtype in FLOATS if name == "cumlogsumexp" else NUMBERS:
        for x in arrays(dtype):
            for axis in {0, x.ndim - 1}:
                cases.append((partial(getattr(lax, name), axis=axis, reverse=reverse), (x,)))
    agree(name, cases)


def test_sorting() -> None:
    cases: list[Case] = [
        (partial(lax.sort, dimension=axis), (x,))
        for dtype in (*NUMBERS, BOOL)
        for x in arrays(dtype)
        for axis in {0, x.ndim - 1}
    ]
    key = np.array([2.0, NAN, -1.0, 2.0, -INF, 2.0, 0.0, -0.0, NAN])
    order = np.arange(9)
    cases += [
        (lambda *x: lax.sort(x, num_keys=1), (key, order, order * 0.5, order > 3)),
        (lambda *x: lax.sort(x, num_keys=1), (np.array([-0.0, 0.0, -0.0, NAN, -NAN]), np.arange(5))),
        (lambda *x: lax.sort(x, dimension=0, num_keys=1), (key.reshape(3, 3), order.reshape(3, 3))),
        (jnp.argsort, (key,)),
        (lambda *x: jnp.lexsort(x), (key,)),
    ]
    agree("sort", cases)
    refuses("sort", lambda *x: lax.sort(x, num_keys=2), key, key)


# ---------------------------------------------------------------------------------------------------------------------
# Linear algebra
# ---------------------------------------------------------------------------------------------------------------------


def numbers(*shape: int, dtype: Any = F64) -> np.ndarray:
    rng = np.random.default_rng(sum(shape))
    return (rng.normal(size=shape) * 4).astype(dtype)


def test_products() -> None:
    def dot(axes: Any, batch: Any = ((), ()), dtype: Any = None) -> Callable[..., Any]:
        return lambda a, b: lax.dot_general(a, b, (axes, batch), preferred_element_type=dtype)

    pairs: list[tuple[Callable[..., Any], tuple[int, ...], tuple[int, ...]]] = [
        (dot(((0,), (0,))), (4,), (4,)),
        (dot(((1,), (0,))), (3, 4), (4,)),
        (dot(((0,), (1,))), (4, 3), (5, 4)),
        (dot(((), ())), (2,), (3,)),
        (dot(((), ())), (), ()),
        (dot(((), ())), (), (3,)),
        (dot(((0, 2), (2, 0))), (2, 3, 4), (4, 5, 2)),
        (dot(((2,), (1,)), ((0,), (0,))), (2, 3, 4), (2, 4, 5)),
        (dot(((1,), (0,)), ((2,), (1,))), (3, 4, 2), (4, 2)),
        (dot(((1,), (1,)), ((0, 2), (2, 0))), (2, 4, 3), (3, 4, 2, 5)),
        (dot(((), ()), ((0,), (0,))), (3,), (3,)),
        (dot(((0,), (0,))), (0,), (0,)),
        (dot(((1,), (0,))), (3, 0), (0, 2)),
        (dot(((1,), (0,))), (0, 3), (3, 2)),
    ]
    cases: list[Case] = [
        (f, (numbers(*a, dtype=dtype), numbers(*b, dtype=dtype)))
        for f, a, b in pairs
        for dtype in (F64, F32, I32, I64, U32, BOOL)
    ]
    wide = numbers(3, 3, dtype=F32), np.array([1e8, 1.0, -1e8], F32)
    cases += [
        (dot(((1,), (0,)), dtype=F64), wide),
        (dot(((1,), (0,)), dtype=I64), (np.full((2, 2), 2**30, I32), np.full(2, 3, I32))),
        (dot(((1,), (0,))), (np.array([[INF, 1.0], [NAN, 0.0]]), np.array([0.0, 2.0]))),
        (dot(((1,), (0,))), (np.full((2, 2), 2**30, I32), np.full(2, 3, I32))),
    ]
    agree("dot_general", cases)


def test_triangular_systems() -> None:
    a = numbers(3, 3) + 5 * np.eye(3)
    singular = a * np.array([1.0, 0.0, 1.0])
    cases: list[Case] = []
    for left, lower, transpose, unit in itertools.product([True, False], repeat=4):
        solve = partial(
            lax.linalg.triangular_solve, left_side=left, lower=lower, transpose_a=transpose, unit_diagonal=unit
        )
        b = numbers(3, 2) if left else numbers(2, 3)
        cases += [(solve, values) for values in ((a, b), (a.astype(F32), b.astype(F32)), (a.T, b), (a * NAN, b))]
        cases += [(solve, (singular, b)), (solve, (a[:1, :1], b[:1, :1]))]
        cases += [(solve, (a + 0.3j, b - 0.5j)), (partial(solve, conjugate_a=True), (a + 0.3j, b - 0.5j))]
    agree("triangular_solve", cases)
    solve = partial(lax.linalg.triangular_solve, left_side=True)
    for left, right in (((2, 3, 3), (2, 3, 1)), ((0, 0), (0, 1)), ((3, 3), (3, 0))):
        refuses("triangular_solve", solve, np.ones(left), np.ones(right))


def test_factors() -> None:
    square = numbers(4, 4)
    singular = square.copy()
    singular[:, 2] = singular[:, 1]
    cases: list[Case] = [
        (lax.linalg.lu, (a,))
        for a in (
            square,
            square.T,
            singular * 0.0,
            singular,
            numbers(2, 3),
            numbers(3, 2),
            square[:1, :1],
            square * INF,
        )
    ]
    agree("lu", cases)
    for shape in ((2, 3, 3), (0, 0), (0, 2), (2, 0)):
        refuses("lu", lax.linalg.lu, np.ones(shape))


def test_singular_values() -> None:
    wide, double = numbers(3, 5), partial(lax.linalg.svd, full_matrices=False)
    shapes = (wide, wide.T, wide[:1, :1], wide * NAN, wide * INF, np.full((3, 3), INF), wide * 0.0)
    # Singular vectors are unique up to their signs, so the products with them are compared.
    cases: list[Case] = [(lambda a: (lambda u, s, v: ((u * s) @ v, s))(*double(a)), (a,)) for a in shapes]
    cases += [(partial(lax.linalg.svd, compute_uv=False), (a,)) for a in shapes]
    cases += [(lambda a: abs(lax.linalg.svd(a, full_matrices=True)[2]), (wide.T,))]
    agree("svd", cases)
    for a in (np.ones((2, 3, 3)), np.ones((0, 2)), wide.astype(F32)):
        refuses("svd", double, a)
    refuses("svd", partial(double, subset_by_index=(0, 2)), wide)


def test_orthogonal_factors() -> None:
    raw = partial(jnp.linalg.qr, mode="raw")
    matrices = numbers(5, 3), numbers(3, 5), numbers(3, 3), numbers(1, 1)
    agree("geqrf", [(raw, (a,)) for a in matrices])
    refuses("geqrf", lambda a: NAMED_PRIMITIVES["geqrf"].bind(a), np.ones((2, 3, 3)))
    cases: list[Case] = []
    for a in matrices[:1] + matrices[2:]:
        reflectors, scales = map(np.asarray, raw(a))
        for left, transpose in itertools.product([True, False], repeat=2):
            product = partial(lax.linalg.ormqr, left=left, transpose=transpose)
            c = numbers(len(a), 2) if left else numbers(2, len(a))
            cases.append((product, (reflectors.T, scales, c)))
    agree("ormqr", cases)
    refuses("ormqr", lax.linalg.ormqr, np.ones((2, 3, 3)), np.ones((2, 3)), np.ones((2, 3, 1)))


# ---------------------------------------------------------------------------------------------------------------------
# Indices
# ---------------------------------------------------------------------------------------------------------------------

BEYOND = (0, 1, 2, -1, -5, 4, 5, 100, -100)


def test_slices_at_places() -> None:
    cases: list[Case] = []
    for k, index in itertools.product(BEYOND, (I32, I64)):
        i = index.type(k)
        cases += [
            (lambda x, i: lax.dynamic_slice(x, (i,), (2,)), (ROW, i)),
            (lambda x, i: lax.dynamic_slice(x, (i,), (5,)), (ROW, i)),
            (lambda x, i: lax.dynamic_slice(x, (i,), (0,)), (ROW, i)),
            (lambda x, i: lax.dynamic_slice(x, (i, i, i), (1, 2, 3)), (BOX, i)),
        ]
    cases += [(lambda x: NAMED_PRIMITIVES["dynamic_slice"].bind(x, slice_sizes=()), (2.0,))]
    cases += [(lambda x, i: lax.dynamic_slice(x, (i,), (2,)), (ROW, np.uint32(3)))]
    agree("dynamic_slice", cases, exact=True)


def test_slices_replaced() -> None:
    cases: list[Case] = []
    for k, index in itertools.product(BEYOND, (I32, I64)):
        i = index.type(k)
        cases += [
            (lambda x, y, i: lax.dynamic_update_slice(x, y, (i,)), (ROW, ROW[:2] + 9.0, i)),
            (lambda x, y, i: lax.dynamic_update_slice(x, y, (i,)), (ROW, ROW + 9.0, i)),
            (lambda x, y, i: lax.dynamic_update_slice(x, y, (i,)), (ROW, ROW[:0], i)),
            (lambda x, y, i: lax.dynamic_update_slice(x, y, (i, i, i)), (BOX, BOX[:1, 1:, 1:] + 99.0, i)),
        ]
    update = NAMED_PRIMITIVES["dynamic_update_slice"]
    cases += [
        (lambda x, y: update.bind(x, y), (2.0, 3.0)),
        (lambda x, y: lax.dynamic_update_slice(x, y, (0,)), (ROW > 2, ROW < 2)),
    ]
    agree("dynamic_update_slice", cases, exact=True)


MODES = {
    "clip": GatherScatterMode.CLIP,
    "fill": GatherScatterMode.FILL_OR_DROP,
    "promised": GatherScatterMode.PROMISE_IN_BOUNDS,
}


def gather_cases(mode: GatherScatterMode) -> Iterator[Case]:
    def gather(dims: Any, sizes: Any, fill: Any = None) -> Callable[..., Any]:
        return partial(lax.gather, dimension_numbers=dims, slice_sizes=sizes, mode=mode, fill_value=fill)

    def numbered(offset: Any, collapsed: Any, to: Any, batch: Any = (), index_batch: Any = ()) -> Any:
        return lax.GatherDimensionNumbers(offset, collapsed, to, batch, index_batch)

    beyond = np.array(BEYOND)
    for dtype, index in itertools.product((*NUMBERS, BOOL), (I32, I64)):
        x = ROW.astype(dtype)
        yield gather(numbered((), (0,), (0,)), (1,)), (x, beyond.astype(index)[:, None])
        yield gather(numbered((), (0,), (0,)), (1,)), (x, beyond.astype(index)[4:5])
    yield gather(numbered((), (0,), (0,)), (1,), -7.0), (ROW, beyond[:, None])
    yield gather(numbered((), (0,), (0,)), (1,)), (ROW, beyond[:3, None].astype(U32))
    table = np.arange(300.0)  # more places than the indices can hold
    for index in (np.int8, np.uint8, np.uint64):
        yield gather(numbered((), (0,), (0,)), (1,)), (table, np.array([[0], [100]], index))
        yield gather(numbered((1,), (), (0,)), (2,)), (table, np.array([[0], [100]], index))
    yield gather(numbered((), (0,), (0,)), (1,)), (ROW, beyond[:0, None])
    yield gather(numbered((1,), (), (0,)), (2,)), (ROW, beyond[:, None])  # windows
    yield gather(numbered((0,), (), (0,)), (2,)), (ROW, beyond[:, None])
    yield gather(numbered((0, 2), (1,), (1,)), (2, 1, 3)), (BOX, beyond[:, None])
    pairs = np.stack(np.meshgrid(beyond, beyond), -1)
    yield gather(numbered((0,), (0, 1), (0, 1)), (1, 1, 4)), (BOX, pairs)
    yield gather(numbered((0,), (0, 1), (1, 0)), (1, 1, 3)), (BOX, pairs)
    yield gather(numbered((0, 1, 2), (), (2, 0)), (1, 3, 2)), (BOX, pairs[1, 1])
    yield gather(numbered((), (0, 1, 2), (0, 1, 2)), (1, 1, 1)), (BOX, np.array([1, 2, 3]))
    yield gather(numbered((), (), ()), ()), (np.float64(2.0), np.zeros(0, int))
    # A batch of operands with a batch of indices, whose axes lie elsewhere
    yield gather(numbered((), (1,), (1,), (0,), (0,)), (1, 1)), (BOX[:, :, 0], np.array([[[0], [7]], [[2], [-1]]]))
    yield (
        gather(numbered((1,), (1,), (1,), (0,), (1,)), (1, 1, 4)),
        (BOX, np.array([[[0], [7]], [[2], [-1]], [[1], [1]]])),
    )
    yield gather(numbered((), (2,), (2,), (0, 1), (1, 0)), (1, 1, 1)), (BOX, np.arange(-2, 4).reshape(3, 2, 1))


@pytest.mark.parametrize("mode", MODES)
def test_gathering(mode: str) -> None:
    cases = [
        (function, (x, np.clip(i, 0, 0) if mode == "promised" else i)) for function, (x, i) in gather_cases(MODES[mode])
    ]
    agree("gather", cases, exact=True)


def scatter_cases(scatter: Callable[..., Any], mode: GatherScatterMode, dtype: np.dtype[Any]) -> Iterator[Case]:
    def to(window: Any, inserted: Any, axes: Any, batch: Any = (), index_batch: Any = ()) -> Callable[..., Any]:
        dims = lax.ScatterDimensionNumbers(window, inserted, axes, batch, index_batch)
        return partial(scatter, dimension_numbers=dims, mode=mode)

    def of(*shape: int) -> np.ndarray:
        return (np.arange(np.prod(shape, dtype=int)).reshape(shape) % 5 + 2).astype(dtype)

    beyond, x, box = np.array(BEYOND), ROW.astype(dtype), BOX.astype(dtype)
    for index in (I32, I64):
        yield to((), (0,), (0,)), (x, beyond[:, None].astype(index), of(9))
        yield to((), (0,), (0,)), (x, beyond[4:5].astype(index), of())
        yield to((), (0,), (0,)), (x, beyond[1:2].astype(index), of())
    for index in (np.int8, np.uint8, np.uint64):
        yield to((1,), (), (0,)), (of(300), np.array([[0], [100]], index), of(2, 2))
    yield to((), (0,), (0,)), (x, np.array([[1], [1], [4], [1]]), of(4))  # the same place several times
    yield to((), (0,), (0,)), (x, beyond[:0, None], of(0))
    yield to((1,), (), (0,)), (x, beyond[:, None], of(9, 2))
    yield to((0,), (), (0,)), (x, beyond[:, None], of(2, 9))
    yield to((0, 2), (1,), (1,)), (box, beyond[:, None], of(2, 9, 3))
    yield to((0,), (0, 1), (0, 1)), (box, np.stack(np.meshgrid(beyond, beyond), -1), of(4, 9, 9))
    yield to((0,), (0, 1), (1, 0)), (box, np.array([2, 1]), of(3))
    yield to((0, 1, 2), (), (2, 0)), (box, np.array([1, 1]), of(1, 3, 2))
    yield to((), (), ()), (x[2], np.zeros(0, int), x[3])
    yield to((), (1,), (1,), (0,), (0,)), (box[:, :, 0], np.array([[[0], [7]], [[2], [-1]]]), of(2, 2))
    yield to((1,), (1,), (1,), (0,), (1,)), (box, np.array([[[0], [7]], [[2], [-1]], [[1], [1]]]), of(3, 4, 2))


KINDS = dict(add=lax.scatter_add, mul=lax.scatter_mul, min=lax.scatter_min, max=lax.scatter_max, sub=lax.scatter_sub)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", ["", *KINDS])
def test_scattering(kind: str, mode: str) -> None:
    function = KINDS.get(kind, lax.scatter)
    cases = [case for dtype in (F64, F32, I64) for case in scatter_cases(function, MODES[mode], dtype)]
    if kind == "":  # which of several values of one place stays is the compiler's choice
        cases = [(f, (x, i, u * 0 + 7 if np.shape(i)[0] == len(BEYOND) else u)) for f, (x, i, u) in cases]
    if kind in ("min", "max"):
        cases += [(f, (x, i, np.where(u == 3, NAN, u))) for f, (x, i, u) in scatter_cases(function, MODES[mode], F64)]
    if mode == "promised":
        cases = [(f, (x, np.clip(i, 0, 0), u)) for f, (x, i, u) in cases]
    agree("scatter" + (kind and f"-{kind}"), cases)


def test_other_updates_are_for_xla() -> None:
    refuses("scatter", lambda x: x.at[jnp.array([0])].apply(jnp.sin), ROW)


def test_error_functions_of_half_precision_are_for_xla() -> None:
    for name in ("erf", "erfc"):
        refuses(name, getattr(lax, name), np.ones(2, np.float16))


def test_every_rule_is_compared() -> None:
    others = (
        "integer_pow round convert_element_type clamp select_n reduce_precision sort dot_general triangular_solve lu "
        "svd geqrf ormqr"
    )
    indexed = "dynamic_slice dynamic_update_slice gather scatter argmax argmin"
    cumulative = "cumsum cumprod cummax cummin cumlogsumexp"
    compared = {*EXACT, *CLOSE, *SHAPES, *others.split(), *indexed.split(), *cumulative.split()}
    compared |= {f"reduce_{name}" for name in ("sum", "prod", "max", "min", "and", "or", "xor")}
    compared |= {f"scatter-{kind}" for kind in KINDS}
    assert set(RULES) == compared
