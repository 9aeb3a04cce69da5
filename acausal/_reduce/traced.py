"""Errors in traced methods of components, reported with the method and the remedy."""

import contextlib
from collections.abc import Iterator
from typing import NoReturn

import jax

from .._errors import ModelError
from .._jax_private import ClosedJaxpr, JaxprEqn, jaxpr_as_fun
from .jaxpr import inner_jaxprs, structs


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
