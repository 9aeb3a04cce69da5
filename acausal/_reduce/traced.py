"""Traced methods of components: their errors, their array bounds, and the conditions of `ifelse` in them."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, NoReturn

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.annotations import Declaration
from .._declare.ifelse import HELD
from .._errors import ModelError, UnknownPartError
from .._jax_private import ClosedJaxpr, JaxprEqn, jaxpr_as_fun
from .._tracing import is_traced
from .jaxpr import bind, called, inner_jaxprs, interpreted, slice_outputs, structs


@contextlib.contextmanager
def tracing(where: str) -> Iterator[None]:
    """Raise `ModelError` for an error of Python or jax in a method of a component, naming the method and the remedy."""
    try:
        yield
    except ModelError:
        raise
    except jax.errors.TracerBoolConversionError as error:
        raise ModelError(
            f"{where} needs the truth value of a relation between variables, which is unknown before a run. "
            "Remedy: join relations by &, | and ~ instead of `and`, `or` and `not`, and choose between values by "
            "jnp.where instead of `if`."
        ) from error
    except (
        jax.errors.ConcretizationTypeError,
        jax.errors.TracerArrayConversionError,
        jax.errors.TracerIntegerConversionError,
    ) as error:
        raise ModelError(
            f"{where} needs the number of a variable, which is unknown before a run. Remedy: functions of jax.numpy "
            "instead of numpy and math, without float(...) and int(...)."
        ) from error
    except (TypeError, ValueError, IndexError) as error:
        raise ModelError(f"{where}: {error}") from error


def check_derivatives(closed: ClosedJaxpr, where: str) -> None:
    """Raise `ModelError` for a function with reverse-mode derivatives only."""
    if any(eqn.primitive.name.startswith("custom_vjp_call") for eqn in every_operation(closed)):
        raise ModelError(
            f"{where} calls a function with its own derivative in reverse mode (jax.custom_vjp). A run needs forward "
            "mode too. Remedy: state the derivative by jax.custom_jvp, from which jax derives both modes."
        )


def is_reversible(closed: ClosedJaxpr) -> bool:
    """Whether a program has reverse-mode derivatives; a loop with a length known only at run time has none."""
    if all(eqn.primitive.name != "while" for eqn in every_operation(closed)):
        return True
    function = jaxpr_as_fun(closed)
    try:
        jax.eval_shape(
            lambda *values: jax.vjp(function, *values)[1](function(*values)),
            *structs([aval.shape for aval in closed.in_avals]),
        )
    except ValueError:
        return False
    return True


def every_operation(closed: ClosedJaxpr) -> Iterator[JaxprEqn]:
    """The operations of a program and of its inner programs, except functions with custom derivatives."""
    for eqn in closed.jaxpr.eqns:
        yield eqn
        if eqn.primitive.name == "custom_jvp_call":
            continue
        for inner in inner_jaxprs(eqn):
            yield from every_operation(inner)


class Forbidden:
    """Any computation or comparison raises a `ModelError` with this text. Elements are forbidden, too."""

    def __init__(self, text: str) -> None:
        self._text = text

    def _raise(self, *args: object) -> NoReturn:
        raise ModelError(self._text)

    def __getitem__(self, index: object) -> "Forbidden":
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _raise
    __neg__ = __pow__ = __matmul__ = __rmatmul__ = __float__ = __jax_array__ = _raise
    __lt__ = __le__ = __gt__ = __ge__ = __abs__ = _raise


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


TRUTH = Declaration(role="discrete", unit="1", start=0.0)
_LOOPS = ("cond", "while", "scan")


class Held(NamedTuple):
    """`equations` reads the truths, 0 or 1, after its other inputs. `conditions` computes them from the inputs and the
    truths of other conditions.
    """

    equations: ClosedJaxpr
    conditions: ClosedJaxpr
    shapes: tuple[tuple[int, ...], ...]


def with_truths(closed: ClosedJaxpr, where: str) -> Held:
    """The traced `equations`, split. Raises `ModelError` for an `ifelse` within a loop."""
    shapes = tuple(_shapes(closed, where))
    n, n_truths = len(closed.jaxpr.invars), len(shapes)
    if not n_truths:
        return Held(closed, closed, ())

    def apart(*inputs: Array) -> tuple[list[Array], list[Array]]:
        truths, found = list(inputs[n:]), []

        def outputs(eqn: JaxprEqn, args: list[Array]) -> Sequence[Array]:
            if _is_held(eqn):
                found.append(args[0])
                return [truths[len(found) - 1] > 0.5]
            inner = called(eqn)
            return bind(eqn, args) if inner is None else interpreted(inner, args, outputs, jnp.asarray)

        return interpreted(closed, inputs[:n], outputs, jnp.asarray), found

    both = jax.make_jaxpr(apart)(*structs([var.aval.shape for var in closed.jaxpr.invars]), *structs(shapes))
    m = len(closed.jaxpr.outvars)
    # All inputs stay, so that their positions do.
    return Held(_outputs(both, slice(0, m)), _outputs(both, slice(m, m + n_truths)), shapes)


def _outputs(closed: ClosedJaxpr, outputs: slice) -> ClosedJaxpr:
    piece = slice_outputs(closed, outputs)
    inner = piece.jaxpr

    def function(*inputs: Array) -> list[Array]:
        return list(jaxpr_as_fun(inner)(*(inputs[i] for i in piece.used)))

    return jax.make_jaxpr(function)(
        *(jax.ShapeDtypeStruct(var.aval.shape, var.aval.dtype) for var in closed.jaxpr.invars)
    )


def _is_held(eqn: JaxprEqn) -> bool:
    return eqn.primitive.name in ("jit", "pjit") and eqn.params.get("name") == HELD


def _shapes(closed: ClosedJaxpr, where: str) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []
    for eqn in closed.jaxpr.eqns:
        if _is_held(eqn):
            found.append(tuple(eqn.outvars[0].aval.shape))
        elif eqn.primitive.name in _LOOPS or eqn.primitive.name.startswith("custom_"):
            if HELD in str(eqn):
                raise ModelError(
                    f"{where} uses ifelse within {eqn.primitive.name}, but each ifelse holds only one "
                    "truth value. Remedy: state it outside, or use jnp.where there."
                )
        elif (inner := called(eqn)) is not None:
            found += _shapes(inner, where)
    return found
