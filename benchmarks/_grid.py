"""A grid of resistors with a capacitor at each node: the first result of a large circuit, with its compilation."""

import time

import jax.numpy as jnp
import numpy as np

from acausal import Array, Component, Connections, connect, repeat, simulate
from components.electrical import Capacitor, Ground, Resistor

from ._effort import Effort
from ._rows import Row

FIRST = 3.0  # s
END = 500.0  # s; resistances are 1 ohm and capacitances 1 F


class GridOfArrays(Component):
    """A square of nodes, numbered row by row, with resistors between neighbours."""

    n: int  # nodes in a row
    along: Array[Resistor]  # within the rows
    across: Array[Resistor]  # between the rows
    nodes: Array[Capacitor]
    ground: Ground

    def connections(self) -> Connections:
        n, nodes, along = self.n, self.nodes, self.along
        within = [
            (
                connect(along[i * (n - 1) : (i + 1) * (n - 1)].p, nodes[i * n : (i + 1) * n - 1].p),
                connect(along[i * (n - 1) : (i + 1) * (n - 1)].n, nodes[i * n + 1 : (i + 1) * n].p),
            )
            for i in range(n)
        ]
        return (
            connect(self.ground.p, nodes[:].n),
            connect(self.across[:].p, nodes[:-n].p),
            connect(self.across[:].n, nodes[n:].p),
            *(connection for pair in within for connection in pair),
        )


class GridOfSingles(Component):
    """The same of components declared one by one."""

    n: int
    along: tuple[Resistor, ...]
    across: tuple[Resistor, ...]
    nodes: tuple[Capacitor, ...]
    ground: Ground

    def connections(self) -> Connections:
        n, nodes = self.n, self.nodes
        firsts = [i for i in range(n * n) if (i + 1) % n]
        return (
            *(connect(self.ground.p, node.n) for node in nodes),
            *(connect(edge.p, nodes[i].p) for i, edge in zip(firsts, self.along, strict=True)),
            *(connect(edge.n, nodes[i + 1].p) for i, edge in zip(firsts, self.along, strict=True)),
            *(connect(edge.p, nodes[i].p) for i, edge in enumerate(self.across)),
            *(connect(edge.n, nodes[i + n].p) for i, edge in enumerate(self.across)),
        )


def grid_of_arrays(n: int) -> GridOfArrays:
    """A grid that starts in the slowest of its modes that vary in both directions."""
    resistors = repeat(Resistor(R=1.0), n * (n - 1))
    nodes = repeat(Capacitor(C=1.0, v=jnp.asarray(slowest(n))), n * n)
    return GridOfArrays(n=n, along=resistors, across=resistors, nodes=nodes, ground=Ground())


def grid_of_singles(n: int) -> GridOfSingles:
    """The same of components declared one by one."""
    resistors = tuple(Resistor(R=1.0) for _ in range(n * (n - 1)))
    nodes = tuple(Capacitor(C=1.0, v=float(v)) for v in slowest(n))
    return GridOfSingles(n=n, along=resistors, across=resistors, nodes=nodes, ground=Ground())


def slowest(n: int) -> np.ndarray:
    """The voltages of this mode."""
    wave = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    return np.ravel(np.outer(wave, wave))


def decay(n: int) -> float:
    """The rate at which this mode decays, in 1/s."""
    return 8.0 * np.sin(0.5 * np.pi / n) ** 2


def rows_of_grids(effort: Effort) -> list[Row]:
    """Both ways to declare the grid."""
    n, makers = effort.grid, {"array": grid_of_arrays, "single parts": grid_of_singles}
    return [_first_result(f"grid of {n} x {n}, {name}", make(n)) for name, make in makers.items()]


def _first_result(name: str, model: Component) -> Row:
    """The time of a first run and of reading the voltages at its end."""
    start = time.perf_counter()
    simulate(model, END, save="end")["nodes[0].v"]
    seconds = time.perf_counter() - start
    return Row(f"{name}: first result", seconds, "s", f"limit: {FIRST:g} s", seconds / FIRST, 1.0)
