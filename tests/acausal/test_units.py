"""Dimensions of what equations compute, operation by operation."""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal._unit_check.interpret import Interpreter, Value
from acausal._units.dimension import NUMBER, Dimension, base, described
from acausal._units.parsing import UnknownUnit, common_unit, parsed, pint_unit, registry, unit_of

N, M, S, KG = parsed("N").dimension, base("m"), base("s"), base("kg")


COHERENT = """1 A C F H Hz J K N Ohm Pa S T V W Wb cd kg m mol ohm rad s N.m/A 1/s rad/s N.m.s/rad rad/rad s.Hz Hz/Hz
rad.Hz kg.m2 m3/(s.Pa0.5) W/(m2.K) (N.m)/(A.s) m-1 S/m""".split()


@pytest.mark.parametrize("unit", COHERENT)
def test_coherent_units_are_what_pint_says(unit: str) -> None:
    assert parsed(unit) == unit_of(pint_unit(unit), registry())


def test_units_as_modelica_writes_them() -> None:
    assert parsed("N.m.s/rad").dimension == KG * M**2 / S
    assert parsed("m3/(s.Pa)").dimension == M**4 * S / KG
    assert parsed("kg.m-3").dimension == KG / M**3
    assert parsed("m3/(s.Pa0.5)").dimension == M**3 / S / (KG / M / S**2) ** Fraction(1, 2)
    assert parsed("(N.m)/s").dimension == parsed("W").dimension
    assert parsed("1").dimension == parsed("rad").dimension == parsed("rev").dimension == NUMBER
    assert parsed("Ohm").dimension == parsed("V/A").dimension == parsed("ohm").dimension
    assert parsed("inH2O").dimension == parsed("Pa").dimension


def test_what_needs_conversion() -> None:
    coherent = [
        unit for unit in ("kg", "N.m/rad", "W", "1", "rad/s", "Hz", "g", "rpm", "degC", "bar") if parsed(unit).is_si
    ]
    assert coherent == ["kg", "N.m/rad", "W", "1", "rad/s", "Hz"]


BAD = {
    "N m": "write it as in",
    "kg*m2": r"Did you mean .*kg\.m2",
    "N.m/rad.s": "write it as in",
    "m/s/s": "write it as in",
    "newtonn": "pint has no such unit",
    "Nm": r"newton metre is N\.m",
    "": "write it as in",
    "2": "write it as in",
    "pixel": "measures no physical quantity",
}


@pytest.mark.parametrize("unit", BAD)
def test_bad_unit(unit: str) -> None:
    with pytest.raises(UnknownUnit, match=BAD[unit]):
        parsed(unit)


def test_a_dimension_for_a_person() -> None:
    assert described(N * M) == "N.m (kg.m2/s2)"
    assert described(M / S) == "m/s"
    assert described(NUMBER, "rad") == "rad (1)"
    assert described(NUMBER) == "1"
    assert described(parsed("ohm").dimension) == "ohm (kg.m2/(s3.A2))"
    assert str(M ** Fraction(1, 2)) == "m^(1/2)"


def interpreted(function: Callable[..., Any], *units: str, shape: tuple[int, ...] = ()) -> tuple[Value, list[str]]:
    """The value of a function of leaves a, b, ... with these units, and the problems in it."""
    closed = jax.make_jaxpr(function)(*(jnp.ones(shape) for _ in units))
    leaves = [
        Value(parsed(unit).dimension if unit else None, name, unit=unit or None, leaf=None if unit else i)
        for i, (name, unit) in enumerate(zip("abcdefg", units, strict=False))
    ]
    checked = Interpreter()
    (value,) = checked.interpret(closed, leaves)
    return value, checked.problems


def loop(a: Any, b: Any) -> Any:
    return jax.lax.fori_loop(0, 3, lambda i, x: x + a * b, 0.0)


def scanned(a: Any, b: Any) -> Any:
    return jax.lax.scan(lambda total, x: (total + x, total * a), 0.0, b)[1].sum()


def branched(a: Any, b: Any) -> Any:
    return jax.lax.cond(a > 0.0, lambda: b, lambda: 2.0 * b)


