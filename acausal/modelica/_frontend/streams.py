"""Stream connectors (Modelica 3.6, chapter 15): `inStream`, `actualStream`, and the streams of outside connectors."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, equality
from .classes import ComponentElement
from .connections import Connections, ConnectorEnd, Sets, added
from .modifiers import Index

if TYPE_CHECKING:
    from .structure import Context

_SMALL = 1e-7  # a flow in place of none, so that the mixture of streams without flow is their mean


class Streams:
    """The streams of a model, whose connections are known."""

    def __init__(self, context: "Context", connections: Connections) -> None:
        self._context = context
        self._sets = Sets[ConnectorEnd]()
        self._members: dict[ConnectorEnd, list[ConnectorEnd]] = {}
        self._places = {}
        for pair in connections.split():
            if pair.kind == "stream":
                self._sets.join(pair.left, pair.right)
                self._places.setdefault(pair.left, pair.spot.place)
                self._places.setdefault(pair.right, pair.spot.place)
        for members in self._sets.all():
            for one in members:
                self._members[one] = members

    def inside(self, ref: e.Ref) -> e.Expression:
        """The value of `inStream` of a stream variable."""
        own = ConnectorEnd(ref.name, _index(ref), False)
        others = [one for one in self._members.get(own, ()) if one != own]
        return self._mixture(others) if others else ref

    def actual(self, ref: e.Ref) -> e.Expression:
        """The value of `actualStream` of a stream variable."""
        inside = self.inside(ref)
        if inside == ref:
            return ref
        return e.If(((e.Binary("Gt", self._flow(ref.name), e.Const(0.0)), inside),), ref)

    def equations(self) -> Iterator[FlatEquation]:
        """The equations of the streams of outside connectors."""
        for members in self._sets.all():
            for own in members:
                if own.is_outside:
                    others = [one for one in members if one != own]
                    yield equality(own.ref, self._mixture(others), "connection", place=self._places[own])

    def _mixture(self, ends: Sequence[ConnectorEnd]) -> e.Expression:
        """The mixture of the streams that flow to a connector from others."""
        values = [(self._weight(one), self._value(one)) for one in ends]
        flowing = [(weight, value) for weight, value in values if weight is not None] or values[:1]
        if len(flowing) == 1:
            return flowing[0][1]
        total = added([weight for weight, _ in flowing if weight is not None])
        mixed = added([e.Binary("Mul", weight, value) for weight, value in flowing if weight is not None])
        return e.Binary("Div", mixed, total)

    def _value(self, one: ConnectorEnd) -> e.Expression:
        return self.inside(one.ref) if one.is_outside else one.ref

    def _weight(self, one: ConnectorEnd) -> e.Expression | None:
        """The flow from a connector into the junction; None if it never has this direction."""
        flow = self._flow(one.name)
        component = self._context.find(flow.name)
        limit = self._limit(component, "max" if one.is_outside else "min")
        if limit is not None and (limit <= 0 if one.is_outside else limit >= 0):
            return None
        into = flow if one.is_outside else e.Unary("Minus", flow)
        return e.Builtin("Max", (into, e.Const(_SMALL)))

    def _limit(self, component: ComponentElement | None, name: str) -> float | None:
        found = None if component is None else self._context.attribute(component, name)
        return None if found is None else self._context.known(found.x)

    def _flow(self, name: str) -> e.Ref:
        """The flow variable of the connector with a stream variable."""
        component = self._context.find(name)
        assert component is not None
        holder = component.holder
        while True:
            flows = [one for one in holder.components() if one.prefix("connection") == "flow"]
            if len(flows) == 1 and not self._context.sizes(flows[0]):
                self._context.register(flows[0])
                return e.Ref(flows[0].path)
            if holder.component is None or flows:
                raise component.error(
                    f"the connector of the stream {component.name} must have one flow variable, a scalar."
                )
            holder = holder.component.holder


def _index(ref: e.Ref) -> Index:
    return tuple(int(sub.value) for sub in ref.subs if isinstance(sub, e.Const))
