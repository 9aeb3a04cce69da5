"""The C form of conditionals and loops."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._jax_private import JaxprEqn, scan_counts
from .._reduce.jaxpr import shape_of
from .expressions import kind_of
from .values import CValue, Index, stored

if TYPE_CHECKING:
    from .writer import Writer


def _declared(writer: "Writer", eqn: JaxprEqn) -> list[CValue]:
    """Variables for the results of an equation."""
    return [writer.declare(shape_of(var), kind_of(var)) for var in eqn.outvars]


def _set(writer: "Writer", targets: Sequence[CValue], values: Sequence[CValue]) -> None:
    """Assign all values at once: those that read a target are computed before it changes."""
    copies = [_copied(writer, value) for value in values]
    for target, value in zip(targets, copies, strict=True):
        writer.assign(target, value)


def _copied(writer: "Writer", value: CValue) -> CValue:
    if value.known is not None:
        return value
    copy = writer.declare(value.shape, value.kind)
    writer.assign(copy, value)
    return copy


def _kept(writer: "Writer", values: Sequence[CValue]) -> list[CValue]:
    return [writer.kept(value) for value in values]


def _text(writer: "Writer", value: CValue) -> str:
    """The text of a scalar."""
    return value.at(Index(np.array(0), (), writer.tables)).text


def _branches(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    which, *operands = _kept(writer, args)
    branches = eqn.params["branches"]
    targets = _declared(writer, eqn)
    for i, branch in enumerate(branches):
        is_last = i == len(branches) - 1
        test = f"({_text(writer, which)} {'<=' if i == 0 else '=='} {i})"
        head = f"if {test}" if i == 0 else "else" if is_last else f"else if {test}"
        with writer.block(head):
            for target, value in zip(targets, writer.run(branch, operands), strict=True):
                writer.assign(target, value)
    return targets


def _while(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    n, m = eqn.params["cond_nconsts"], eqn.params["body_nconsts"]
    of_test, of_body = _kept(writer, args[:n]), _kept(writer, args[n : n + m])
    carry = _declared(writer, eqn)
    _set(writer, carry, args[n + m :])
    with writer.block("for (;;)"):
        (goes_on,) = writer.run(eqn.params["cond_jaxpr"], [*of_test, *carry])
        goes_on = writer.kept(goes_on)
        with writer.block(f"if (!{_text(writer, goes_on)})"):
            writer.line("break;")
        _set(writer, carry, writer.run(eqn.params["body_jaxpr"], [*of_body, *carry]))
    return carry


def _scan(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    n_constants, n_carry = scan_counts(eqn)
    length = eqn.params["length"]
    constants, carried = _kept(writer, args[:n_constants]), args[n_constants:][:n_carry]
    rows = [(writer.array(value), value) for value in args[n_constants + n_carry :]]
    results = _declared(writer, eqn)
    carry, stacked = results[:n_carry], results[n_carry:]
    _set(writer, carry, carried)
    count = writer.names.new("k")
    with writer.block(f"for (int {count} = 0; {count} < {length}; {count}++)"):
        place = count
        if eqn.params["reverse"] and (rows or stacked):
            place = writer.names.new("row")
            writer.line(f"const int {place} = {length - 1} - {count};")
        own = [_row(name, value, place) for name, value in rows]
        values = writer.run(eqn.params["jaxpr"], [*constants, *carry, *own])
        for target, value in zip(stacked, values[n_carry:], strict=True):
            _set(writer, [target if target.size == 1 else _row(target.name, target, place)], [value])
        _set(writer, carry, values[:n_carry])
    return results


def _row(name: str, value: CValue, place: str) -> CValue:
    """One row of an array."""
    shape = value.shape[1:]
    size = int(np.prod(shape))
    return stored(name, shape, value.kind, place if size == 1 else f"{size} * {place}")


CONTROL: dict[str, Callable[["Writer", JaxprEqn, list[CValue]], Sequence[CValue]]] = {
    "cond": _branches,
    "while": _while,
    "scan": _scan,
}