RULES: dict[str, tuple[Callable[..., Any], tuple[str, ...], str]] = {
    "add": (lambda a, b: a + b, ("N.m", "J"), "J"),
    "subtract": (lambda a, b: a - b, ("rad/s", "Hz"), "1/s"),
    "negative": (lambda a: -a, ("N",), "N"),
    "multiply": (lambda a, b: a * b, ("N.m", "rad/s"), "W"),
    "divide": (lambda a, b: a / b, ("V", "A"), "ohm"),
    "a number times": (lambda a: 2.0 * jnp.pi * a, ("N",), "N"),
    "one over": (lambda a: 1.0 / a, ("s",), "Hz"),
    "integer power": (lambda a: a**3, ("m",), "m3"),
    "negative power": (lambda a: a**-2, ("s",), "1/s2"),
    "square root": (lambda a: jnp.sqrt(a), ("m2/s2",), "m/s"),
    "cube root": (lambda a: jnp.cbrt(a), ("m3",), "m"),
    "inverse square root": (lambda a: jax.lax.rsqrt(a), ("m2",), "1/m"),
    "square": (lambda a: jnp.square(a), ("m",), "m2"),
    "fractional power": (lambda a: a**0.25, ("m4",), "m"),
    "power by a third": (lambda a: a ** (1 / 3), ("m3",), "m"),
    "power of a number": (lambda a, b: a**b, ("1", "1"), "1"),
    "function of a number": (lambda a, b: jnp.exp(-a / b), ("s", "s"), "1"),
    "sine of an angle": (lambda a, b: jnp.sin(a * b), ("rad/s", "s"), "1"),
    "arc tangent": (lambda a, b: jnp.arctan2(a, b), ("m", "m"), "1"),
    "sign": (lambda a: jnp.sign(a), ("N",), "1"),
    "absolute value": (lambda a: jnp.abs(a) * a, ("m/s",), "m2/s2"),
    "positive part": (lambda a: jnp.maximum(a, 0.0), ("N",), "N"),
    "choice with zero": (lambda a: jnp.where(a > 0.0, a, 0.0), ("N",), "N"),
    "guarded quotient": (lambda a, b: jnp.where(b > 0, a / jnp.where(b > 0, b, 1), 0.0), ("N", "m"), "N/m"),
    "switch": (lambda a, b: a * jnp.where(b > 0.0, 1.0, 0.0), ("N", "s"), "N"),
    "limits": (lambda a, b, c: jnp.clip(a, b, c), ("m", "m", "m"), "m"),
    "limits of a number": (lambda a: jnp.clip(a, 0, 1), ("1",), "1"),
    "infinite limit": (lambda a: jnp.minimum(a, jnp.inf), ("m",), "m"),
    "comparison": (lambda a, b: 1.0 * (a < b), ("m", "m"), "1"),
    "remainder": (lambda a, b: jnp.mod(a, b), ("m", "m"), "m"),
    "hypotenuse": (lambda a, b: jnp.hypot(a, b), ("m", "m"), "m"),
    "binary logarithm": (lambda a, b: jnp.log2(a / b), ("m", "m"), "1"),
    "slope of an arc": (lambda a: jax.jvp(jnp.arcsin, (a,), (a,))[1], ("1",), "1"),
    "slope": (lambda a, b: jax.jvp(lambda x: b * x**3, (a,), (jnp.ones_like(a),))[1], ("m", "N/m3"), "N/m"),
    "derivative rule of its own": (lambda a, b: a * jnp.logaddexp(b / a, 0.0), ("m", "m"), "m"),
    "compiled": (lambda a, b: jax.jit(lambda x: x * b)(a), ("N", "m"), "J"),
    "checkpoint": (lambda a, b: jax.checkpoint(lambda x: x * b)(a), ("N", "m"), "J"),
    "loop": (loop, ("N", "m"), "J"),
    "branches": (branched, ("s", "m"), "m"),
}  # fmt: skip

