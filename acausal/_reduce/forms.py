"""Dependence of the output of a jaxpr on each input: none, linear with a coefficient, or nonlinear.

The jaxpr is interpreted with `Form`s instead of numbers. A form is a sum of terms, coefficient x input, plus a part
that depends nonlinearly on other inputs. For a coefficient, the possible signs and the inputs that it depends on are
known: an input may be solved for by division only if its coefficient cannot be zero.
"""

import dataclasses
import functools as ft
import math
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import MOVES, bind, called, differentiable_call, interpreted, shape_of

Signs = frozenset[int]
ANY: Signs = frozenset((-1, 0, 1))
POSITIVE: Signs = frozenset((1,))
NONNEGATIVE: Signs = frozenset((0, 1))
NONZERO: Signs = frozenset((-1, 1))


def _sign_sum(a: Signs, b: Signs) -> Signs:
    sums = ({-1, 0, 1} if i * j < 0 else {max(i, j, key=abs)} for i in a for j in b)
    return frozenset().union(*sums)


def _sign_product(a: Signs, b: Signs) -> Signs:
    return frozenset(i * j for i in a for j in b)


@dataclasses.dataclass(frozen=True)
class Coefficient:
    """The factor of an input. `number` is its value if it is fixed; `on` are the inputs that it depends on.

    `elementwise`: element j of the output depends only on element j of the input.
    """

    signs: Signs
    number: float | None
    on: frozenset[int]
    elementwise: bool

    @property
    def cannot_vanish(self) -> bool:
        return 0 not in self.signs and self.elementwise

    def times(self, other: "Form") -> "Coefficient":
        number = None if self.number is None or other.number is None else self.number * other.number
        signs = _sign_product(self.signs, other.signs)
        return Coefficient(signs, number, self.on | other.inputs, self.elementwise)

    def plus(self, other: "Coefficient") -> "Coefficient":
        number = None if self.number is None or other.number is None else self.number + other.number
        signs = _sign_sum(self.signs, other.signs) if number is None else frozenset((int(np.sign(number)),))
        return Coefficient(signs, number, self.on | other.on, self.elementwise and other.elementwise)


@dataclasses.dataclass(frozen=True)
class Form:
    """A value: `terms` by input, `nonlinear` inputs, the possible `signs`, and its `number` if it is constant.

    `has_rest`: the value has a part besides the terms.
    """

    signs: Signs = ANY
    number: float | None = None
    terms: dict[int, Coefficient] = dataclasses.field(default_factory=dict)
    nonlinear: frozenset[int] = frozenset()
    has_rest: bool = True

    @ft.cached_property
    def inputs(self) -> frozenset[int]:
        return self.nonlinear | self.terms.keys()


def constant(value: float) -> Form:
    values = np.unique(np.sign(np.asarray(value, dtype=float)))
    number = float(np.ravel(value)[0]) if np.size(value) and np.all(np.ravel(value) == np.ravel(value)[0]) else None
    signs = ANY if np.any(np.isnan(values)) else frozenset(int(s) for s in values)
    return Form(signs, number, has_rest=number != 0)


def variable(index: int) -> Form:
    return Form(ANY, None, {index: Coefficient(POSITIVE, 1.0, frozenset(), True)}, has_rest=False)


def parameter(signs: Signs) -> Form:
    return Form(signs)


def _negated(a: Form) -> Form:
    return _product(constant(-1.0), a)


def _sum(a: Form, b: Form) -> Form:
    terms = dict(a.terms)
    for index, coefficient in b.terms.items():
        terms[index] = terms[index].plus(coefficient) if index in terms else coefficient
    nonlinear = a.nonlinear | b.nonlinear
    terms = {i: c for i, c in terms.items() if i not in nonlinear and c.number != 0}
    number = None if a.number is None or b.number is None else a.number + b.number
    return Form(_sign_sum(a.signs, b.signs), number, terms, nonlinear, a.has_rest or b.has_rest)


def _product(a: Form, b: Form) -> Form:
    if a.number == 0 or b.number == 0:
        return constant(0.0)
    shared = a.inputs & b.inputs
    nonlinear = a.nonlinear | b.nonlinear | shared
    # The coefficient of x in (c x + ...) b is c b. If both factors have inputs, the terms of each contain those of
    # the other and do not add up to the product: it counts as having a rest.
    terms = {i: c.times(b) for i, c in a.terms.items() if i not in nonlinear}
    terms |= {i: c.times(a) for i, c in b.terms.items() if i not in nonlinear}
    number = None if a.number is None or b.number is None else a.number * b.number
    has_rest = (a.has_rest and b.has_rest) or bool(a.inputs and b.inputs)
    return Form(_sign_product(a.signs, b.signs), number, terms, nonlinear, has_rest)


