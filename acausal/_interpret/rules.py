"""The primitives of jax as functions of NumPy arrays, except those that `simplified` leaves out.

A rule takes an equation of a jaxpr and returns the function that evaluates it. Values are arrays or NumPy scalars of
the equation's types. No function changes its arguments.
"""

import functools as ft
import operator
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import scipy  # imports its parts on use: they take longer than the library itself

from .._jax_private import JaxprEqn

Value: TypeAlias = Any  # an array or a scalar of NumPy
Function: TypeAlias = Callable[..., Any]
Rule: TypeAlias = Callable[[JaxprEqn], Function]

RULES: dict[str, Rule] = {}


def rule(*names: str) -> Callable[[Rule], Rule]:
    """Registers the rule of primitives."""

    def register(made: Rule) -> Rule:
        RULES.update(dict.fromkeys(names, made))
        return made

    return register


def _plain(function: Function) -> Rule:
    return lambda eqn: function


def aval(atom: Any) -> Any:
    """The type of a value of a jaxpr."""
    return atom.aval


def _shape(eqn: JaxprEqn, i: int = 0) -> tuple[int, ...]:
    return aval(eqn.invars[i]).shape


def _dtype(eqn: JaxprEqn) -> np.dtype[Any]:
    return aval(eqn.outvars[0]).dtype


# ---------------------------------------------------------------------------------------------------------------------
# Arithmetic
# ---------------------------------------------------------------------------------------------------------------------


def _logistic(x: Value) -> Value:
    return 1.0 / (1.0 + np.exp(-x))


def _rsqrt(x: Value) -> Value:
    return 1.0 / np.sqrt(x)


def _clamp(low: Value, x: Value, high: Value) -> Value:
    return np.minimum(np.maximum(x, low), high)


def _same(x: Value) -> Value:
    return x


RULES.update(
    {
        name: _plain(function)
        for name, function in {
            "add": operator.add,
            "add_any": operator.add,
            "sub": operator.sub,
            "mul": operator.mul,
            "neg": operator.neg,
            "abs": operator.abs,
            "square": lambda x: x * x,
            "max": np.maximum,
            "min": np.minimum,
            "sqrt": np.sqrt,
            "rsqrt": _rsqrt,
            "cbrt": np.cbrt,
            "exp": np.exp,
            "exp2": np.exp2,
            "expm1": np.expm1,
            "log": np.log,
            "log1p": np.log1p,
            "sin": np.sin,
            "cos": np.cos,
            "tan": np.tan,
            "asin": np.arcsin,
            "acos": np.arccos,
            "atan": np.arctan,
            "atan2": np.arctan2,
            "sinh": np.sinh,
            "cosh": np.cosh,
            "tanh": np.tanh,
            "asinh": np.arcsinh,
            "acosh": np.arccosh,
            "atanh": np.arctanh,
            "logistic": _logistic,
            "floor": np.floor,
            "ceil": np.ceil,
            "is_finite": np.isfinite,
            "nextafter": np.nextafter,
            "clamp": _clamp,
            "eq": operator.eq,
            "ne": operator.ne,
            "lt": operator.lt,
            "le": operator.le,
            "gt": operator.gt,
            "ge": operator.ge,
            "and": operator.and_,
            "or": operator.or_,
            "xor": operator.xor,
            "not": operator.invert,
        }.items()
    }
)


@rule("erf", "erfc")
def _error_function(eqn: JaxprEqn) -> Function:
    if _dtype(eqn) == np.float16:  # SciPy returns double precision
        raise NotImplementedError
    return getattr(scipy.special, eqn.primitive.name)


@rule("reduce_precision")
def _reduce_precision(eqn: JaxprEqn) -> Function:
    info = np.finfo(_dtype(eqn))
    if (eqn.params["exponent_bits"], eqn.params["mantissa_bits"]) != (info.nexp, info.nmant):
        raise NotImplementedError
    return _same


@rule("sign")
def _sign(eqn: JaxprEqn) -> Function:
    if _dtype(eqn).kind == "f":
        return lambda x: np.copysign(np.sign(x), x)  # keeps the sign of a zero
    return np.sign


@rule("pow")
def _pow(eqn: JaxprEqn) -> Function:
    dtype, power = _dtype(eqn), aval(eqn.invars[1]).dtype
    return np.power if power == dtype else lambda x, y: np.power(x, y.astype(dtype))


