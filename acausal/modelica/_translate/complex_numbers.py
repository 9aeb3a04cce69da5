"""Complex numbers: records of the operator record `Complex`, or arrays of them."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from .values import Value, is_known, product

Complex = dict[str, Value]


def is_complex(value: Value) -> bool:
    """Whether a value is a complex number or an array of them."""
    return isinstance(value, dict) and value.keys() == {"re", "im"}


def operation(op: str, a: Value, b: Value) -> Complex:
    """An arithmetic operation of which at least one side is complex."""
    name = op.removesuffix("Elem")
    if name not in _OPERATIONS:
        raise ModelError(f"the operator {op} of complex numbers is not supported.")
    times = (lambda x, y: x * y) if op.endswith("Elem") else product
    return _OPERATIONS[name](_complex(a), _complex(b), times)


def _complex(value: Value) -> Complex:
    return value if isinstance(value, dict) else {"re": value, "im": 0.0 * value}


def _times(a: Complex, b: Complex, times: Callable[[Value, Value], Value]) -> Complex:
    return {
        "re": times(a["re"], b["re"]) - times(a["im"], b["im"]),
        "im": times(a["re"], b["im"]) + times(a["im"], b["re"]),
    }


def _over(a: Complex, b: Complex, times: Callable[[Value, Value], Value]) -> Complex:
    del times
    size = b["re"] * b["re"] + b["im"] * b["im"]
    re = a["re"] * b["re"] + a["im"] * b["im"]
    im = a["im"] * b["re"] - a["re"] * b["im"]
    return {"re": re / size, "im": im / size}


def _power(a: Complex, b: Complex, times: Callable[[Value, Value], Value]) -> Complex:
    """exp(b log a)."""
    del times
    xp = np if all(is_known(part) for part in (*a.values(), *b.values())) else jnp
    log_size, angle = 0.5 * xp.log(a["re"] ** 2 + a["im"] ** 2), xp.arctan2(a["im"], a["re"])
    size = xp.exp(b["re"] * log_size - b["im"] * angle)
    turn = b["re"] * angle + b["im"] * log_size
    return {"re": size * xp.cos(turn), "im": size * xp.sin(turn)}


_OPERATIONS: dict[str, Callable[[Complex, Complex, Callable[[Value, Value], Value]], Complex]] = {
    "Add": lambda a, b, times: {"re": a["re"] + b["re"], "im": a["im"] + b["im"]},
    "Sub": lambda a, b, times: {"re": a["re"] - b["re"], "im": a["im"] - b["im"]},
    "Mul": _times,
    "Div": _over,
    "Exp": _power,
}
