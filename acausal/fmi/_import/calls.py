"""Functions of an FMU as functions of JAX, with derivatives in both modes."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero

from ..._errors import ModelError
from .functions import SECOND_STEP, central

Host: TypeAlias = Callable[[int, np.ndarray, np.ndarray], np.ndarray]  # of the discrete state, the point, parameters


@dataclasses.dataclass(frozen=True)
class HostCall:
    """A function of an FMU. The derivatives have one more axis, of the point or of the parameters.

    Raises `ModelError` where a derivative is needed that does not exist.
    """

    host: Host
    shape: tuple[int, ...]
    by_point: "Derivative"
    by_parameters: "Derivative"

    def __call__(self, number: Array, point: Array, parameters: Array) -> Array:
        return _function(self)(jnp.asarray(number, float), point, parameters)


@ft.cache
def _function(call: HostCall) -> Callable[[Array, Array, Array], Array]:
    result = jax.ShapeDtypeStruct(call.shape, jax.dtypes.canonicalize_dtype(float))

    def evaluate(number: Array, point: Array, parameters: Array) -> np.ndarray:
        arguments = float(number), np.asarray(point, float), np.asarray(parameters, float)
        if not all(np.all(np.isfinite(argument)) for argument in arguments):
            return np.full(call.shape, np.nan)  # a trial of the solver that failed elsewhere
        return np.asarray(call.host(int(arguments[0]), *arguments[1:]), result.dtype).reshape(call.shape)

    @jax.custom_jvp
    def function(number: Array, point: Array, parameters: Array) -> Array:
        return jax.pure_callback(evaluate, result, number, point, parameters, vmap_method="sequential")

    @ft.partial(function.defjvp, symbolic_zeros=True)
    def _(primals: tuple[Array, Array, Array], tangents: tuple) -> tuple[Array, Array]:
        change = jnp.zeros(call.shape)
        for derivative, tangent in zip((call.by_point, call.by_parameters), tangents[1:], strict=True):
            if not isinstance(tangent, SymbolicZero) and jnp.size(tangent):
                change = change + jnp.tensordot(derivative()(*primals), tangent, 1)
        return function(*primals), change

    return function


Derivative: TypeAlias = Callable[[], HostCall]


def call_of(host: Host, shape: tuple[int, ...], by_point: Derivative, by_parameters: Derivative) -> HostCall:
    """A function whose derivatives are made once, when they are first needed."""
    return HostCall(host, shape, ft.cache(by_point), ft.cache(by_parameters))


def differenced(host: Host, shape: tuple[int, ...], sizes: tuple[int, int]) -> HostCall:
    """A function whose derivatives are differences and have no derivatives themselves.

    It stands for first derivatives: those of the second order serve a solver in the derivatives of its Jacobian, which
    do not change to what its steps converge. `sizes` are those of the point and the parameters.
    """

    def by_point(number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        return central(lambda v: host(number, v, parameters), point, SECOND_STEP)

    def by_parameters(number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        return central(lambda p: host(number, point, p), parameters, SECOND_STEP)

    return call_of(
        host,
        shape,
        lambda: HostCall(by_point, (*shape, sizes[0]), _no_third, _no_third),
        lambda: HostCall(by_parameters, (*shape, sizes[1]), _no_third, _no_third),
    )


def _no_third() -> HostCall:
    raise ModelError("An FMU has derivatives up to the second, and the second serve the solver only.")
