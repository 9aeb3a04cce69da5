"""A chain of inertias and springs: how the passes and the generated vector field grow with the system."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Array, Component, Connections, choose_states, connect, repeat
from components.rotational import Inertia, Spring

from ._effort import Effort
from ._rows import Row
from ._timing import fastest

LIMITS = {"structure": 1.2, "XLA": 1.0, "call": 50e-6}  # s, at the greatest length
COLUMNS = ("structure", "XLA", "pack", "call")


class ChainOfArrays(Component):
    """The springs join neighbours of an array of inertias."""

    masses: Array[Inertia]
    springs: Array[Spring]

    def connections(self) -> Connections:
        return connect(self.masses[:-1].b, self.springs[:].a), connect(self.masses[1:].a, self.springs[:].b)


class ChainOfSingles(Component):
    """The same of components declared one by one."""

    masses: tuple[Inertia, ...]
    springs: tuple[Spring, ...]

    def connections(self) -> Connections:
        left = tuple(connect(m.b, s.a) for m, s in zip(self.masses, self.springs, strict=False))
        return left + tuple(connect(m.a, s.b) for m, s in zip(self.masses[1:], self.springs, strict=True))


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """Both ways to declare the chain, at all lengths; the limits hold at the greatest."""
    makers = {"array": chain_of_arrays, "single parts": _of_singles}
    times = {name: [_measured(make, n, effort) for n in effort.lengths] for name, make in makers.items()}
    if out is not None:
        from ._figures import scaling

        lines = {f"{c}, {name}": [row[c] for row in rows] for name, rows in times.items() for c in COLUMNS}
        scaling(effort.lengths, lines, out / "chain.png")
    return [
        _row(f"chain of {n}, {name}: {column}", row[column], LIMITS.get(column), n == max(effort.lengths))
        for name, rows in times.items()
        for n, row in zip(effort.lengths, rows, strict=True)
        for column in COLUMNS
    ]


def _row(name: str, seconds: float, limit: float | None, is_longest: bool) -> Row:
    value, unit, scale = (seconds, "s", 1.0) if seconds > 1e-2 else (seconds * 1e6, "us", 1e6)
    if limit is None:
        return Row(name, value, unit, "", None)
    return Row(name, value, unit, f"limit: {limit * scale:g} {unit}", seconds / limit, 1.0 if is_longest else None)


def _numbers(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.linspace(1.0, 2.0, n), np.linspace(2.0, 1.0, n - 1)


def chain_of_arrays(n: int, speed: float = 0.0) -> ChainOfArrays:
    """A chain whose first inertia starts at a speed."""
    inertia, stiffness = _numbers(n)
    masses = repeat(Inertia(J=jnp.asarray(inertia), w=np.where(np.arange(n) == 0, speed, 0.0)), n)
    return ChainOfArrays(masses=masses, springs=repeat(Spring(c=jnp.asarray(stiffness)), n - 1))


def _of_singles(n: int) -> Component:
    inertia, stiffness = _numbers(n)
    return ChainOfSingles(
        masses=tuple(Inertia(J=float(J)) for J in inertia), springs=tuple(Spring(c=float(c)) for c in stiffness)
    )


def _measured(make: Callable[[int], Component], n: int, effort: Effort) -> dict[str, float]:
    model = make(n)
    structure, system = _timed(lambda: choose_states(model))
    packing = fastest({"pack": lambda: jax.tree_util.tree_map(jnp.asarray, system.pack(model))}, 3)["pack"]
    inputs = jax.tree_util.tree_map(jnp.asarray, system.pack(model))
    t, y = jnp.asarray(0.0), jnp.asarray(np.random.default_rng(0).normal(size=len(system.nominals)))
    lowered = jax.jit(system.vector_field).lower(t, y, inputs)
    xla, call = _timed(lowered.compile)
    _check(n, system.state_names, np.asarray(y), np.asarray(call(t, y, inputs)))
    calling = fastest({"call": lambda: call(t, y, inputs)}, 5 * effort.repeats)["call"]
    return {"structure": structure, "XLA": xla, "pack": packing, "call": calling}


def _timed(function: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = function()
    return time.perf_counter() - start, result


def _check(n: int, names: list[str], y: np.ndarray, rates: np.ndarray) -> None:
    """Compare with the equations of the chain in numpy."""
    speeds = np.array([i for i, name in enumerate(names) if name.endswith(".w") or ".w[" in name])
    angles = np.setdiff1d(np.arange(len(names)), speeds)
    inertia, stiffness = _numbers(n)
    torque = stiffness * np.diff(y[angles])
    net = np.concatenate([torque, [0.0]]) - np.concatenate([[0.0], torque])
    np.testing.assert_allclose(rates[angles], y[speeds], rtol=1e-12)
    np.testing.assert_allclose(rates[speeds], net / inertia, rtol=1e-9, atol=1e-12)
