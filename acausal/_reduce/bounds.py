"""Check of array bounds: tracing jax clips an index beyond an array to its nearest member."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._errors import UnknownPartError
from .._jax_private import ClosedJaxpr, JaxprEqn
from .._tracing import is_traced
from .jaxpr import inner_jaxprs, interpreted


def check_bounds(closed: ClosedJaxpr, where: str) -> None:
    """Raise `UnknownPartError` if a traced method reads beyond an array.

    The check covers constant indices, not computed ones.
    """

    def outputs(eqn: JaxprEqn, arguments: list[Any]) -> list[Any]:
        name, params = eqn.primitive.name, eqn.params
        if name == "jit":
            return interpreted(params["jaxpr"], arguments, outputs, _index)
        for inner in inner_jaxprs(eqn):
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
    """A known number that may be an index; None for other values."""
    is_one = not is_traced(value) and getattr(jnp.result_type(value), "kind", "") in ("b", "i", "u")
    return np.asarray(value) if is_one else None


def _sliced(eqn: JaxprEqn, arguments: list[Any]) -> list[tuple[int, Any]]:
    """The axes from which one member is read, and its index."""
    sizes = eqn.params["slice_sizes"]
    return [(axis, index) for axis, index in enumerate(arguments[1:]) if sizes[axis] == 1 and index is not None]


def _gathered(eqn: JaxprEqn, arguments: list[Any]) -> list[tuple[int, Any]]:
    """The same for several members of each axis."""
    axes, sizes = eqn.params["dimension_numbers"].start_index_map, eqn.params["slice_sizes"]
    if arguments[1] is None or "PROMISE_IN_BOUNDS" not in str(eqn.params["mode"]):
        return []  # the values beyond are defined
    return [(axis, arguments[1][..., i]) for i, axis in enumerate(axes) if sizes[axis] == 1]


def _check(index: Any, size: int, where: str) -> None:
    beyond = np.asarray(index)[(index < 0) | (index >= size)]
    if len(beyond):
        first = int(beyond[0])  # jax has added the size to a negative one
        text = f"{where} reads member [{first - size if first < 0 else first}] of an array of {size}: "
        raise UnknownPartError(f"{text}its members are [0] to [{size - 1}], or [-{size}] to [-1].")


def _computed(name: str, params: dict[str, Any], arguments: list[Any]) -> Any:
    """The result of the conversion of an index by jax; None for other operations."""
    if name not in _OPERATIONS or any(x is None for x in arguments):
        return None
    return np.asarray(_OPERATIONS[name](params, *arguments))


def _broadcast(params: dict[str, Any], x: Any) -> Any:
    own = dict(zip(params["broadcast_dimensions"], np.shape(x), strict=True))
    return np.broadcast_to(np.reshape(x, [own.get(axis, 1) for axis in range(len(params["shape"]))]), params["shape"])


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "lt": lambda params, a, b: a < b,
    "add": lambda params, a, b: a + b,
    "select_n": lambda params, which, *cases: np.choose(which.astype(int), cases),
    "convert_element_type": lambda params, a: a.astype(params["new_dtype"]),
    "broadcast_in_dim": _broadcast,
}
