"""The functions of the Modelica language (Modelica 3.6, sections 3.7, 10.6 and 16)."""

import math
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from .values import Value, by_field, function, is_known, number, plain, shape_of, stacked


def _xp(*args: Value) -> Any:
    return np if all(is_known(arg) for arg in args) else jnp


def _check_divisor(y: Value) -> None:
    if isinstance(y, int | float) and y == 0:
        raise ModelError("`div`, `mod` and `rem` cannot divide by zero.")


def _div(x: Value, y: Value) -> Value:
    _check_divisor(y)
    if isinstance(x, int) and isinstance(y, int):
        return math.trunc(x / y)
    return plain(_xp(x, y).trunc(x / y))


def _mod(x: Value, y: Value) -> Value:
    _check_divisor(y)
    return x % y if isinstance(x, int | float) and isinstance(y, int | float) else plain(_xp(x, y).mod(x, y))


def _rem(x: Value, y: Value) -> Value:
    return plain(x - _div(x, y) * y)


def _integer(x: Value) -> Value:
    return math.floor(x) if isinstance(x, bool | int | float) else plain(_xp(x).floor(x))


def _sign(x: Value) -> Value:
    return plain(_xp(x).sign(number(x)))


def _extreme(of_array: str, of_two: str) -> Callable[..., Value]:
    def call(*args: Value) -> Value:
        if len(args) == 1:
            return plain(getattr(_xp(args[0]), of_array)(args[0]))
        return plain(getattr(_xp(*args), of_two)(*args))

    return call


def _fill(value: Value, *sizes: Value) -> Value:
    shape = tuple(int(size) for size in sizes)
    return by_field(value, lambda x: _xp(x).broadcast_to(x, shape + np.shape(x)) if shape else x)


def _cat(axis: Value, *arrays: Value) -> Value:
    return _xp(*arrays).concatenate([_xp(*arrays).asarray(array) for array in arrays], axis=int(axis) - 1)


def _size(array: Value, axis: Value | None = None) -> Value:
    shape = shape_of(array)
    return np.array(shape, int) if axis is None else int(shape[int(axis) - 1])


def _diagonal(v: Value) -> Value:
    return _xp(v).diag(v)


def _skew(v: Value) -> Value:
    return stacked([stacked([0.0, -v[2], v[1]]), stacked([v[2], 0.0, -v[0]]), stacked([-v[1], v[0], 0.0])])


def _symmetric(a: Value) -> Value:
    upper = _xp(a).triu(a)
    return upper + _xp(a).triu(a, 1).T


def _outer(a: Value, b: Value) -> Value:
    return _xp(a, b).outer(a, b)


def _cross(a: Value, b: Value) -> Value:
    xp = _xp(a, b)
    a, b = xp.asarray(a), xp.asarray(b)
    return xp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _scalar(a: Value) -> Value:
    return plain(_xp(a).reshape(a, ()))


def _matrix(a: Value) -> Value:
    shape = np.shape(a)
    rows, columns = (*shape, 1, 1)[:2] if len(shape) < 2 else (shape[0], shape[1])
    return _xp(a).reshape(a, (rows, columns))


def _linspace(a: Value, b: Value, n: Value) -> Value:
    return _xp(a, b).linspace(a, b, int(n))


def _sum(a: Value, axis: Value | None = None) -> Value:
    if axis is not None:
        return _xp(a).sum(number(a), int(axis) - 1)
    return plain(_xp(a).sum(number(a))) if np.ndim(a) else a


FUNCTIONS: dict[str, Callable[..., Value]] = {
    "Abs": function(abs, jnp.abs),
    "Sign": _sign,
    "Sqrt": function(math.sqrt, jnp.sqrt),
    "Sin": function(math.sin, jnp.sin),
    "Cos": function(math.cos, jnp.cos),
    "Tan": function(math.tan, jnp.tan),
    "Asin": function(math.asin, jnp.arcsin),
    "Acos": function(math.acos, jnp.arccos),
    "Atan": function(math.atan, jnp.arctan),
    "Atan2": function(math.atan2, jnp.arctan2),
    "Sinh": function(math.sinh, jnp.sinh),
    "Cosh": function(math.cosh, jnp.cosh),
    "Tanh": function(math.tanh, jnp.tanh),
    "Exp": function(math.exp, jnp.exp),
    "Log": function(math.log, jnp.log),
    "Log10": function(math.log10, jnp.log10),
    "Div": _div,
    "Mod": _mod,
    "Rem": _rem,
    "Integer": _integer,
    "Floor": function(lambda x: float(math.floor(x)), jnp.floor),
    "Ceil": function(lambda x: float(math.ceil(x)), jnp.ceil),
    "Max": _extreme("max", "maximum"),
    "Min": _extreme("min", "minimum"),
    "Sum": _sum,
    "Product": lambda a: plain(_xp(a).prod(a)),
    "Size": _size,
    "Ndims": lambda a: np.ndim(a),
    "Fill": _fill,
    "Zeros": lambda *sizes: _fill(0.0, *sizes),
    "Ones": lambda *sizes: _fill(1.0, *sizes),
    "Identity": lambda n: np.eye(int(n)),
    "Linspace": _linspace,
    "Transpose": lambda a: _xp(a).swapaxes(a, 0, 1),
    "Cat": _cat,
    "Diagonal": _diagonal,
    "Cross": _cross,
    "Skew": _skew,
    "OuterProduct": _outer,
    "Symmetric": _symmetric,
    "Scalar": _scalar,
    "Vector": lambda a: _xp(a).ravel(a),
    "Matrix": _matrix,
    "Homotopy": lambda actual, simplified: actual,
}
