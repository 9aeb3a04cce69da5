"""The leaves of a model, read from the arrays of its C struct."""

import numpy as np

from .expressions import SIGN, Expression
from .layout import Numbering
from .values import CValue, Index
from .writer import Writer


def leaf_value(writer: Writer, layout: Numbering, leaf: int, *, is_tangent: bool = False) -> CValue:
    """A leaf or its tangent as an array: in place if its elements lie in one array with one sign, otherwise copied."""
    own = layout.system.flat.leaves[leaf]
    shape = own.stack + own.sizes
    members = layout.leaf(leaf)
    if is_tangent:
        members = [(places._replace(space=_tangent(places.space)), size) for places, size in members]
    kinds = {(places.space, places.sign) for places, _ in members}
    if len(kinds) == 1:
        ((space, sign),) = kinds
        every = np.concatenate([places.firsts[0] + np.arange(size) for places, size in members])
        return _in_place(space, sign, every, shape)
    target = writer.declare(shape, "f", own.path)
    done = 0
    for places, size in members:
        part = _in_place(places.space, places.sign, places.firsts[0] + np.arange(size), (size,))
        writer.assign(target, part, done + np.arange(size))
        done += size
    return target


def _in_place(space: str, sign: int, every: np.ndarray, shape: tuple[int, ...]) -> CValue:
    def at(index: Index) -> Expression:
        text = space or "0.0" if space in ("", "t", "dt") else f"{space}[{index.through(every).text}]"
        return Expression(text) if sign > 0 else Expression(f"-{text}", SIGN)

    return CValue(shape, "f", at)


def _tangent(space: str) -> str:
    """The space of the derivatives along a direction; "" for constants."""
    return f"d{space}" if space in ("v", "t") else ""