ARRAYS: dict[str, tuple[Callable[..., Any], tuple[str, ...], str]] = {
    "sum": (lambda a: jnp.sum(a), ("N",), "N"),
    "unpacked": (lambda a, b: jnp.unstack(a)[1] * b[0], ("N", "m"), "J"),
    "largest": (lambda a: jnp.max(a) - jnp.min(a), ("N",), "N"),
    "dot": (lambda a, b: a @ b, ("N", "m"), "J"),
    "norm": (lambda a: jnp.linalg.norm(a), ("m",), "m"),
    "product": (lambda a: jnp.prod(a), ("m",), "m3"),
    "element": (lambda a, b: a[1] * b[0], ("N", "m"), "J"),
    "joined": (lambda a, b: jnp.concatenate([a, b])[0], ("m", "m"), "m"),
    "stacked": (lambda a, b: jnp.stack([a, b])[0, 0], ("m", "m"), "m"),
    "differences": (lambda a: jnp.diff(a)[0], ("m",), "m"),
    "running sum": (lambda a: jnp.cumsum(a)[2], ("m",), "m"),
    "sorted": (lambda a: jnp.sort(a)[0], ("m",), "m"),
    "index": (lambda a: 1.0 * jnp.argmax(a), ("m",), "1"),
    "interpolation": (lambda a, b, c: jnp.interp(a[0], b, c), ("m", "m", "N"), "N"),
    "place in a table": (lambda a, b: 1.0 * jnp.searchsorted(b, a[0]), ("m", "m"), "1"),
    "polynomial": (lambda a, b: jnp.polyval(a, b[0]), ("N", "1"), "N"),
    "scan": (scanned, ("s", "N"), "N.s"),
    "set element": (lambda a, b: a.at[1].set(b[0])[1], ("N", "N"), "N"),
}


@pytest.mark.parametrize("name", RULES | ARRAYS)
def test_dimension_of_a_result(name: str) -> None:
    function, units, expected = (RULES | ARRAYS)[name]
    value, problems = interpreted(function, *units, shape=(3,) if name in ARRAYS else ())
    assert problems == []
    assert value.dimension == parsed(expected).dimension


