"""Junctions of flows that `semiLinear` describes: the mixed value as an equation of its own."""

import functools as ft
from collections.abc import Sequence
from typing import Any

from .._syntax import expressions as e
from .equal_names import EqualNames


def semilinear(residual: Any) -> tuple[Any, Any, Any, Any] | None:
    """y, x, first and second of an equation y = semiLinear(x, first, second)."""
    if not isinstance(residual, e.Binary) or residual.op != "Sub":
        return None
    for y, call in ((residual.left, residual.right), (residual.right, residual.left)):
        if isinstance(call, e.Builtin) and call.name == "SemiLinear":
            x, first, second = call.args
            return y, x, first, second
    return None


def mixed(residuals: Sequence[Any], names: EqualNames) -> dict[int, Any]:
    """The residuals that take the places of those of sums y1 + y2 + ... = 0 at junctions."""
    links = {names.of(found[0])[0]: found for x in residuals if (found := semilinear(x)) is not None}
    sums = [(place, terms) for place, x in enumerate(residuals) if len(terms := names.sum_of(x)) > 2]
    balances = {_up_to_sign(terms) for _, terms in sums}
    changed = {}
    for place, terms in sums:
        if not all(y in links for y in terms):
            continue
        first = links[next(iter(terms))]
        for s in first[2:]:
            ports = _ports(s, terms, links, names)
            if ports is not None and _up_to_sign(_roots([x for x, _ in ports], names)) in balances:
                changed[place] = e.Binary("Sub", s, _mixture(ports))
                break
    return changed


def _ports(s: Any, terms: dict[Any, int], links: dict[Any, Any], names: EqualNames) -> list[tuple[Any, Any]] | None:
    """The flow x out of the junction and the value si beyond, for each port, if all ports read s at the junction and
    the sum adds all of them.
    """
    found, senses = [], set()
    for y, factor in terms.items():
        left, x, a, b = links[y]
        sense = names.of(left)[1]
        if names.of(a) == names.of(s):
            found.append((x, b))
        elif names.of(b) == names.of(s):
            found.append((e.Unary("Minus", x), a))
            sense = -sense
        else:
            return None
        senses.add(sense * factor)
    return found if len(senses) == 1 and senses <= {1, -1} else None


def _roots(flows: Sequence[Any], names: EqualNames) -> dict[Any, int]:
    return dict(names.of(x) for x in flows)


def _up_to_sign(terms: dict[Any, int]) -> frozenset[tuple[Any, int]]:
    sign = 1 if min(terms.items(), key=repr)[1] > 0 else -1
    return frozenset((name, sign * count) for name, count in terms.items())


def _sum(parts: Sequence[Any]) -> Any:
    return ft.reduce(lambda a, b: e.Binary("Add", a, b), parts)


def _mixture(ports: Sequence[tuple[Any, Any]]) -> Any:
    """The mixed value of the flows into a junction."""
    inflows = [e.Builtin("Max", (e.Unary("Minus", x), e.Const(0.0))) for x, _ in ports]
    total = _sum(inflows)
    mean = e.Binary("Div", _sum([s for _, s in ports]), e.Const(float(len(ports))))
    carried = _sum([e.Binary("Mul", inflow, s) for inflow, (_, s) in zip(inflows, ports, strict=True)])
    flowing = e.Binary("Gt", total, e.Const(0.0))
    return e.Builtin("NoEvent", (e.If(((flowing, e.Binary("Div", carried, total)),), mean),))
