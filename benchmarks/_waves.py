"""Water hammer in a pipe without friction: implicit steps beside explicit ones."""

from typing import Any

import diffrax
import numpy as np

from acausal import Component, Connections, connect, simulate
from components.blocks import Ramp
from components.hydraulic import ConstantPressure, LinearLiquid, NoFriction, Pipe, SignalFlow

from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest

AGAINST_EXPLICIT = 2.0  # times a run with Tsit5
END, RTOL = 1.0, 1e-6
FLOW, PRESSURE, CLOSING = 8e-5, 5e6, 0.02  # m3/s, Pa, s


class Hammer(Component):
    """A reservoir, a pipe, and a valve that closes evenly."""

    reservoir: ConstantPressure
    pipe: Pipe
    closing: Ramp
    valve: SignalFlow = SignalFlow()

    def connections(self) -> Connections:
        return (
            connect(self.reservoir.port, self.pipe.a),
            connect(self.pipe.b, self.valve.port),
            connect(self.closing.y, self.valve.u),
        )


def hammer(n: int) -> Hammer:
    """A pipe of 20 m with n segments."""
    liquid = LinearLiquid(density=1060.0, bulk_modulus=1.5e9, viscosity=15e-6)
    pipe = Pipe(n=n, length=20.0, diameter=0.01, friction=NoFriction(), liquid=liquid, p=PRESSURE, q=FLOW)
    closing = Ramp(height=FLOW, duration=CLOSING, offset=-FLOW)
    return Hammer(reservoir=ConstantPressure(pressure=PRESSURE), pipe=pipe, closing=closing)


def rows_of_waves(effort: Effort) -> list[Row]:
    """The steps of Rodas5P beside those of Tsit5."""
    n = min(200, max(effort.nodes))
    model = hammer(n)

    def run(solver: diffrax.AbstractSolver | None) -> Any:
        return simulate(model, END, rtol=RTOL, save="end", solver=solver, max_steps=100_000)

    solvers = {"own": None, "Tsit5": diffrax.Tsit5()}
    times = fastest({name: lambda s=solver: run(s).t1 for name, solver in solvers.items()}, min(effort.repeats, 5))
    np.testing.assert_allclose(run(None).final.pipe.p, run(solvers["Tsit5"]).final.pipe.p, atol=0.02 * PRESSURE)
    name = f"water hammer in {n} segments: run"
    return [compared(name, 1e3 * times["own"], "ms", 1e3 * times["Tsit5"], "Tsit5", AGAINST_EXPLICIT)]
