"""Networks as their raw equations E z' + A z + S s(t) = 0, assembled without the engine.

The sparse tableau: z holds what is across each node, the flow into each terminal, and the inner unknowns of elements;
the rows are the laws of the elements and the balance at each node.
"""

import inspect
from typing import Any

import numpy as np
from _laws import INNER, LAWS, Inner, Terminal
from _netlist import ACROSS, THROUGH, Netlist, Part, ports_of

DERIVATIVES = 9  # of the sources that are at hand, the zeroth included


class Sources:
    """s(t): the number 1, and the sines that drive parts of the netlist; with their derivatives."""

    def __init__(self, netlist: Netlist) -> None:
        driven = [part.values for part in netlist if part.driven]
        self.amplitude = np.array([1.0, *(sine["amplitude"] for sine in driven)])
        self.omega = np.array([0.0, *(2.0 * np.pi * sine["frequency"] for sine in driven)])
        self.phase = np.array([0.5 * np.pi, *(sine["phase"] for sine in driven)])

    def __call__(self, t: float, order: int = 0) -> Any:
        return self.amplitude * self.omega**order * np.sin(self.omega * t + self.phase + 0.5 * np.pi * order)

    def all(self, t: float) -> Any:
        """With all derivatives, one after the other."""
        return np.concatenate([self(t, order) for order in range(DERIVATIVES)])


class Tableau:
    """The raw equations; `signals` picks variables from z by the names they have in the model."""

    def __init__(self, netlist: Netlist) -> None:
        nodes = list(dict.fromkeys(node for part in netlist for node in part.nodes))
        terminals = [(i, port) for i, part in enumerate(netlist) for port in ports_of(part.kind)]
        inner = [(i, name) for i, part in enumerate(netlist) for name in INNER.get(part.name, ())]
        self._places: dict[Any, int] = {key: row for row, key in enumerate([*nodes, *terminals, *inner])}
        self.n = n = len(self._places)
        self.sources = Sources(netlist)
        self._z, self._rate, (one, *sines) = np.split(np.eye(2 * n + len(self.sources.omega)), [n, 2 * n])
        self.signals: dict[str, Any] = {}
        rows, balances = [], np.zeros((len(nodes), len(one)))
        for i, part in enumerate(netlist):
            ports, own = self._ports(i, part), self._inner(i, part)
            for node, terminal in zip(part.nodes, ports, strict=True):
                balances[self._places[node]] += terminal.f
            rows += _law(part, ports, list(own.values()), sines.pop(0) if part.driven else one)
            self._name(f"parts[{i}]", part, ports, own)
        self.A, self.E, self.S = np.split(np.array([*rows, *balances]), [n, 2 * n], axis=1)
        self.signals = {name: row[:n] for name, row in self.signals.items()}

    def _ports(self, i: int, part: Part) -> list[Terminal]:
        rows = [
            (self._places[node], self._places[i, port])
            for port, node in zip(ports_of(part.kind), part.nodes, strict=True)
        ]
        return [Terminal(self._z[node], self._rate[node], self._z[flow]) for node, flow in rows]

    def _inner(self, i: int, part: Part) -> dict[str, Inner]:
        rows = {name: self._places[i, name] for name in INNER.get(part.name, ())}
        return {name: Inner(self._z[row], self._rate[row]) for name, row in rows.items()}

    def _name(self, path: str, part: Part, ports: list[Terminal], own: dict[str, Inner]) -> None:
        domains = ports_of(part.kind)
        for (port, domain), terminal in zip(domains.items(), ports, strict=True):
            self.signals[f"{path}.{port}.{ACROSS[domain]}"] = terminal.x
            self.signals[f"{path}.{port}.{THROUGH[domain]}"] = terminal.f
        if list(domains) == ["p", "n"] and not part.name.endswith("Sensor"):
            self.signals |= {f"{path}.v": ports[0].x - ports[1].x, f"{path}.i": ports[0].f}
        if part.name in ("Spring", "Damper", "SpringDamper"):
            domain = domains["a"]
            self.signals[f"{path}.{ACROSS[domain]}_rel"] = ports[1].x - ports[0].x
            self.signals[f"{path}.{THROUGH[domain]}"] = ports[1].f
        self.signals |= {f"{path}.{name}": unknown.y for name, unknown in own.items()}


def _law(part: Part, ports: list[Terminal], own: list[Inner], source: Any) -> list[Any]:
    law = LAWS[part.name]
    values = {} if part.driven else dict(part.values)
    if "u" in inspect.signature(law).parameters:
        values["u"] = source
    return law(*ports, *own, **values)