@rule("div")
def _div(eqn: JaxprEqn) -> Function:
    dtype = _dtype(eqn)
    if dtype.kind in "fc":
        return operator.truediv
    one, all_bits = dtype.type(1), np.array(-1).astype(dtype)[()]

    def divide(a: Value, b: Value) -> Value:  # towards zero; all bits of a division by zero are set
        divisor = np.where(b == 0, one, b)
        floor, rest = np.divmod(a, divisor)
        return np.where(b == 0, all_bits, floor + ((rest != 0) & ((a < 0) != (b < 0))))[()]

    return divide


@rule("rem")
def _rem(eqn: JaxprEqn) -> Function:
    if _dtype(eqn).kind == "f":
        return np.fmod
    one = _dtype(eqn).type(1)
    return lambda a, b: np.where(b == 0, a, np.fmod(a, np.where(b == 0, one, b)))[()]


@rule("integer_pow")
def _integer_pow(eqn: JaxprEqn) -> Function:
    exponent = eqn.params["y"]

    def power(x: Value) -> Value:
        left, factor, product = abs(exponent), x, None
        while left:
            if left & 1:
                product = factor if product is None else product * factor
            left >>= 1
            factor = factor * factor if left else factor
        if product is None:
            return np.ones_like(x)[()]
        return product if exponent > 0 else 1.0 / product

    return power


@rule("round")
def _round(eqn: JaxprEqn) -> Function:
    if int(eqn.params["rounding_method"]) == 1:
        return np.rint

    def away_from_zero(x: Value) -> Value:
        whole = np.trunc(x)
        return whole + np.copysign(np.abs(x - whole) >= 0.5, x).astype(x.dtype)

    return away_from_zero


@rule("convert_element_type")
def _convert(eqn: JaxprEqn) -> Function:
    target, source = eqn.params["new_dtype"], aval(eqn.invars[0]).dtype
    dtype = np.dtype(target)
    if dtype == source:
        return _same
    if dtype.kind == "b":
        return lambda x: x != 0
    if dtype.kind in "iu" and source.kind == "f":
        info = np.iinfo(dtype)
        low, high = float(info.min), float(info.max)

        def saturated(x: Value) -> Value:
            inside = np.clip(np.where(np.isnan(x), 0.0, x), low, np.nextafter(high, 0.0) if high >= 2.0**53 else high)
            return np.where(x >= high, info.max, inside.astype(dtype)).astype(dtype)[()]

        return saturated
    if not _shape(eqn):
        return dtype.type
    return lambda x: x.astype(dtype)


@rule("select_n")
def _select(eqn: JaxprEqn) -> Function:
    which = aval(eqn.invars[0])
    last = len(eqn.invars) - 2
    if not which.shape:
        return lambda which, *cases: cases[min(max(int(which), 0), last)]
    if which.dtype == bool:
        return lambda which, first, second: np.where(which, second, first)
    if last > 30:  # more cases than NumPy takes
        raise NotImplementedError
    return lambda which, *cases: np.choose(which, cases, mode="clip")


# ---------------------------------------------------------------------------------------------------------------------
# Shapes
# ---------------------------------------------------------------------------------------------------------------------


@rule("reshape", "squeeze")
def _reshape(eqn: JaxprEqn) -> Function:
    shape = aval(eqn.outvars[0]).shape
    if eqn.params.get("dimensions") is not None and eqn.primitive.name == "reshape":
        raise NotImplementedError
    if not shape:
        return lambda x: x.reshape(())[()] if _is_array(x) else x
    if shape == (1,) and not _shape(eqn):
        return lambda x: np.array([x], x.dtype)
    return lambda x: x.reshape(shape)


def _is_array(x: Value) -> bool:
    return type(x) is np.ndarray


@rule("broadcast_in_dim")
def _broadcast(eqn: JaxprEqn) -> Function:
    shape, places = eqn.params["shape"], eqn.params["broadcast_dimensions"]
    given = _shape(eqn)
    if not shape:
        return _same
    if not given:
        dtype = _dtype(eqn)
        return lambda x: np.full(shape, x, dtype)
    between = [1] * len(shape)
    for place, size in zip(places, given, strict=True):
        between[place] = size
    between = tuple(between)
    if between == tuple(shape):
        return lambda x: x.reshape(between)
    return lambda x: np.broadcast_to(x.reshape(between), shape)


