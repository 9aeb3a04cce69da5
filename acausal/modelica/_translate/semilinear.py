"""Chains of equations with `semiLinear` (Modelica 3.6, section 3.7.4.5), and junctions of them.

At zero flow, y = semiLinear(x, a, s) does not determine s. The equations of a chain

    y = semiLinear(x, a, s1);  y = semiLinear(x, s1, s2);  ...  y = semiLinear(x, sN, b)

become

    s1 = if x >= 0 then a else b;  s2 = s1;  ...  y = semiLinear(x, a, b)

and y = semiLinear(x, a, b) with x = 0 and y = 0 becomes a = b. A port is often written in the other direction:
-y = semiLinear(-x, s1, a) is the first equation above.

A junction is y1 + y2 + y3 = 0 and x1 + x2 + x3 = 0 with yi = semiLinear(xi, s, si), for any number of ports. The first
sum becomes s = (sum of max(-xi, 0) si) / (sum of max(-xi, 0)), which is the same, or the mean of all si without flow,
as for streams (section 15.2).
"""

import dataclasses
import functools as ft
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable, sides

_SIGNS = {"Add": 1, "AddElem": 1, "Plus": 1, "Sub": -1, "SubElem": -1, "Minus": -1}
ZERO = e.Const(0)


class EqualNames:
    """Classes of equal names, from the equations that are a sum of at most two of them."""

    def __init__(self, equations: Iterable[FlatEquation], variables: Mapping[str, FlatVariable]) -> None:
        self._above: dict[Any, tuple[Any, int]] = {}
        sums = [terms for equation in equations if (terms := terms_of(equation.residual)) is not None]
        for variable in variables.values():
            if variable.binding is not None and variable.variability not in ("parameter", "constant"):
                terms = terms_of(e.Binary("Sub", e.Ref(variable.name), variable.binding))
                sums += [] if terms is None else [terms]
        self._merge(sums)

    def of(self, x: Any) -> tuple[Any, int]:
        """The name that stands for the class of a name, or the expression itself, and the sign; `ZERO` for zeros."""
        if isinstance(x, e.Unary) and x.op in _SIGNS:
            root, sign = self.of(x.arg)
            return root, sign * _SIGNS[x.op]
        if isinstance(x, e.Const) and x.value == 0:
            return ZERO, 1
        sign = 1
        while x in self._above:
            x, own = self._above[x]
            sign *= own
        return x, sign

    def sum_of(self, x: Any) -> dict[Any, int]:
        """The names that stand for those of a sum, with their factors; empty for other expressions."""
        return self._collected(terms_of(x) or [])

    def _collected(self, terms: list[tuple[Any, int]]) -> dict[Any, int]:
        found: dict[Any, int] = {}
        for name, sign in terms:
            root, own = self.of(name)
            found[root] = found.get(root, 0) + sign * own
        return {name: count for name, count in found.items() if count and name != ZERO}

    def _merge(self, sums: list[list[tuple[Any, int]]]) -> None:
        """Merges until nothing new follows: a sum of three becomes one of two once a term of it is zero."""
        while True:
            waiting = []
            for terms in sums:
                rest = list(self._collected(terms).items())
                if len(rest) > 2 or (len(rest) == 2 and any(abs(count) != 1 for _, count in rest)):
                    waiting.append(terms)
                elif len(rest) == 2:
                    (first, a), (second, b) = rest
                    self._above[second] = (first, -a * b)
                elif rest:
                    self._above[rest[0][0]] = (ZERO, 1)
            if len(waiting) == len(sums):
                return
            sums = waiting


def terms_of(x: Any) -> list[tuple[Any, int]] | None:
    """The names of a sum and their signs; None for other expressions."""
    match x:
        case e.Ref():
            return [(x, 1)]
        case e.Const() if x.value == 0 and not isinstance(x.value, bool):
            return []
        case e.Unary() if x.op in _SIGNS:
            terms = terms_of(x.arg)
            return None if terms is None else [(name, sign * _SIGNS[x.op]) for name, sign in terms]
        case e.Binary() if x.op in _SIGNS:
            left, right = terms_of(x.left), terms_of(x.right)
            if left is None or right is None:
                return None
            return [*left, *((name, sign * _SIGNS[x.op]) for name, sign in right)]
    return None


