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
from collections.abc import Mapping, Sequence
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatVariable
from .equal_names import ZERO, EqualNames
from .mixing import mixed, semilinear


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