def _quotient(a: Form, b: Form) -> Form:
    number = 1.0 / b.number if b.number else None
    return _product(a, Form(b.signs, number, {}, b.inputs, True))


def _opaque(forms: Sequence[Form], signs: Signs = ANY) -> Form:
    return Form(signs, None, {}, frozenset().union(*(form.inputs for form in forms)), True)


def _spread(form: Form, *, elementwise: bool) -> Form:
    """A linear rearrangement, such as a reshape or a sum over elements."""
    if elementwise:
        return form
    terms = {
        i: dataclasses.replace(c, elementwise=False, number=None, signs=ANY) for i, c in form.terms.items()
    }  # fmt: skip
    return Form(form.signs, form.number, terms, form.nonlinear, form.has_rest)


def _power(a: Form, exponent: int) -> Form:
    if exponent == 1:
        return a
    signs = frozenset(s**2 if exponent % 2 == 0 else s for s in a.signs)
    if not a.inputs:
        return Form(signs, None if a.number is None else a.number**exponent if exponent > 0 or a.number else None)
    return _opaque([a], signs)


_REARRANGE = MOVES | {"reduce_sum", "cumsum", "dynamic_slice", "gather"}
_KEEP = {"convert_element_type", "copy", "copy_p", "optimization_barrier", "reduce_precision"}
_SIGNS: dict[str, Callable[[Signs], Signs]] = {
    "exp": lambda s: POSITIVE,
    "exp2": lambda s: POSITIVE,
    "cosh": lambda s: POSITIVE,
    "logistic": lambda s: POSITIVE,
    "sqrt": lambda s: s & NONNEGATIVE if s & NONNEGATIVE else NONNEGATIVE,
    "abs": lambda s: frozenset(abs(i) for i in s),
    "square": lambda s: frozenset(i * i for i in s),
    "tanh": lambda s: s,
    "sinh": lambda s: s,
    "atan": lambda s: s,
    "sign": lambda s: s,
    "cbrt": lambda s: s,
}


def _rearranged(eqn: JaxprEqn, forms: Sequence[Form]) -> Form:
    source, target = shape_of(eqn.invars[0]), shape_of(eqn.outvars[0])
    same = source == target or math.prod(source) == math.prod(target) == 1
    moves = eqn.primitive.name in ("transpose", "rev", "cumsum", "gather", "dynamic_slice") and math.prod(target) > 1
    result = _spread(forms[0], elementwise=same and not moves)
    extra = [form for form in forms[1:] if form.inputs]
    return _opaque(forms) if extra else result


def _dot(a: Form, b: Form) -> Form:
    return _spread(_product(a, b), elementwise=False)


def _chosen(which: Form, cases: Sequence[Form]) -> Form:
    """One of several values: linear in the inputs that all of them are linear in and the choice does not depend on."""
    nonlinear = which.inputs.union(*(case.nonlinear for case in cases))
    absent = Coefficient(frozenset((0,)), 0.0, frozenset(), True)
    terms = {}
    for index in frozenset().union(*(case.terms.keys() for case in cases)) - nonlinear:
        found = [case.terms.get(index, absent) for case in cases]
        numbers = {coefficient.number for coefficient in found}
        terms[index] = Coefficient(
            frozenset().union(*(coefficient.signs for coefficient in found)),
            numbers.pop() if len(numbers) == 1 else None,
            which.inputs.union(*(coefficient.on for coefficient in found)),
            all(coefficient.elementwise for coefficient in found),
        )
    return Form(_any_of(cases), None, terms, nonlinear, any(case.has_rest for case in cases) or bool(which.inputs))


def _joined(forms: Sequence[Form]) -> Form:
    """A concatenation: each element comes from one of the pieces."""
    total = ft.reduce(_sum, forms)
    return _spread(dataclasses.replace(total, signs=_any_of(forms), number=None, has_rest=True), elementwise=False)


def _any_of(forms: Sequence[Form]) -> Signs:
    return frozenset().union(*(form.signs for form in forms))


