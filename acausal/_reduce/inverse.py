"""An equation solved for an input that occurs once, by the inverse of each operation between it and the residual."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn
from .forms import Form, applied, constant
from .jaxpr import bind, interpreted, shape_of

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
