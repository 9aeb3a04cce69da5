"""What is used of diffrax beyond its documented interface: a version that moves it is met here alone.

Its loop over the steps is `_loop` of each adjoint; those of `_integrate/adjoint.py` replace it by `with_short_start` of
it. It begins with the number that lies a hundred floating-point numbers before the end of the run, and asks equinox a
hundred times for the next one, which is a quarter of what XLA takes for a small model.

`solve` is its `diffeqsolve` without the checks of times while a program runs: a program that can raise an error calls
Python, and is compiled in each process anew.
"""

import dataclasses
import functools as ft
import inspect
import types
from collections.abc import Callable
from typing import Any, TypeVar

import diffrax
import equinox.internal as internal
import jax
import jax.numpy as jnp
from jax import Array

from ._numbers import Numbers

T = TypeVar("T")


@dataclasses.dataclass(frozen=True, eq=False)
class Before:
    """The number `count` floating-point numbers before another one, or up to twice as many; computed where it is
    compared.
    """

    number: Numbers
    count: int

    def __jax_array__(self) -> Array:
        number = jax.lax.stop_gradient(jnp.asarray(self.number))
        smallest = jnp.finfo(number.dtype)
        return number - self.count * (smallest.eps * jnp.abs(number) + smallest.tiny)


class _Internal(types.ModuleType):
    """`equinox.internal`, but for two functions."""

    def __getattr__(self, name: str) -> Any:
        return getattr(internal, name)

    @staticmethod
    def error_if(x: T, pred: Any, msg: str) -> T:
        """The number, unchecked."""
        del pred, msg
        return x

    @staticmethod
    def prevbefore(x: "Before | Numbers") -> Before:
        """The number before."""
        return Before(x.number, x.count + 1) if isinstance(x, Before) else Before(x, 1)


def piece_of(dense: diffrax.DenseInterpolation, t: Array) -> diffrax.AbstractLocalInterpolation:
    """The dense output of the step in which a time lies."""
    return dense._get_local_interpolation(t * dense.direction, left=True)


@ft.cache
def with_short_start(loop: Callable[..., Any]) -> Callable[..., Any]:
    """The loop of diffrax, where the end of a run less some rounding is one operation."""
    return _with_own_internal(loop)


@ft.cache
def _unchecked() -> Callable[..., diffrax.Solution]:
    return _with_own_internal(inspect.unwrap(diffrax.diffeqsolve))


def solve(*args: Any, **kwargs: Any) -> diffrax.Solution:
    """As `diffrax.diffeqsolve`, of a first step and times to save at that are known to be in order."""
    return _unchecked()(*args, **kwargs)


def _with_own_internal(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of diffrax that finds `_Internal` as `equinox.internal`. What is no function is left."""
    if not isinstance(function, types.FunctionType):
        return function
    names = function.__globals__ | {"eqxi": _Internal("internal")}
    own = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    own.__kwdefaults__ = function.__kwdefaults__
    return own
