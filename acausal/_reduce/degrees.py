"""Degree in time of the outputs of a jaxpr equation, from the degrees of its inputs: 0 constant, 1 affine, 2 other."""

from collections.abc import Callable, Sequence

from .._jax_private import ClosedJaxpr, JaxprEqn
from .jaxpr import called, differentiable_call, interpreted, is_floating


def degree_of(eqn: JaxprEqn, degrees: list[int]) -> int:
    """The degree of the outputs between the instants at which a law changes."""
    return _DEGREES.get(eqn.primitive.name, _any_other)(eqn, degrees)


def degrees_of(closed: ClosedJaxpr, inputs: Sequence[int]) -> list[int]:
    """The degrees of all outputs, from those of the inputs."""

    def outputs(eqn: JaxprEqn, degrees: list[int]) -> list[int]:
        inner = called(eqn) or differentiable_call(eqn)
        if inner is not None:
            return degrees_of(inner, degrees)
        return [degree_of(eqn, degrees) if any(degrees) else 0] * len(eqn.outvars)

    return interpreted(closed, inputs, outputs, lambda _: 0)


def _largest(eqn: JaxprEqn, degrees: list[int]) -> int:
    return max(degrees)


def _constant(eqn: JaxprEqn, degrees: list[int]) -> int:
    return 0


def _any_other(eqn: JaxprEqn, degrees: list[int]) -> int:
    return 2


def _of_product(eqn: JaxprEqn, degrees: list[int]) -> int:
    return min(2, sum(degrees))


def _of_quotient(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if degrees[1] == 0 else 2


def _of_choice(eqn: JaxprEqn, degrees: list[int]) -> int:
    """One of several values, selected by an index or a truth value that is constant between instants."""
    return max(degrees[1:]) if degrees[0] == 0 else 2


def _of_picked(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if not any(degrees[1:]) else 2


def _of_conversion(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if is_floating(eqn.outvars[0]) else 0


_DEGREES: dict[str, Callable[[JaxprEqn, list[int]], int]] = {
    **dict.fromkeys(
        ("add", "add_any", "sub", "neg", "max", "min", "abs", "clamp", "reshape", "broadcast_in_dim", "squeeze",
         "transpose", "slice", "rev", "concatenate", "copy", "copy_p", "reduce_sum", "cumsum", "pad", "expand_dims",
         "sort", "reduce_max", "reduce_min", "cummax", "cummin"),
        _largest,
    ),
    **dict.fromkeys(
        ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "xor", "sign", "floor", "ceil", "round", "argmax",
         "argmin", "is_finite"),
        _constant,
    ),
    "mul": _of_product,
    "dot_general": _of_product,
    "div": _of_quotient,
    "rem": _of_quotient,
    "select_n": _of_choice,
    "gather": _of_picked,
    "dynamic_slice": _of_picked,
    "convert_element_type": _of_conversion,
}  # fmt: skip
