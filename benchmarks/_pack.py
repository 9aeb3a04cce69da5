"""A battery pack of many cells in series that warm each other, for an hour of a drive cycle."""

import jax.numpy as jnp
import numpy as np

from acausal import Array, Component, Connections, connect, repeat, simulate
from components.blocks import TimeSeries
from components.electrical import Battery, Ground, SignalCurrent
from components.thermal import FixedTemperature, HeatCapacitor, HeatPort, ThermalConductor

from ._effort import Effort
from ._rows import Row
from ._timing import fastest

LIMIT = 10.0  # s
HOUR, PERIOD = 3600.0, 1.0  # s, the period of the samples of the cycle
CAPACITY = 180e3  # C, 50 A.h
CHARGES = np.array([0.0, 0.1, 0.5, 0.9, 1.0])
VOLTAGES = np.array([3.0, 3.4, 3.65, 4.05, 4.2])


class Pack(Component):
    """Cells in series. Heat flows between neighbours and to the surroundings."""

    cycle: TimeSeries
    load: SignalCurrent
    cells: Array[Battery]
    bodies: Array[HeatCapacitor]
    gaps: Array[ThermalConductor]
    walls: Array[ThermalConductor]
    ambient: FixedTemperature
    ground: Ground

    def connections(self) -> Connections:
        heat = self.cells.item.heat
        assert heat is not None
        return (
            connect(self.cycle.y, self.load.u),
            connect(self.load.p, self.cells[0].p),
            connect(self.cells[:-1].n, self.cells[1:].p),
            connect(self.cells[-1].n, self.load.n, self.ground.p),
            connect(heat, self.bodies[:].port, self.walls[:].a),
            connect(self.walls[:].b, self.ambient.port),
            connect(self.bodies[:-1].port, self.gaps[:].a),
            connect(self.bodies[1:].port, self.gaps[:].b),
        )


def current(t: np.ndarray) -> np.ndarray:
    """The current drawn from the cells in A: hills, stops and braking."""
    return 40.0 * np.maximum(np.sin(t / 97.0), 0.0) + 60.0 * np.sin(t / 11.0) * (np.sin(t / 40.0) > 0.0)


def pack(n: int) -> Pack:
    """A pack of n cells whose resistances vary by a tenth."""
    times = np.arange(0.0, HOUR + PERIOD, PERIOD)
    spread = 1.0 + 0.1 * np.sin(np.arange(n))
    cell = Battery(
        Q=CAPACITY, charges=jnp.asarray(CHARGES), voltages=jnp.asarray(VOLTAGES), R0=jnp.asarray(1e-3 * spread),
        R=[1e-3, 2e-3], C=[1e4, 1e5], soc=0.9, heat=HeatPort(),
    )  # fmt: skip
    return Pack(
        cycle=TimeSeries(times=jnp.asarray(times), values=jnp.asarray(current(times)), smooth=False),
        load=SignalCurrent(),
        cells=repeat(cell, n),
        bodies=repeat(HeatCapacitor(C=1000.0, T=293.15), n),
        gaps=repeat(ThermalConductor(G=1.0), n - 1),
        walls=repeat(ThermalConductor(G=0.1), n),
        ambient=FixedTemperature(temperature=293.15),
        ground=Ground(),
    )


def rows_of_packs(effort: Effort) -> list[Row]:
    """The time of an hour, after a first run."""
    model = pack(effort.cells)
    seconds = fastest({"hour": lambda: simulate(model, HOUR, save="end").t1}, min(effort.repeats, 2))["hour"]
    name = f"pack of {effort.cells} cells: an hour"
    return [Row(name, seconds, "s", f"limit: {LIMIT:g} s", seconds / LIMIT, 1.0)]