def semilinear(residual: Any) -> tuple[Any, Any, Any, Any] | None:
    """y, x, first and second of an equation y = semiLinear(x, first, second)."""
    for y, call in sides(residual):
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


@dataclasses.dataclass(frozen=True)
class _Link:
    """An equation y = semiLinear(x, first, second) and its place. `is_turned`: first and second have been exchanged,
    to agree with an equation for -x and -y.
    """

    place: int
    y: Any
    x: Any
    first: Any
    second: Any
    sign: int  # of x, as a multiple of the name that stands for it
    is_turned: bool = False

    def oriented(self, sign: int) -> "_Link":
        if self.sign == sign:
            return self
        return dataclasses.replace(self, first=self.second, second=self.first, is_turned=True)

    def along(self, a: Any, b: Any) -> tuple[Any, Any]:
        """The ends of a chain in the order in which the equation itself reads them."""
        return (b, a) if self.is_turned else (a, b)


def without_chains(equations: Sequence[FlatEquation], variables: Mapping[str, FlatVariable]) -> list[FlatEquation]:
    """The equations, with those of chains replaced."""
    stated = [(place, found) for place, q in enumerate(equations) if (found := semilinear(q.residual)) is not None]
    if not stated:
        return list(equations)
    names = EqualNames(equations, variables)
    groups: dict[tuple[Any, Any, int], list[_Link]] = {}
    changed: dict[int, Any] = {}
    for place, (y, x, first, second) in stated:
        (y_root, y_sign), (x_root, x_sign) = names.of(y), names.of(x)
        if y_root == ZERO and x_root == ZERO:
            changed[place] = e.Binary("Sub", first, second)
        else:
            link = _Link(place, y, x, first, second, x_sign)
            groups.setdefault((x_root, y_root, x_sign * y_sign), []).append(link)
    for links in groups.values():
        for chain in _chains(links, names):
            changed.update(_replaced(chain))
    residuals = [changed.get(place, q.residual) for place, q in enumerate(equations)]
    changed.update(mixed(residuals, names))
    return [
        dataclasses.replace(q, residual=changed[place]) if place in changed else q for place, q in enumerate(equations)
    ]


def _chains(links: list[_Link], names: EqualNames) -> list[list[_Link]]:
    """Chains of two or more links: each but the last one ends where only the next one begins."""
    links = [link.oriented(links[0].sign) for link in links]
    begins: dict[Any, list[_Link]] = {}
    ends: dict[Any, list[_Link]] = {}
    for link in links:
        begins.setdefault(names.of(link.first), []).append(link)
        ends.setdefault(names.of(link.second), []).append(link)
    after = {
        own[0].place: begins[node][0] for node, own in ends.items() if len(own) == 1 and len(begins.get(node, ())) == 1
    }
    followed = {link.place for link in after.values()}
    found = []
    for link in links:
        if link.place in followed:
            continue
        chain = [link]
        while chain[-1].place in after:
            chain.append(after[chain[-1].place])
        if len(chain) > 1:
            found.append(chain)
    return found


def _replaced(chain: list[_Link]) -> dict[int, Any]:
    """The residuals that take the places of those of a chain."""
    first, last = chain[0], chain[-1]
    a, b = first.first, last.second
    up, down = first.along(a, b)
    value = e.If(((e.Binary("Ge", first.x, e.Const(0.0)), up),), down)
    inner = [link.second for link in chain[:-1]]
    residuals = [e.Binary("Sub", inner[0], value), *(e.Binary("Sub", s, inner[0]) for s in inner[1:])]
    residuals.append(e.Binary("Sub", last.y, e.Builtin("SemiLinear", (last.x, *last.along(a, b)))))
    return {link.place: residual for link, residual in zip(chain, residuals, strict=True)}
