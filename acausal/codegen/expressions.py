"""Expressions of C: their text, how tightly they bind, and the helpers that the primitives of jax call."""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

# How tightly an expression binds, from the loosest.
CHOICE, LOGIC, RELATION, SUM, PRODUCT, SIGN, ATOM = range(7)
TYPES = {"f": "double", "b": "int", "i": "int", "u": "unsigned"}  # by the kind of a dtype of NumPy
_RESERVED = frozenset(
    """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    acos acosh asin asinh atan atan2 atanh cbrt ceil cos cosh erf erfc exp exp2 expm1 fabs floor fmod gamma hypot j0 j1
    jn lgamma log log10 log1p log2 main nextafter pow rint round sin sinh sqrt tan tanh y0 y1 yn
    INFINITY NAN isfinite isnan
    abs_int larger larger_int logistic power power_int sign_of sign_of_int smaller smaller_int square within
    """.split()
)


class Expression(NamedTuple):
    text: str
    level: int = ATOM

    def inside(self, level: int) -> str:
        """The text as an operand of an operator that binds as tightly as `level`."""
        return self.text if self.level >= level else f"({self.text})"


def dtype_of(atom: Any) -> np.dtype:
    """The type of a variable or literal of a jaxpr."""
    return np.dtype(atom.aval.dtype)


def kind_of(atom: Any) -> str:
    """The key of this type in `TYPES`."""
    return dtype_of(atom).kind


def number(value: float | int | bool, kind: str) -> Expression:
    """A number, exact to the last bit."""
    if kind != "f":
        text = f"{int(value)}{'u' if kind == 'u' else ''}"
    elif math.isnan(value):
        text = "NAN"
    elif math.isinf(value):
        text = "INFINITY" if value > 0 else "-INFINITY"
    else:
        text = repr(float(value))
    return Expression(text, SIGN if text.startswith("-") else ATOM)


def call(function: str, *args: Expression) -> Expression:
    return Expression(f"{function}({', '.join(arg.text for arg in args)})")


def identifier(name: str) -> str:
    """A name of a model as one of C: `a.b[3]` becomes `a_b_3`."""
    text = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "_"
    text = f"_{text}" if text[0].isdigit() else text
    return f"{text}_" if text in _RESERVED else text


