"""Each primitive in C against jax, over random arguments."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _compiled import _pointer, library, needs_compiler
from jax import Array, lax

from acausal import ModelError
from acausal._reduce.jaxpr import structs
from acausal.codegen.arrays import ARRAYS, CONTROL
from acausal.codegen.expressions import ELEMENTWISE
from acausal.codegen.functions import function_of
from acausal.codegen.values import Tables
from acausal.codegen.write import constants, helpers

Case = tuple[Callable[..., Any], tuple[tuple[int, ...], ...]]


def number(x: Array) -> Array:
    """An integer from -3 to 3."""
    return jnp.round(x).astype(int)


UNARY: dict[str, Callable[[Array], Array]] = {
    "neg": lambda x: -x,
    "integer_pow": lambda x: x**3 + x**-2 + lax.integer_pow(x, -1) + x**7,
    "square": jnp.square,
    "sqrt": lambda x: jnp.sqrt(jnp.abs(x)),
    "rsqrt": lambda x: lax.rsqrt(jnp.abs(x)),
    "abs": lambda x: jnp.abs(x) + jnp.abs(number(x)),
    "sign": lambda x: jnp.sign(x) + jnp.sign(jnp.round(x)) + jnp.sign(number(x)),
    "round": lambda x: lax.round(2.0 * x, lax.RoundingMethod.AWAY_FROM_ZERO) + jnp.round(2.0 * x),
    "logistic": jax.nn.sigmoid,
    "is_finite": lambda x: jnp.isfinite(1.0 / jnp.floor(x)) * 1.0,
    "not": lambda x: jnp.where(~(x > 0.0), 1.0, 2.0) + ~number(x),
    "copy": lambda x: lax.copy_p.bind(x),
    "stop_gradient": lax.stop_gradient,
    "reduce_precision": lambda x: lax.reduce_precision(x, 11, 52),
    "optimization_barrier": lambda x: lax.optimization_barrier(x),
    "asin": lambda x: jnp.arcsin(x / 4.0),
    "acos": lambda x: jnp.arccos(x / 4.0),
    "acosh": lambda x: jnp.arccosh(1.0 + jnp.abs(x)),
    "atanh": lambda x: jnp.arctanh(x / 4.0),
    "exp": jnp.exp,
    "tanh": jnp.tanh,
    "cbrt": jnp.cbrt,
    "exp2": jnp.exp2,
    "sin": jnp.sin,
    "cos": jnp.cos,
    "tan": jnp.tan,
    "log": lambda x: jnp.log(jnp.abs(x)),
    "log1p": lambda x: jnp.log1p(jnp.abs(x)),
    **{name: getattr(lax, f"{name}_p").bind for name in "expm1 atan sinh cosh asinh erf erfc floor ceil".split()},
}
BINARY: dict[str, Callable[[Array, Array], Array]] = {
    "add": lambda x, y: x + y,
    "add_any": lambda x, y: jax.jvp(lambda z: z * z, (x,), (y,))[1],
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y + lax.div(number(4.0 * x), number(y) ** 2 + 1),
    "rem": lambda x, y: lax.rem(x, y) + lax.rem(number(4.0 * x), number(y) ** 2 + 1),
    "pow": lambda x, y: jnp.abs(x) ** y,
    "max": lambda x, y: jnp.maximum(x, y) + jnp.maximum(number(x), number(y)),
    "min": lambda x, y: jnp.minimum(x, y) + jnp.minimum(number(x), number(y)),
    "clamp": lambda x, y: lax.clamp(jnp.full_like(x, -0.5), x, jnp.abs(y)),
    "atan2": jnp.arctan2,
    "nextafter": jnp.nextafter,
    "lt": lambda x, y: (x < y) * 1.0,
    "le": lambda x, y: (number(x) <= number(y)) * 1.0,
    "gt": lambda x, y: (x > y) * 1.0,
    "ge": lambda x, y: (number(x) >= number(y)) * 1.0,
    "le_to": lambda x, y: lax.le_to_p.bind(x, y) * 1.0,
    "lt_to": lambda x, y: lax.lt_to_p.bind(x, y) * 1.0,
    "eq": lambda x, y: ((number(x) == number(y)) == (x > y)) * 1.0,
    "ne": lambda x, y: (number(x) != number(y)) * 1.0,
    "and": lambda x, y: ((x > 0.0) & (y > 0.0) & (x > y)) + (number(x) & number(y)) * 1.0,
    "or": lambda x, y: ((x > 0.0) | (y > 0.0) & (x > y)) + (number(x) | number(y)) * 1.0,
    "xor": lambda x, y: ((x > 0.0) ^ (y > 0.0)) + (number(x) ^ number(y)) * 1.0,
    "select_n": lambda x, y: jnp.where(x > y, x, -y) + lax.select_n(number(jnp.abs(x)) % 3, x, y, x * y),
}


def windows(x: Array, start: Array) -> Array:
    dimensions = lax.GatherDimensionNumbers((1,), (0,), (0,))
    return lax.gather(x, start[:, None], dimensions, (1, 3), mode="clip")


ARRAY: dict[str, Case] = {
    "slice": (lambda x: x[1:, ::2], ((3, 5),)),
    "reshape": (lambda x: x.reshape(5, 3) * 2.0, ((3, 5),)),
    "squeeze": (lambda x: jnp.squeeze(x, 1), ((3, 1),)),
    "expand_dims": (lambda x: jnp.expand_dims(x, 1) + jnp.zeros((3, 4)), ((3,),)),
    "broadcast_in_dim": (lambda x: jnp.broadcast_to(jnp.exp(x)[:, None], (3, 4)), ((3,),)),
    "transpose": (lambda x: jnp.transpose(x, (2, 0, 1)), ((2, 3, 4),)),
    "rev": (lambda x: x[::-1] - x, ((4,),)),
    "split": (lambda x: jnp.split(x, [1, 3])[1] * x[0], ((4,),)),
    "concatenate": (lambda x, y: jnp.concatenate([x, y * 2.0, x[:1]]), ((3,), (2,))),
    "stack": (lambda x, y: jnp.stack([x, y], axis=1), ((3,), (3,))),
    "pad": (lambda x: lax.pad(x, 1.5, ((2, 1, 1), (0, -1, 0))), ((3, 2),)),
    "reduce_sum": (lambda x: jnp.sum(x * x, axis=1) + jnp.sum(x), ((3, 4),)),
    "reduce_prod": (lambda x: jnp.prod(x, axis=0), ((3, 4),)),
    "reduce_max": (lambda x: jnp.max(x, axis=1), ((3, 4),)),
    "reduce_min": (lambda x: jnp.min(x), ((3, 4),)),
    "reduce_and": (lambda x: jnp.all(x > -1.0, axis=0) * 1.0, ((3, 4),)),
    "reduce_or": (lambda x: jnp.any(x > 1.0, axis=0) * 1.0, ((3, 4),)),
    "argmax": (lambda x: jnp.argmax(x, axis=1) * 1.0, ((3, 4),)),
    "argmin": (lambda x: jnp.argmin(x, axis=0) + jnp.argmin(jnp.sqrt(x[0])) * 1.0, ((3, 4),)),
    "cumsum": (lambda x: jnp.cumsum(x, axis=0) + lax.cumsum(x, axis=1, reverse=True), ((3, 4),)),
    "cumprod": (lambda x: jnp.cumprod(x), ((4,),)),
    "cummax": (lambda x: lax.cummax(x), ((4,),)),
    "cummin": (lambda x: lax.cummin(x), ((4,),)),
    "dot_general": (lambda x, y, z: jnp.einsum("bij,bkj->bki", x, y) @ z[:3] + x @ z, ((2, 3, 4), (2, 3, 4), (4,))),
    "dynamic_slice": (lambda x, y: lax.dynamic_slice(x, (number(y), number(-y)), (2, 3)), ((4, 5), ())),
    "gather": (lambda x, y: windows(x, number(y)).sum() + x[number(y), number(-y)], ((4, 3), (5,))),
}


def loop(x: Array, y: Array) -> tuple[Array, Array]:
    """A scan with a carry, stacked inputs in reverse and stacked results, and a loop of variable length."""
    total, sums = lax.scan(lambda c, row: (c * 0.5 + row.sum(), c * row), x, y, reverse=True)
    return lax.while_loop(lambda z: z < 5.0, lambda z: 1.5 * z + 0.1, jnp.abs(total)), sums


LOOPS: dict[str, Case] = {
    "cond": (lambda x, y: lax.cond(x > 0.0, lambda: (jnp.exp(x), y), lambda: (y[0] / 2.0, y * x)), ((), (3,))),
    "while": (lambda x, y: loop(x, y)[0], ((), (3, 2))),
    "scan": (lambda x, y: loop(x, y)[1], ((), (3, 2))),
    "switch": (lambda x: lax.switch(number(x) % 3, [jnp.sin, jnp.cos, jnp.exp], x), ((),)),
    "table": (lambda x: jnp.array([1.0, 4.0, 9.0])[jnp.searchsorted(jnp.array([-1.0, 1.0]), x)], ((),)),
    "one element": (lambda x, y: lax.scan(lambda c, row: (c + row, c - row), y, x)[1] + x[number(y)], ((1,), ())),
    "shared": (jax.jacfwd(lambda x: jnp.tanh(x @ x[::-1]) * x), ((3,),)),
}
CASES: dict[str, Case] = {
    **{name: (function, ((3,),)) for name, function in UNARY.items()},
    **{name: (function, ((3,), (3,))) for name, function in BINARY.items()},
    **ARRAY,
    **LOOPS,
}
COVERED_OTHERWISE = {"copy_p"}  # another name of `copy`


def test_every_primitive_has_a_case() -> None:
    assert set(ELEMENTWISE) | set(ARRAYS) | set(CONTROL) == (set(CASES) | COVERED_OTHERWISE) - (
        set(LOOPS) - set(CONTROL)
    )


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """All cases as one C file."""
    tables, texts = Tables(), []
    for place, (name, (function, shapes)) in enumerate(CASES.items()):
        closed = jax.make_jaxpr(lambda *args, f=function: jnp.concatenate(
            [jnp.ravel(jnp.asarray(x, float)) for x in jax.tree.leaves(f(*args))]))(*structs(shapes))  # fmt: skip
        names = [f"x{i}" for i in range(len(shapes))]
        c = function_of(f"case_{place}", closed, names, ["result"], tables, name, vectors=True)
        texts.append(c.text.replace("static void", "void", 1))
    heads = [f"{text.partition('{')[0].rpartition('*/')[2].strip()};" for text in texts]
    body = "\n\n".join(texts)
    path: Path = tmp_path_factory.mktemp("primitives") / "cases.c"
    path.write_text("\n\n".join(["#include <math.h>", *heads, *constants(tables), *helpers(body), body]))
    return library(path)


@needs_compiler
@pytest.mark.parametrize("name", CASES)
def test_a_primitive_has_the_values_of_jax(compiled: Any, name: str) -> None:
    function, shapes = CASES[name]
    random = np.random.default_rng(list(CASES).index(name))
    for _ in range(5):
        args = [random.uniform(-3.0, 3.0, shape) for shape in shapes]
        found = jax.tree.leaves(function(*(jnp.asarray(x) for x in args)))
        wanted = np.concatenate([np.ravel(np.asarray(x, float)) for x in found])
        result = np.zeros(len(wanted))
        compiled[f"case_{list(CASES).index(name)}"](*map(_pointer, args), _pointer(result))
        np.testing.assert_allclose(result, wanted, rtol=1e-13, atol=1e-14)


def test_an_operation_without_c_form_is_refused_by_name() -> None:
    closed = jax.make_jaxpr(lambda x: lax.erf_inv(x))(1.0)
    with pytest.raises(ModelError, match=r"bridge\.law uses `erf_inv`, which has no C form\. Remedy: "):
        function_of("f", closed, ["x"], ["y"], Tables(), "bridge.law")
