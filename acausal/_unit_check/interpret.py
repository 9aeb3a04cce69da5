"""The dimensions in a jaxpr, and contradictions between them."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from .._jax_private import ClosedJaxpr, Jaxpr, JaxprEqn, scan_counts
from .._reduce.jaxpr import called, differentiable_call, interpreted, shape_of
from .._tracing import is_traced
from .._units.dimension import NUMBER, Dimension, described

_LONGEST = 60
_TINY = 1e-30  # a number this small guards a quotient and has any dimension, like zero

SUM, PRODUCT, ATOM = range(3)  # precedence of an expression


@dataclasses.dataclass(frozen=True)
class Value:
    """A value of a known `dimension`; None fits any.

    `unit`: the declared unit. `number`: the number of a constant. `leaf`: the input without a unit that has the same
    dimension.
    """

    dimension: Dimension | None
    text: str
    rank: int = ATOM
    unit: str | None = None
    number: float | None = None
    leaf: int | None = None

    def __str__(self) -> str:
        if self.dimension is None:
            return self.text
        return f"{self.text} in {described(self.dimension, self.unit)}"

    def within(self, rank: int) -> str:
        """Its text as part of an expression of precedence `rank` or higher."""
        return self.text if self.rank >= rank else f"({self.text})"


def written(dimension: Dimension | None, text: str, rank: int = ATOM, leaf: int | None = None) -> Value:
    """The value of an expression, with an abbreviated text if it is long."""
    if len(text) > _LONGEST:
        text, rank = text[: _LONGEST - 3].rstrip() + "...", ATOM
    return Value(dimension, text, rank, leaf=leaf)


def constant(value: Any) -> Value:
    """The value of a number. Zero, infinity and NaN fit any dimension."""
    if isinstance(value, float | int):
        is_any = abs(value) <= _TINY or not math.isfinite(value)
        return Value(None if is_any else NUMBER, f"{value:g}", number=float(value))
    if is_traced(value) or not np.size(value) or np.asarray(value).dtype.kind not in "biuf":
        return Value(None, "[...]")
    array = np.asarray(value, dtype=float)
    first = float(array.flat[0])
    uniform = bool(np.all(array == first))
    fits_all = bool(np.all((np.abs(array) <= _TINY) | ~np.isfinite(array)))
    text = f"{first:g}" if uniform else "[...]"
    return Value(None if fits_all else NUMBER, text, number=first if uniform else None)


SAME = frozenset(
    """
    neg abs convert_element_type copy copy_p reduce_precision real stop_gradient optimization_barrier broadcast_in_dim
    reshape squeeze expand_dims transpose rev slice dynamic_slice gather split reduce_sum reduce_max reduce_min cumsum
    cummax cummin sort device_put
    """.split()
)
SILENT = SAME - {"abs", "neg", "reduce_sum", "reduce_max", "reduce_min", "cumsum", "cummax", "cummin"}
EQUAL = {
    "add": "adds", "add_any": "adds", "sub": "subtracts", "max": "takes the larger of", "min": "takes the smaller of",
    "rem": "takes the remainder of", "concatenate": "joins", "pad": "pads", "clamp": "limits",
    "dynamic_update_slice": "replaces a part of", "scatter": "replaces a part of", "scatter-add": "adds",
    "nextafter": "compares",
}  # fmt: skip
COMPARED = frozenset("lt le gt ge eq ne lt_to le_to eq_to atan2".split())
NUMBERS = frozenset(
    """
    exp exp2 expm1 log log1p log2 one_minus_square sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh
    logistic erf erfc erf_inv lgamma digamma bessel_i0e bessel_i1e floor ceil round cumprod cumlogsumexp
    """.split()
)
POWERS = {"sqrt": Fraction(1, 2), "cbrt": Fraction(1, 3), "rsqrt": Fraction(-1, 2), "square": Fraction(2)}
PLAIN = frozenset(
    "sign iota and or not xor is_finite argmax argmin reduce_and reduce_or reduce_xor population_count".split()
)


class Interpreter:
    """Interprets a jaxpr with `Value`s, and collects contradictions.

    - `problems`: contradictions in the order of computation.
    - `inferred`: dimensions of inputs without a unit, from the values that they are added to or compared with.
    - `alike`: pairs of such inputs that are added to or compared with each other.

    After a contradiction or an unknown operation, the dimension of the result fits any. With `any_constant`, a constant
    that is added or compared fits any too, as limits in SI units do; as a factor, it is a number.
    """

    def __init__(self, *, any_constant: bool = False) -> None:
        self._any_constant = any_constant
        self.problems: list[str] = []
        self.inferred: dict[int, set[Dimension]] = {}
        self.alike: set[tuple[int, int]] = set()

    def residual(self, closed: ClosedJaxpr, inputs: Sequence[Value]) -> None:
        """Interpret an equation; the outermost difference of the residual counts as its two sides."""
        (result,) = closed.jaxpr.outvars
        self._run(closed, inputs, lambda eqn: "equates" if eqn.outvars[0] is result else None)

    def interpret(self, closed: ClosedJaxpr | Jaxpr, inputs: Sequence[Value]) -> list[Value]:
        """The values of the outputs."""
        return self._run(closed, inputs, lambda eqn: None)

    def require(self, value: Value, dimension: Dimension, complaint: str) -> None:
        """Record the dimension that a value must have."""
        self._infer(value, dimension)
        if value.dimension not in (None, dimension):
            self.problems.append(complaint)

    def sets(self, variable: Value, value: Value) -> None:
        """Record that a variable takes a value."""
        self._equal("sets", "set", [variable, value])

    def _run(
        self, closed: ClosedJaxpr | Jaxpr, inputs: Sequence[Value], verb: Callable[[JaxprEqn], str | None]
    ) -> list[Value]:
        closed = closed if isinstance(closed, ClosedJaxpr) else ClosedJaxpr(closed, [])
        return interpreted(closed, inputs, lambda eqn, values: self._apply(eqn, values, verb(eqn)), self._constant)

    def _constant(self, value: Any) -> Value:
        found = constant(value)
        is_mixed = self._any_constant and found.number is None
        return dataclasses.replace(found, dimension=None) if is_mixed else found

    def _apply(self, eqn: JaxprEqn, values: list[Value], verb: str | None) -> list[Value]:
        name = eqn.primitive.name
        match name:
            case "mul" | "dot_general":
                return [_product(*values)]
            case "div":
                return [_quotient(*values)]
            case "integer_pow":
                return [_power(values[0], Fraction(eqn.params["y"]))]
            case "pow":
                return [self._general_power(*values)]
            case "stack":
                return [_stacked(values)]
            case "select_n":
                return [self._choice(values[1:])]
            case "cond":
                return self._branches(eqn.params["branches"], values[1:])
            case "while":
                return self._while(eqn, values)
            case "scan":
                return self._scan(eqn, values)
            case "reduce_prod" if values[0].number is None:
                ratio = Fraction(_count(eqn.invars[0]), max(_count(eqn.outvars[0]), 1))
                return [_power(values[0], ratio)]
        if name in SAME:
            return [_kept(name, value) for value in (values * len(eqn.outvars))[: len(eqn.outvars)]]
        if name in EQUAL:
            operands = values[::2] if name.startswith("scatter") else values
            return [self._equal(verb or EQUAL[name], name, operands[:2] if "update" in name else operands)]
        if name in COMPARED:
            self._equal("compares", name, values)
            return [written(NUMBER, f"{name}({values[0].text}, {values[1].text})")]
        if name in NUMBERS:
            return [self._function(name, values[0])]
        if name in POWERS:
            return [_power(values[0], POWERS[name], name)]
        if name in PLAIN:
            return [written(NUMBER, f"{name}(...)") for _ in eqn.outvars]
        return self._call(eqn, values) or [Value(None, f"{name}(...)") for _ in eqn.outvars]

    def _call(self, eqn: JaxprEqn, values: list[Value]) -> list[Value] | None:
        """A primitive that applies one jaxpr to its operands, such as `jit`, `custom_jvp_call` or `checkpoint`."""
        if eqn.params.get("name") == "hypot":  # it compares its arguments with the range of numbers
            return [self._equal(EQUAL["add"], "hypot", values)]
        bodies = [param for param in eqn.params.values() if isinstance(param, ClosedJaxpr | Jaxpr)]
        bodies = bodies or [body for body in (called(eqn), differentiable_call(eqn)) if body is not None]
        if len(bodies) != 1:
            return None
        jaxpr = bodies[0].jaxpr if isinstance(bodies[0], ClosedJaxpr) else bodies[0]
        fits = (len(jaxpr.invars), len(jaxpr.outvars)) == (len(values), len(eqn.outvars))
        return self.interpret(bodies[0], values) if fits else None

    def _infer(self, value: Value, dimension: Dimension | None) -> None:
        if value.leaf is not None and dimension is not None:
            self.inferred.setdefault(value.leaf, set()).add(dimension)

    def _equal(self, verb: str, name: str, values: Sequence[Value]) -> Value:
        """The result of an operation on operands of one dimension."""
        text, rank = _joined(name, values)
        if self._any_constant:
            values = [value for value in values if value.number is None] or values
        leaves = [value.leaf for value in values if value.leaf is not None]
        self.alike |= {(a, b) for a, b in itertools.pairwise(leaves) if a != b}
        known = [value for value in values if value.dimension is not None]
        for value in values:
            self._infer(value, known[0].dimension if known else None)
        if len({value.dimension for value in known}) > 1:
            other = next(value for value in known if value.dimension != known[0].dimension)
            self.problems.append(_contradiction(verb, known[0], other))
            return written(None, text, rank)
        return written(known[0].dimension if known else None, text, rank, leaves[0] if leaves and not known else None)

    def _choice(self, values: Sequence[Value]) -> Value:
        if all(value.number is not None for value in values):
            return self._equal("chooses between", "where", values)
        # A plain 1 guards a denominator, as in 1 / jnp.where(x > 0, x, 1).
        quantities = [value for value in values if value.number != 1.0]
        return self._equal("chooses between", "where", quantities)

    def _function(self, name: str, value: Value) -> Value:
        text = f"{name}({value.text})"
        self.require(value, NUMBER, f"takes {name} of {value}, which is not a number")
        return written(NUMBER, text)

    def _general_power(self, x: Value, y: Value) -> Value:
        if y.number is not None and math.isfinite(y.number):
            return _power(x, Fraction(y.number).limit_denominator(1000))
        text = f"{x.within(ATOM)}**{y.within(ATOM)}"
        self.require(y, NUMBER, f"takes {x.text} to the power of {y}, which is not a number")
        if x.dimension is not None:
            self.require(x, NUMBER, f"takes {x} to a variable power, so the result has no unit")
        return written(NUMBER if x.dimension == NUMBER else None, text)

    def _branches(self, branches: Sequence[ClosedJaxpr], values: list[Value]) -> list[Value]:
        results = [self.interpret(branch, values) for branch in branches]
        return [self._equal("chooses between", "cond", list(column)) for column in zip(*results, strict=True)]

    def _while(self, eqn: JaxprEqn, values: list[Value]) -> list[Value]:
        n_test, n_body = eqn.params["cond_nconsts"], eqn.params["body_nconsts"]
        test, fixed, carry = values[:n_test], values[n_test : n_test + n_body], values[n_test + n_body :]
        carry = self._settled(carry, lambda inner, now: inner.interpret(eqn.params["body_jaxpr"], [*fixed, *now]))
        self.interpret(eqn.params["cond_jaxpr"], [*test, *carry])
        return self.interpret(eqn.params["body_jaxpr"], [*fixed, *carry])

    def _scan(self, eqn: JaxprEqn, values: list[Value]) -> list[Value]:
        body, (n_fixed, n_carry) = eqn.params["jaxpr"], scan_counts(eqn)
        fixed, carry, rows = values[:n_fixed], values[n_fixed : n_fixed + n_carry], values[n_fixed + n_carry :]
        carry = self._settled(carry, lambda inner, now: inner.interpret(body, [*fixed, *now, *rows])[:n_carry])
        return self.interpret(body, [*fixed, *carry, *rows])

    def _settled(self, carry: list[Value], step: Callable[["Interpreter", list[Value]], list[Value]]) -> list[Value]:
        """Carried values of a loop: one that starts at zero gets a dimension, one whose dimension changes has none."""
        carry = [Value(value.dimension, value.text) for value in carry]
        after = step(Interpreter(any_constant=self._any_constant), carry)
        while any(a.dimension is None and b.dimension is not None for a, b in zip(carry, after, strict=True)):
            carry = [
                a if a.dimension is not None else Value(b.dimension, a.text) for a, b in zip(carry, after, strict=True)
            ]
            after = step(Interpreter(any_constant=self._any_constant), carry)
        return [
            a if b.dimension in (None, a.dimension) else Value(None, a.text) for a, b in zip(carry, after, strict=True)
        ]


def _count(atom: Any) -> int:
    return math.prod(shape_of(atom))


def _contradiction(verb: str, a: Value, b: Value) -> str:
    word = {"adds": "to", "subtracts": "from", "equates": "with", "compares": "with", "sets": "to"}.get(verb, "and")
    first, second = (b, a) if verb == "subtracts" else (a, b)
    return f"{verb} {first} {word} {second}"


def _kept(name: str, value: Value) -> Value:
    if name in SILENT:
        return value
    if name == "neg":
        return Value(value.dimension, f"-{value.within(PRODUCT)}", PRODUCT, value.unit, None, value.leaf)
    shown = name.removeprefix("reduce_")
    return written(value.dimension, f"{shown}({value.text})", ATOM, value.leaf)


def _joined(name: str, values: Sequence[Value]) -> tuple[str, int]:
    if name in ("add", "add_any"):
        return f"{values[0].text} + {values[1].text}", SUM
    if name == "sub":
        return f"{values[0].text} - {values[1].within(PRODUCT)}", SUM
    return f"{name}({', '.join(value.text for value in values)})", ATOM


def _product(a: Value, b: Value) -> Value:
    dimension = None if a.dimension is None or b.dimension is None else a.dimension * b.dimension
    return written(dimension, f"{a.within(PRODUCT)} * {b.within(PRODUCT)}", PRODUCT)


def _quotient(a: Value, b: Value) -> Value:
    dimension = None if a.dimension is None or b.dimension is None else a.dimension / b.dimension
    return written(dimension, f"{a.within(PRODUCT)} / {b.within(ATOM)}", PRODUCT)


def _stacked(values: list[Value]) -> Value:
    """A concatenation. Rows may be different quantities, such as the coefficients of a polynomial; the array then has
    no dimension.
    """
    dimensions = {value.dimension for value in values}
    return written(dimensions.pop() if len(dimensions) == 1 else None, f"[{', '.join(v.text for v in values)}]")


def _power(value: Value, exponent: Fraction, function: str | None = None) -> Value:
    text = f"{function}({value.text})" if function and function != "square" else f"{value.within(ATOM)}**{exponent}"
    return written(None if value.dimension is None else value.dimension**exponent, text)