@rule("slice")
def _slice(eqn: JaxprEqn) -> Function:
    strides = eqn.params["strides"] or (None,) * len(eqn.params["start_indices"])
    where = tuple(map(slice, eqn.params["start_indices"], eqn.params["limit_indices"], strides))
    return lambda x: x[where]


@rule("concatenate")
def _concatenate(eqn: JaxprEqn) -> Function:
    axis = eqn.params["dimension"]
    return lambda *x: np.concatenate(x, axis)


@rule("stack")
def _stack(eqn: JaxprEqn) -> Function:
    axis = eqn.params["axis"]
    if not _shape(eqn):
        dtype = _dtype(eqn)
        return lambda *x: np.array(x, dtype)
    return lambda *x: np.stack(x, axis)


@rule("unstack")
def _unstack(eqn: JaxprEqn) -> Function:
    axis = eqn.params["axis"]
    return lambda x: [part[()] for part in np.moveaxis(x, axis, 0)]


@rule("split")
def _split(eqn: JaxprEqn) -> Function:
    axis, ends = eqn.params["axis"], np.cumsum(eqn.params["sizes"])
    before = (slice(None),) * axis
    places = [(*before, slice(int(a), int(b))) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
    return lambda x: [x[place] for place in places]


@rule("transpose")
def _transpose(eqn: JaxprEqn) -> Function:
    order = eqn.params["permutation"]
    return lambda x: x.transpose(order)


@rule("rev")
def _rev(eqn: JaxprEqn) -> Function:
    axes = eqn.params["dimensions"]
    where = tuple(slice(None, None, -1 if i in axes else 1) for i in range(len(_shape(eqn))))
    return lambda x: x[where]


@rule("iota")
def _iota(eqn: JaxprEqn) -> Function:
    shape, axis = eqn.params["shape"], eqn.params["dimension"]
    along = [1] * len(shape)
    along[axis] = shape[axis]
    value = np.broadcast_to(np.arange(shape[axis], dtype=eqn.params["dtype"]).reshape(along), shape)
    return lambda *dynamic: value


@rule("pad")
def _pad(eqn: JaxprEqn) -> Function:
    config, shape = eqn.params["padding_config"], aval(eqn.outvars[0]).shape
    given = _shape(eqn)
    source, target = [], []
    for (low, _, between), size, whole in zip(config, given, shape, strict=True):
        places = low + (between + 1) * np.arange(size)
        inside = np.flatnonzero((places >= 0) & (places < whole))
        source.append(inside)
        target.append(places[inside])
    takes, gives = np.ix_(*source), np.ix_(*target)

    def padded(x: Value, fill: Value) -> Value:
        result = np.full(shape, fill, x.dtype)
        result[gives] = x[takes]
        return result[()]

    return padded


# ---------------------------------------------------------------------------------------------------------------------
# Reductions
# ---------------------------------------------------------------------------------------------------------------------


def _reduction(ufunc: Any) -> Rule:
    def made(eqn: JaxprEqn) -> Function:
        axes, dtype = tuple(eqn.params["axes"]), _dtype(eqn)
        if not axes:
            return _same
        if ufunc in (np.maximum, np.minimum):
            if dtype.kind == "c":
                raise NotImplementedError
            start = _least(dtype) if ufunc is np.maximum else _greatest(dtype)
            return lambda x: ufunc.reduce(x, axis=axes, initial=start)
        return lambda x: ufunc.reduce(x, axis=axes, dtype=dtype)

    return made


def _least(dtype: np.dtype[Any]) -> Any:
    return -np.inf if dtype.kind == "f" else dtype.kind != "b" and np.iinfo(dtype).min


def _greatest(dtype: np.dtype[Any]) -> Any:
    return np.inf if dtype.kind == "f" else dtype.kind == "b" or np.iinfo(dtype).max


for _name, _ufunc in {
    "reduce_sum": np.add,
    "reduce_prod": np.multiply,
    "reduce_max": np.maximum,
    "reduce_min": np.minimum,
    "reduce_and": np.bitwise_and,
    "reduce_or": np.bitwise_or,
    "reduce_xor": np.bitwise_xor,
}.items():
    RULES[_name] = _reduction(_ufunc)


@rule("argmax", "argmin")
def _arg(eqn: JaxprEqn) -> Function:
    (axis,), dtype = eqn.params["axes"], np.dtype(eqn.params["index_dtype"])
    find = np.argmax if eqn.primitive.name == "argmax" else np.argmin
    return lambda x: find(x, axis).astype(dtype)


def _cumulative(ufunc: Any) -> Rule:
    def made(eqn: JaxprEqn) -> Function:
        axis, dtype = eqn.params["axis"], _dtype(eqn)
        if eqn.params["reverse"]:
            return lambda x: np.flip(ufunc.accumulate(np.flip(x, axis), axis, dtype), axis)
        return lambda x: ufunc.accumulate(x, axis, dtype)

    return made


for _name, _ufunc in {
    "cumsum": np.add,
    "cumprod": np.multiply,
    "cummax": np.maximum,
    "cummin": np.minimum,
    "cumlogsumexp": np.logaddexp,
}.items():
    RULES[_name] = _cumulative(_ufunc)


@rule("sort")
def _sort(eqn: JaxprEqn) -> Function:
    axis, n_keys = eqn.params["dimension"], eqn.params["num_keys"]
    if n_keys != 1:
        raise NotImplementedError

    def sorted_by_first(*x: Value) -> list[Value]:
        order = np.argsort(x[0], axis, kind="stable")
        return [np.take_along_axis(values, order, axis) for values in x]

    return sorted_by_first


# ---------------------------------------------------------------------------------------------------------------------
# Linear algebra
# ---------------------------------------------------------------------------------------------------------------------


@rule("dot_general")
def _dot_general(eqn: JaxprEqn) -> Function:
    (left, right), (left_batch, right_batch) = eqn.params["dimension_numbers"]
    a_shape, b_shape = _shape(eqn, 0), _shape(eqn, 1)
    dtype, shape = _dtype(eqn), aval(eqn.outvars[0]).shape
    a_free = [i for i in range(len(a_shape)) if i not in (*left, *left_batch)]
    b_free = [i for i in range(len(b_shape)) if i not in (*right, *right_batch)]
    a_order, b_order = (*left_batch, *a_free, *left), (*right_batch, *right, *b_free)

    def size(whole: Sequence[int], axes: Sequence[int]) -> int:
        return int(np.prod([whole[i] for i in axes], dtype=int))

    batch, inner = tuple(a_shape[i] for i in left_batch), size(a_shape, left)
    a_matrix = (*batch, size(a_shape, a_free), inner)
    b_matrix = (*batch, inner, size(b_shape, b_free))

    def dot(a: Value, b: Value) -> Value:
        a, b = a.astype(dtype, copy=False), b.astype(dtype, copy=False)
        return (a.transpose(a_order).reshape(a_matrix) @ b.transpose(b_order).reshape(b_matrix)).reshape(shape)[()]

    return dot


@rule("triangular_solve")
def _triangular_solve(eqn: JaxprEqn) -> Function:
    p, shape = eqn.params, aval(eqn.outvars[0]).shape
    if len(shape) != 2 or 0 in shape:
        raise NotImplementedError
    (solve,) = scipy.linalg.get_blas_funcs(("trsm",), dtype=_dtype(eqn))  # as jax does
    conjugated = np.conj if p["conjugate_a"] else _same
    options = dict(side=not p["left_side"], lower=p["lower"], trans_a=p["transpose_a"], diag=p["unit_diagonal"])
    return lambda a, b: np.ascontiguousarray(solve(1.0, conjugated(a), b, **options))


def _is_double_matrix(eqn: JaxprEqn) -> bool:
    return len(_shape(eqn)) == 2 and 0 not in _shape(eqn) and _dtype(eqn) == np.float64


@rule("lu")
def _lu(eqn: JaxprEqn) -> Function:
    if not _is_double_matrix(eqn):
        raise NotImplementedError
    (factor,) = scipy.linalg.get_lapack_funcs(("getrf",), dtype=np.float64)

    def factors(a: Value) -> list[Value]:
        lu, pivots, info = factor(a)
        if info < 0:
            lu = np.full(a.shape, np.nan)
        order = np.arange(len(a))
        for i, pivot in enumerate(pivots):
            order[i], order[pivot] = order[pivot], order[i]
        return [np.ascontiguousarray(lu), pivots.astype(np.int32), order.astype(np.int32)]

    return factors


@rule("svd")
def _svd(eqn: JaxprEqn) -> Function:
    p = eqn.params
    if not _is_double_matrix(eqn) or p["subset_by_index"] is not None or p["algorithm"] is not None:
        raise NotImplementedError
    shapes = [aval(var).shape for var in eqn.outvars]

    def svd(a: Value) -> list[Value]:
        u, values, v, info = scipy.linalg.lapack.dgesdd(a, compute_uv=p["compute_uv"], full_matrices=p["full_matrices"])
        if info != 0:
            return [np.full(shape, np.nan) for shape in shapes]
        return [values, *map(np.ascontiguousarray, (u, v))] if p["compute_uv"] else [values]

    return svd


@rule("geqrf")
def _geqrf(eqn: JaxprEqn) -> Function:
    """Householder reflectors of a QR factorisation."""
    if not _is_double_matrix(eqn):
        raise NotImplementedError

    def factors(a: Value) -> list[Value]:
        reflectors, scales, *_ = scipy.linalg.lapack.dgeqrf(a)
        return [np.ascontiguousarray(reflectors), scales]

    return factors


@rule("ormqr")
def _ormqr(eqn: JaxprEqn) -> Function:
    """The product with the orthogonal matrix of these reflectors."""
    p = eqn.params
    if not _is_double_matrix(eqn) or len(_shape(eqn, 2)) != 2 or 0 in _shape(eqn, 2):
        raise NotImplementedError
    side, order = "L" if p["left"] else "R", "T" if p["transpose"] else "N"

    def product(reflectors: Value, scales: Value, c: Value) -> Value:
        room = max(1, 64 * max(c.shape))
        found, _, _ = scipy.linalg.lapack.dormqr(side, order, reflectors[:, : len(scales)], scales, c, room)
        return np.ascontiguousarray(found)

    return product


# ---------------------------------------------------------------------------------------------------------------------
# Indices
# ---------------------------------------------------------------------------------------------------------------------


@rule("dynamic_slice")
def _dynamic_slice(eqn: JaxprEqn) -> Function:
    sizes, shape = eqn.params["slice_sizes"], _shape(eqn)
    room = [whole - size for whole, size in zip(shape, sizes, strict=True)]

    def sliced(x: Value, *starts: Value) -> Value:
        lows = [min(max(int(s), 0), most) for s, most in zip(starts, room, strict=True)]
        return x[tuple(slice(low, low + size) for low, size in zip(lows, sizes, strict=True))]

    return sliced


@rule("dynamic_update_slice")
def _dynamic_update_slice(eqn: JaxprEqn) -> Function:
    shape, sizes = _shape(eqn, 0), _shape(eqn, 1)
    if not shape:
        return lambda x, update: update
    room = [whole - size for whole, size in zip(shape, sizes, strict=True)]

    def updated(x: Value, update: Value, *starts: Value) -> Value:
        lows = [min(max(int(s), 0), most) for s, most in zip(starts, room, strict=True)]
        result = x.copy()
        result[tuple(slice(low, low + size) for low, size in zip(lows, sizes, strict=True))] = update
        return result

    return updated


class _Places:
    """The places in an operand that a window of each index covers, as arrays of the shape of the windows' values."""

    def __init__(
        self,
        operand: Sequence[int],
        windows: Sequence[int],  # the axes of the values that lie in windows
        missing: Sequence[int],  # the axes of the operand without an axis in windows
        index_map: Sequence[int],
        batch: tuple[Sequence[int], Sequence[int]],  # the axes in the operand, and in the indices, of batches
        sizes: Sequence[int],  # of a window, by axes of the operand
        values: Sequence[int],
    ) -> None:
        self.index_map, self.rank = list(index_map), len(operand)
        outside = [axis for axis in range(len(values)) if axis not in windows]
        kept = [axis for axis in range(len(operand)) if axis not in (*missing, *batch[0])]
        self.shape = [values[axis] if axis in outside else 1 for axis in range(len(values))]
        self.offsets: list[Any] = [0] * self.rank
        for axis, place in zip(kept, windows, strict=True):
            along = [1] * len(values)
            along[place] = values[place]
            self.offsets[axis] = np.arange(values[place]).reshape(along)
        for axis, index_axis in zip(*batch, strict=True):
            place = outside[index_axis]
            along = [1] * len(values)
            along[place] = values[place]
            self.offsets[axis] = np.arange(values[place]).reshape(along)
        self.room = [operand[axis] - sizes[axis] for axis in index_map]

    def starts(self, indices: Value) -> list[Value]:
        """The first place of each window, along each indexed axis. Small types cannot hold all places of a table."""
        indices = indices.astype(np.int64, copy=False)
        return [indices[..., k].reshape(self.shape) for k in range(len(self.index_map))]

    def inside(self, starts: list[Value]) -> Value:
        """Which windows lie in the operand."""
        parts = [(s >= 0) & (s <= most) for s, most in zip(starts, self.room, strict=True)]
        return ft.reduce(operator.and_, parts, np.bool_(True))

    def of(self, starts: list[Value]) -> tuple[Value, ...]:
        """The places, with all windows moved into the operand."""
        places = list(self.offsets)
        for axis, start, most in zip(self.index_map, starts, self.room, strict=True):
            places[axis] = places[axis] + np.minimum(np.maximum(start, 0), most)
        return tuple(places)


def _mode(eqn: JaxprEqn) -> str:
    return str(eqn.params["mode"]).lower().rsplit(".", 1)[-1]


@rule("gather")
def _gather(eqn: JaxprEqn) -> Function:
    d, dtype = eqn.params["dimension_numbers"], _dtype(eqn)
    shape = aval(eqn.outvars[0]).shape
    places = _Places(
        _shape(eqn),
        d.offset_dims,
        d.collapsed_slice_dims,
        d.start_index_map,
        (d.operand_batching_dims, d.start_indices_batching_dims),
        eqn.params["slice_sizes"],
        shape,
    )
    fill = eqn.params["fill_value"] if "fill" in _mode(eqn) else None
    fills = "fill" in _mode(eqn)
    if fills and fill is None:
        fill = np.nan if dtype.kind in "fc" else _least(dtype) if dtype.kind == "i" else _greatest(dtype)

    def gathered(x: Value, indices: Value) -> Value:
        starts = places.starts(indices)
        found = x[places.of(starts)]
        if fills:
            found = np.where(places.inside(starts), found, np.asarray(fill, dtype))
        return np.broadcast_to(found, shape)[()]

    return gathered


_UPDATES: dict[str, Any] = {
    "scatter": None,
    "scatter-add": np.add,
    "scatter-sub": np.subtract,
    "scatter-mul": np.multiply,
    "scatter-min": np.minimum,
    "scatter-max": np.maximum,
}


@rule(*_UPDATES)
def _scatter(eqn: JaxprEqn) -> Function:
    d, shape = eqn.params["dimension_numbers"], _shape(eqn)
    values = _shape(eqn, 2)
    kept = [i for i in range(len(shape)) if i not in (*d.inserted_window_dims, *d.operand_batching_dims)]
    sizes = [1] * len(shape)
    for axis, place in zip(kept, d.update_window_dims, strict=True):
        sizes[axis] = values[place]
    places = _Places(
        shape,
        d.update_window_dims,
        d.inserted_window_dims,
        d.scatter_dims_to_operand_dims,
        (d.operand_batching_dims, d.scatter_indices_batching_dims),
        sizes,
        values,
    )
    clips = "clip" in _mode(eqn)
    ufunc = _UPDATES[eqn.primitive.name]
    if ufunc is None and eqn.params["update_jaxpr"] is not None:
        raise NotImplementedError

    def scattered(x: Value, indices: Value, updates: Value) -> Value:
        starts = places.starts(indices)
        where = [np.broadcast_to(place, values) for place in places.of(starts)]
        if not clips:
            inside = np.broadcast_to(places.inside(starts), values)
            if not np.all(inside):
                where, updates = [place[inside] for place in where], np.asarray(updates)[inside]
        result = np.array(x)
        if ufunc is None:
            result[tuple(where)] = updates
        else:
            ufunc.at(result, tuple(where), updates)
        return result[()]

    return scattered