def applied(eqn: JaxprEqn, forms: Sequence[Form]) -> list[Form]:
    """The forms of the outputs of an equation of a jaxpr."""
    name = eqn.primitive.name
    inner = called(eqn) or differentiable_call(eqn)
    if inner is not None:
        return interpret(inner, forms)
    if name in ("add", "add_any"):
        return [_sum(*forms)]
    if name == "sub":
        return [_sum(forms[0], _negated(forms[1]))]
    if name == "neg":
        return [_negated(forms[0])]
    if name == "mul":
        return [_product(*forms)]
    if name == "div":
        return [_quotient(*forms)]
    if name == "dot_general":
        return [_dot(*forms)]
    if name == "integer_pow":
        return [_power(forms[0], eqn.params["y"])]
    if name in _KEEP:
        return list(forms)
    if name in _REARRANGE:
        return [_rearranged(eqn, forms)]
    if name == "select_n":
        return [_chosen(forms[0], forms[1:])]
    if name in ("concatenate", "stack"):
        return [_joined(forms)]
    if name in _SIGNS:
        return [_opaque(forms, _SIGNS[name](forms[0].signs))]
    if name in ("max", "min"):
        pairs = ((i, j) for i in forms[0].signs for j in forms[1].signs)
        return [_opaque(forms, frozenset(max(p) if name == "max" else min(p) for p in pairs))]
    return [_opaque(forms) for _ in eqn.outvars]


def interpret(closed: ClosedJaxpr, inputs: Sequence[Form]) -> list[Form]:
    """The forms of the outputs of a jaxpr whose inputs have the given forms."""
    return interpreted(closed, inputs, applied, constant)


_INVERSES: dict[tuple[str, int], Callable[[Array, Array], Array]] = {  # by operation and place of its unknown argument
    **dict.fromkeys((("add", 0), ("add", 1), ("add_any", 0), ("add_any", 1)), lambda result, other: result - other),
    ("sub", 0): lambda result, other: result + other,
    ("sub", 1): lambda result, other: other - result,
    ("neg", 0): lambda result, _: -result,
    **dict.fromkeys((("mul", 0), ("mul", 1)), lambda result, other: result / other),
    ("div", 0): lambda result, other: result * other,
    ("div", 1): lambda result, other: other / result,
}


def solved_for(closed: ClosedJaxpr, forms: Sequence[Form], position: int) -> ClosedJaxpr | None:
    """The residual x - f(other inputs) with the same roots x, which is the input at `position`.

    None if x occurs more than once, if an operation on it has no inverse, or if x is the factor of a value that may be
    zero or the divisor of one. `forms` are those of the inputs.
    """
    if not _is_invertible(closed, forms, position):
        return None

    def residual(*values: Array) -> Array:
        passed: list[tuple[JaxprEqn, list[Array | None]]] = []

        def outputs(eqn: JaxprEqn, args: list[Array | None]) -> Sequence[Array | None]:
            known = [arg for arg in args if arg is not None]
            if len(known) == len(args):
                return bind(eqn, known)
            passed.append((eqn, args))
            return [None]

        interpreted(closed, [None if i == position else value for i, value in enumerate(values)], outputs, jnp.asarray)
        solution = jnp.zeros_like(values[position])
        for eqn, args in reversed(passed):
            place = args.index(None)
            others = [arg for arg in args if arg is not None]
            solution = _INVERSES[eqn.primitive.name, place](solution, *(others or [solution]))
        return values[position] - solution

    return jax.make_jaxpr(residual)(*closed.in_avals)


def _is_invertible(closed: ClosedJaxpr, forms: Sequence[Form], position: int) -> bool:
    answers: list[bool] = []

    def outputs(eqn: JaxprEqn, args: list[tuple[Form, bool]]) -> Sequence[tuple[Form, bool]]:
        unknown = [place for place, (_, depends) in enumerate(args) if depends]
        if unknown:
            answers.append(len(unknown) == 1 and _has_inverse(eqn, unknown[0], [form for form, _ in args]))
        return [(form, bool(unknown)) for form in applied(eqn, [form for form, _ in args])]

    interpreted(
        closed, [(form, i == position) for i, form in enumerate(forms)], outputs, lambda x: (constant(x), False)
    )
    return all(answers)


def _has_inverse(eqn: JaxprEqn, place: int, forms: Sequence[Form]) -> bool:
    key = (eqn.primitive.name, place)
    cannot_vanish = all(0 not in form.signs for i, form in enumerate(forms) if i != place)
    needs_other = eqn.primitive.name == "mul" or key == ("div", 1)
    return (
        key in _INVERSES
        and (cannot_vanish or not needs_other)
        and shape_of(eqn.invars[place]) == shape_of(eqn.outvars[0])
    )