WRONG: dict[str, tuple[Callable[..., Any], tuple[str, ...], str]] = {
    "add": (lambda a, b: a + b, ("N.m", "rad/s"), "adds a in N.m (kg.m2/s2) to b in rad/s (1/s)"),
    "subtract": (lambda a, b: a - b, ("m", "s"), "subtracts b in s from a in m"),
    "a number": (lambda a: a + 1.0, ("m",), "adds a in m to 1 in 1"),
    "product": (lambda a, b: a * b + b, ("N", "m"), "adds a * b in N.m (kg.m2/s2) to b in m"),
    "limit": (lambda a: jnp.clip(a, 0.0, 5.0), ("m",), "takes the smaller of 5 in 1 and max(0, a) in m"),
    "choice": (lambda a, b: jnp.where(a > 0, a, b), ("m", "s"), "chooses between b in s and a in m"),
    "choice of a number": (lambda a: jnp.where(a > 0, a, 5.0), ("m",), "chooses between 5 in 1 and a in m"),
    "comparison": (lambda a: jnp.where(a > 2.0, a, 0.0), ("m",), "compares a in m with 2 in 1"),
    "function": (lambda a: jnp.tanh(a), ("rad/s",), "takes tanh of a in rad/s (1/s), which is not a number"),
    "exponent": (lambda a, b: a**b, ("1", "m"), "takes a to the power of b in m, which is not a number"),
    "base": (lambda a, b: a**b, ("m", "1"), "takes a in m to a variable power, so the result has no unit"),
    "arc tangent": (lambda a, b: jnp.arctan2(a, b), ("m", "s"), "compares a in m with b in s"),
    "within a loop": (lambda a, b: jax.lax.fori_loop(0, 3, lambda i, x: x + b, a), ("N", "m"),
                      "adds a in N (kg.m/s2) to b in m"),
    "within a branch": (lambda a, b: jax.lax.cond(a > 0.0, lambda: b, lambda: a), ("s", "m"),
                        "chooses between a in s and b in m"),
    "long": (lambda a, b: a * a * a * a * a * a * a * a * a * a * a * a * a * a * a * a + b, ("1", "m"),
             "adds a * a * a * a * a * a * a * a * a * a * a * a * a * a * a... in 1 to b in m"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_contradiction(name: str) -> None:
    function, units, message = WRONG[name]
    assert interpreted(function, *units)[1] == [message]


def test_one_mistake_is_reported_once() -> None:
    """A unit computed from a contradiction agrees with every other unit."""
    _, problems = interpreted(lambda a, b: jnp.exp((a + b) * a) + b, "N", "m")
    assert problems == ["adds a in N (kg.m/s2) to b in m", "adds exp((a + b) * a) in 1 to b in m"]


UNKNOWN: dict[str, Callable[..., Any]] = {
    "without a unit": lambda a, b: b + jnp.sin(b) + b**2,
    "operation that is not known": lambda a, b: jnp.linalg.solve(a * jnp.eye(2), jnp.ones(2) * a)[0] + a,
    "loop whose unit changes": lambda a, b: jax.lax.fori_loop(0, 3, lambda i, x: x * a, a) + a,
    "product over a loop": lambda a, b: jax.lax.while_loop(lambda x: x[1] < 3, lambda x: (x[0] * a, x[1] + 1), (a, 0))[
        0
    ],
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_is_not_known_fits_anything(name: str) -> None:
    assert interpreted(UNKNOWN[name], "m", "")[1] == []


def test_a_constant_array_is_a_number_unless_it_is_zero() -> None:
    table, zeros = jnp.array([1.0, 2.0]), jnp.zeros(2)
    assert interpreted(lambda a: (a + zeros)[0], "m")[1] == []
    assert interpreted(lambda a: (a + table)[0], "m")[1] == ["adds a in m to [...] in 1"]


UNITS = ("1", "m", "s", "N", "m/s", "N/m", "kg")
FACTORS = dict(zip(("kg", "m", "s", "A", "K", "mol", "cd"), (2.0, 3.0, 0.5, 1.0, 1.0, 1.0, 1.0), strict=True))
BINARY: dict[str, Callable[[Any, Any, Any], Any]] = {
    "add": lambda xp, a, b: a + b,
    "sub": lambda xp, a, b: a - b,
    "mul": lambda xp, a, b: a * b,
    "div": lambda xp, a, b: a / b,
    "max": lambda xp, a, b: xp.maximum(a, b),
    "where": lambda xp, a, b: xp.where(a > b, a, b),
}
UNARY: dict[str, Callable[[Any, Any], Any]] = {
    "neg": lambda xp, a: -a,
    "root": lambda xp, a: xp.sqrt(xp.abs(a)),
    "tanh": lambda xp, a: xp.tanh(a),
    "cube": lambda xp, a: a**3,
    "quarter": lambda xp, a: xp.abs(a) ** 0.25,
    "double": lambda xp, a: 2.0 * a,
    "positive": lambda xp, a: xp.maximum(a, 0.0),
    "sign": lambda xp, a: xp.sign(a),
    "more": lambda xp, a: a + 1.0,
}
TREES: Any = st.recursive(
    st.integers(0, len(UNITS) - 1),
    lambda inner: (
        st.tuples(st.sampled_from(sorted(BINARY)), inner, inner) | st.tuples(st.sampled_from(sorted(UNARY)), inner)
    ),
    max_leaves=8,
)


def evaluated(tree: Any, xp: Any, leaves: Any) -> Any:
    if isinstance(tree, int):
        return leaves[tree]
    name, *arguments = tree
    values = [evaluated(argument, xp, leaves) for argument in arguments]
    return BINARY[name](xp, *values) if len(values) == 2 else UNARY[name](xp, *values)


def factor(dimension: Dimension) -> float:
    return math.prod(f ** float(e) for f, e in zip(FACTORS.values(), dimension.exponents, strict=True))


@pytest.mark.thorough
@settings(max_examples=300, deadline=None)
@given(tree=TREES, seed=st.integers(0, 10))
def test_other_base_units_scale_what_has_a_dimension(tree: Any, seed: int) -> None:
    """An expression without contradictions has, in other base units, another value: times that of its dimension."""
    value, problems = interpreted(lambda *leaves: evaluated(tree, jnp, leaves), *UNITS)
    leaves = np.random.default_rng(seed).uniform(0.5, 2.0, len(UNITS))
    scaled = [x * factor(parsed(unit).dimension) for x, unit in zip(leaves, UNITS, strict=True)]
    if not problems and value.dimension is not None:
        with np.errstate(all="ignore"):
            before, after = evaluated(tree, np, leaves), evaluated(tree, np, scaled)
        np.testing.assert_allclose(
            after, before * factor(value.dimension), rtol=1e-9, atol=1e-9 * factor(value.dimension)
        )


@pytest.mark.parametrize(
    ("units", "common"),
    [
        (["1/s", "rad/s"], "rad/s"),
        (["m"], "m"),
        (["mm"], "mm"),
        ([], ""),
        (["m", "mm"], ""),
        (["rad/s", "rpm"], ""),
        (["Hz", "rad/s"], ""),
        (["m", "s"], ""),
    ],
)
def test_units_of_equal_values_have_one_name(units: list[str], common: str) -> None:
    assert common_unit(units) == common
