"""Indices beyond the arrays that they are used on, for which jax, tracing, takes the nearest member."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._errors import UnknownPartError
from .._jax_private import ClosedJaxpr, JaxprEqn
from .._tracing import is_traced
from .jaxpr import interpreted


def check_bounds(closed: ClosedJaxpr, where: str) -> None:
    """Raise `UnknownPartError` where what is traced from a method reads a member that an array does not have.

    An index that is a number is looked at; none that is computed.
    """

    def outputs(eqn: JaxprEqn, arguments: list[Any]) -> list[Any]:
        name, params = eqn.primitive.name, eqn.params
        if name == "jit":
            return interpreted(params["jaxpr"], arguments, outputs, _index)
        for inner in _inner(params):
            look_at(inner)
        if name in ("dynamic_slice", "gather"):
            for axis, index in (_sliced if name == "dynamic_slice" else _gathered)(eqn, arguments):
                array: Any = eqn.invars[0].aval
                _check(index, array.shape[axis], where)
        return [_computed(name, params, arguments)] * len(eqn.outvars)

    def look_at(program: ClosedJaxpr) -> None:
        unknown: list[Any] = [None] * len(program.in_avals)
        interpreted(program, unknown, outputs, _index)

    look_at(closed)


def _index(value: Any) -> Any:
    """A known number that may be an index; None for all else."""
    is_one = not is_traced(value) and getattr(jnp.result_type(value), "kind", "") in ("b", "i", "u")
    return np.asarray(value) if is_one else None


def _inner(params: dict[str, Any]) -> list[ClosedJaxpr]:
    """The programs within an equation."""
    values = [item for value in params.values() for item in (value if isinstance(value, tuple) else (value,))]
    return [value for value in values if isinstance(value, ClosedJaxpr)]


def _sliced(eqn: JaxprEqn, arguments: list[Any]) -> list[tuple[int, Any]]:
    """The axes of which one member is read, and which one."""
    sizes = eqn.params["slice_sizes"]
    return [(axis, index) for axis, index in enumerate(arguments[1:]) if sizes[axis] == 1 and index is not None]


def _gathered(eqn: JaxprEqn, arguments: list[Any]) -> list[tuple[int, Any]]:
    """The same for several members of each axis."""
    axes, sizes = eqn.params["dimension_numbers"].start_index_map, eqn.params["slice_sizes"]
    if arguments[1] is None or "PROMISE_IN_BOUNDS" not in str(eqn.params["mode"]):
        return []  # or it is said what lies beyond
    return [(axis, arguments[1][..., i]) for i, axis in enumerate(axes) if sizes[axis] == 1]


def _check(index: Any, size: int, where: str) -> None:
    beyond = np.asarray(index)[(index < 0) | (index >= size)]
    if len(beyond):
        first = int(beyond[0])  # to which the size was added where it was negative
        text = f"{where} reads member [{first - size if first < 0 else first}] of an array of {size}: "
        raise UnknownPartError(f"{text}its members are [0] to [{size - 1}], or [-{size}] to [-1].")


def _computed(name: str, params: dict[str, Any], arguments: list[Any]) -> Any:
    """What jax makes of an index before it uses it; None for all else."""
    if name not in _OPERATIONS or any(x is None for x in arguments):
        return None
    return np.asarray(_OPERATIONS[name](params, *arguments))


def _broadcast(params: dict[str, Any], x: Any) -> Any:
    shape, axes = params["shape"], params["broadcast_dimensions"]
    return np.broadcast_to(np.reshape(x, [n if i in axes else 1 for i, n in enumerate(shape)]), shape)


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "lt": lambda params, a, b: a < b,
    "add": lambda params, a, b: a + b,
    "select_n": lambda params, which, *cases: np.choose(which.astype(int), cases),
    "convert_element_type": lambda params, a: a.astype(params["new_dtype"]),
    "broadcast_in_dim": _broadcast,
}
