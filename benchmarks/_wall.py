"""A wall of many thermal nodes: how a step grows with the system, and a run beside CVODE with its banded solver."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Array, Component, Connections, connect, linearise, repeat, replace, simulate
from components.thermal import FixedTemperature, HeatCapacitor, ThermalConductor

from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest

LIMITS = {100: 0.1, 200: 0.15, 1000: 0.8, 100_000: 150.0}  # ms a step
AGAINST_CVODE = 2.0
GRADIENT = 6.0  # times a run
POLES = 1.0  # s
HOT, COLD = 400.0, 293.15  # K
CONDUCTANCE = 10.0  # W/K, with capacities of 1 J/K
END, RTOL, FINE = 50.0, 1e-6, 1e-9
WARM = 0.3  # of n^2 C/G, when the far end is warm


class Wall(Component):
    """Capacities in a row, heated at one end."""

    hot: FixedTemperature
    conductors: Array[ThermalConductor]
    capacities: Array[HeatCapacitor]

    def connections(self) -> Connections:
        return (
            connect(self.hot.port, self.conductors[0].a),
            connect(self.conductors[:].b, self.capacities[:].port),
            connect(self.capacities[:-1].port, self.conductors[1:].a),
        )


def wall(n: int) -> Wall:
    """A cold wall of n nodes."""
    return Wall(
        hot=FixedTemperature(temperature=HOT),
        conductors=repeat(ThermalConductor(G=CONDUCTANCE), n),
        capacities=repeat(HeatCapacitor(C=1.0, T=COLD), n),
    )


def rows_of_walls(effort: Effort) -> list[Row]:
    """A step at all lengths; a run of the longest wall that CVODE can also do in a moment, and its gradient."""
    rows = [_step(wall(n), n, effort) for n in effort.nodes]
    n = min(1000, max(effort.nodes))
    model, other = wall(n), cvode(n)
    times = fastest({"own": lambda: _end(model), "cvode": other}, min(effort.repeats, 20))
    np.testing.assert_allclose(_end(model).final.capacities.item.T, other(), rtol=1e-4)
    name = f"wall of {n} nodes: run"
    rows.append(compared(name, 1e3 * times["own"], "ms", 1e3 * times["cvode"], "CVODE, banded", AGAINST_CVODE))
    return [*rows, _gradient(n, effort), _poles(n, effort)]


def _gradient(n: int, effort: Effort) -> Row:
    """The last temperature differentiated with respect to all conductances, in reverse mode."""
    model, end = wall(n), WARM * n**2 / CONDUCTANCE

    def last(conductances: jax.Array) -> jax.Array:
        changed = replace(model, {"conductors.item.G": conductances})
        return simulate(changed, end, rtol=RTOL, save="end")[f"capacities[{n - 1}].T"][-1]

    functions = {"run": jax.jit(last), "gradient": jax.jit(jax.grad(last))}
    given = jnp.full(n, CONDUCTANCE)
    times = fastest({name: lambda f=f: f(given) for name, f in functions.items()}, min(effort.repeats, 20))
    name = f"wall of {n} nodes: reverse gradient for all conductances"
    return compared(name, 1e3 * times["gradient"], "ms", 1e3 * times["run"], "run", GRADIENT)


def _poles(n: int, effort: Effort) -> Row:
    """The slowest poles of a wall."""
    model, count = wall(n), min(6, n)
    seconds = fastest({"poles": lambda: linearise(model).poles_near(count=count)}, min(effort.repeats, 5))["poles"]
    name = f"wall of {n} nodes: linearise, and the {count} slowest poles"
    return Row(name, seconds, "s", f"limit: {POLES:g} s", seconds / POLES, 1.0)


def _end(model: Wall, rtol: float = RTOL) -> Any:
    return simulate(model, END, rtol=rtol, save="end")


def _step(model: Wall, n: int, effort: Effort) -> Row:
    """The additional time of a run with more steps, for each of them: without its start and its end."""
    steps = {rtol: int(_end(model, rtol).stats["num_steps"]) for rtol in (RTOL, FINE)}
    runs = {str(rtol): lambda rtol=rtol: _end(model, rtol) for rtol in steps}
    times = fastest(runs, min(effort.repeats, 10))
    milliseconds = 1e3 * (times[str(FINE)] - times[str(RTOL)]) / (steps[FINE] - steps[RTOL])
    limit = LIMITS.get(n)
    against = "" if limit is None else f"limit: {limit:g} ms"
    ratio = None if limit is None else milliseconds / limit
    return Row(f"wall of {n} nodes: a step", milliseconds, "ms", against, ratio, None if limit is None else 1.0)


def cvode(n: int) -> Callable[[], np.ndarray]:
    """The same wall by hand, integrated by CVODE; returns the temperatures at the end."""
    from sksundae.cvode import CVODE

    def rates(t: float, y: np.ndarray, dy: np.ndarray) -> None:
        flow = CONDUCTANCE * -np.diff(y, prepend=HOT)
        dy[:] = flow
        dy[:-1] -= flow[1:]

    solver = CVODE(rates, rtol=RTOL, atol=RTOL, linsolver="band", lband=1, uband=1)
    return lambda: solver.solve(np.array([0.0, END]), np.full(n, COLD)).y[-1]