class Names:
    """Different names of C within one scope."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def new(self, name: str) -> str:
        """The name itself, or with a number if it is taken."""
        found = base = identifier(name)
        count = 1
        while found in self._used:
            count += 1
            found = f"{base}_{count}" if base[-1].isdigit() else f"{base}{count}"
        self._used.add(found)
        return found

    def loop(self) -> str:
        """A name for the variable of a loop, free again after `release`."""
        free = [name for name in "ijklmn" if name not in self._used and identifier(name) == name]
        return self.new(free[0] if free else "i")

    def release(self, name: str) -> None:
        self._used.discard(name)


Rule = Callable[..., Expression]  # from the kind of the operands, the parameters of the primitive, and the operands

# Functions that C lacks, or that treat NaN differently from jax.
HELPERS = {
    "larger": "static double larger(double a, double b) { return a > b || isnan(a) ? a : b; }",
    "smaller": "static double smaller(double a, double b) { return a < b || isnan(a) ? a : b; }",
    "larger_int": "static int larger_int(int a, int b) { return a > b ? a : b; }",
    "smaller_int": "static int smaller_int(int a, int b) { return a < b ? a : b; }",
    "sign_of": "static double sign_of(double a) { return isnan(a) ? a : (a > 0.0) - (a < 0.0); }",
    "abs_int": "static int abs_int(int a) { return a < 0 ? -a : a; }",
    "sign_of_int": "static int sign_of_int(int a) { return (a > 0) - (a < 0); }",
    "square": "static double square(double a) { return a * a; }",
    "logistic": "static double logistic(double a) { return 1.0 / (1.0 + exp(-a)); }",
    "power": """static double power(double a, int n)
{
    double result = 1.0;
    for (; n > 0; n /= 2, a *= a)
        if (n % 2)
            result *= a;
    return result;
}""",
    "power_int": """static int power_int(int a, int n)
{
    int result = 1;
    for (; n > 0; n--)
        result *= a;
    return result;
}""",
    "within": "static int within(int i, int most) { return i < 0 ? 0 : i > most ? most : i; }",
}


def _infix(symbol: str, level: int) -> Rule:
    return lambda kind, params, a, b: Expression(f"{a.inside(level)} {symbol} {b.inside(level + 1)}", level)


def _relation(symbol: str) -> Rule:
    return lambda kind, params, a, b: Expression(f"{a.inside(SUM)} {symbol} {b.inside(SUM)}", RELATION)


def _logic(symbol: str, of_integers: str, operands: int = RELATION) -> Rule:
    def rule(kind: str, params: Mapping[str, Any], a: Expression, b: Expression) -> Expression:
        operator, level = (symbol, operands) if kind == "b" else (of_integers, SIGN)
        return Expression(f"{a.inside(level)} {operator} {b.inside(level)}", LOGIC)

    return rule


def _function(name: str) -> Rule:
    return lambda kind, params, *args: call(name, *args)


def _by_kind(name: str, of_integers: str) -> Rule:
    return lambda kind, params, *args: call(name if kind == "f" else of_integers, *args)


def _same(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    return a


def _negative(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    return Expression(f"-{a.inside(SIGN + 1)}", SIGN)


def _not(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    return Expression(f"{'!' if kind == 'b' else '~'}{a.inside(SIGN + 1)}", SIGN)


def _integer_power(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    exponent = params["y"]
    if kind != "f":
        return call("power_int", a, number(exponent, "i"))
    found = call("square", a) if abs(exponent) == 2 else call("power", a, number(abs(exponent), "i"))
    found = a if abs(exponent) == 1 else found
    return found if exponent >= 0 else over_one(found)


def over_one(a: Expression) -> Expression:
    """The reciprocal."""
    return Expression(f"1.0 / {a.inside(PRODUCT + 1)}", PRODUCT)


def _reciprocal_root(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    return over_one(call("sqrt", a))


def _rounded(kind: str, params: Mapping[str, Any], a: Expression) -> Expression:
    return call("rint" if "EVEN" in params["rounding_method"].name else "round", a)


def _remainder(kind: str, params: Mapping[str, Any], a: Expression, b: Expression) -> Expression:
    return call("fmod", a, b) if kind == "f" else _infix("%", PRODUCT)(kind, params, a, b)


def _clamped(kind: str, params: Mapping[str, Any], low: Expression, a: Expression, high: Expression) -> Expression:
    larger, smaller = ("larger", "smaller") if kind == "f" else ("larger_int", "smaller_int")
    return call(smaller, call(larger, a, low), high)


def _chosen(kind: str, params: Mapping[str, Any], which: Expression, *cases: Expression) -> Expression:
    """The cases are those of false and true, or of the numbers from 0."""
    if len(cases) == 2:
        return choice(which, cases[1], cases[0])
    found = cases[-1]
    for i in reversed(range(len(cases) - 1)):
        found = choice(Expression(f"{which.inside(SUM)} == {i}", RELATION), cases[i], found)
    return found


def choice(condition: Expression, if_true: Expression, if_false: Expression) -> Expression:
    return Expression(f"{condition.inside(LOGIC)} ? {if_true.inside(LOGIC)} : {if_false.inside(CHOICE)}", CHOICE)


def converted(a: Expression, source: str, target: str) -> Expression:
    """A value as another type; the kinds are those of `TYPES`."""
    if source == target or (source == "b" and target == "i"):
        return a
    if target == "b":
        return Expression(f"{a.inside(SUM)} != {number(0, source).text}", RELATION)
    name = {"f": "double", "i": "int", "u": "unsigned"}[target]
    return Expression(f"({name}){a.inside(SIGN)}", SIGN)


ELEMENTWISE: dict[str, Rule] = {
    "add": _infix("+", SUM),
    "add_any": _infix("+", SUM),
    "sub": _infix("-", SUM),
    "mul": _infix("*", PRODUCT),
    "div": _infix("/", PRODUCT),
    "neg": _negative,
    "rem": _remainder,
    "pow": _function("pow"),
    "integer_pow": _integer_power,
    "square": lambda kind, params, a: _integer_power(kind, {"y": 2}, a),
    "sqrt": _function("sqrt"),
    "rsqrt": _reciprocal_root,
    "abs": _by_kind("fabs", "abs_int"),
    "sign": _by_kind("sign_of", "sign_of_int"),
    "max": _by_kind("larger", "larger_int"),
    "min": _by_kind("smaller", "smaller_int"),
    "clamp": _clamped,
    "round": _rounded,
    "logistic": _function("logistic"),
    "is_finite": _function("isfinite"),
    "lt": _relation("<"),
    "le": _relation("<="),
    "gt": _relation(">"),
    "ge": _relation(">="),
    "le_to": _relation("<="),  # in searches of sorted numbers; they differ for NaN only
    "lt_to": _relation("<"),
    "eq": _relation("=="),
    "ne": _relation("!="),
    "and": _logic("&&", "&"),
    "or": _logic("||", "|"),
    "xor": _logic("!=", "^", SUM),
    "not": _not,
    "select_n": _chosen,
    **dict.fromkeys(("copy", "copy_p", "stop_gradient", "optimization_barrier", "reduce_precision"), _same),
    **{
        name: _function(name)
        for name in """
        exp exp2 expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh cbrt erf erfc floor
        ceil nextafter
        """.split()
    },
}
