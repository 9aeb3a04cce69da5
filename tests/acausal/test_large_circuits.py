"""Large circuits: values against closed forms."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Array, Component, Connections, connect, repeat, replace, simulate, structure
from acausal._reduce.index import FRACTIONS, dependencies
from benchmarks import _pack
from benchmarks._grid import decay, grid_of_arrays, grid_of_singles, slowest
from components.electrical import ConstantVoltage, Ground, Resistor

N = 20


class Star(Component):
    """Resistors from a source to ground, in parallel."""

    source: ConstantVoltage
    resistors: Array[Resistor]
    ground: Ground

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistors[:].p),
            connect(self.source.n, self.ground.p, self.resistors[:].n),
        )


def test_a_sum_of_many_flows() -> None:
    resistances = jnp.linspace(1.0, 2.0, N)
    star = Star(source=ConstantVoltage(V=3.0), resistors=repeat(Resistor(R=resistances), N), ground=Ground())
    assert structure(star).system.plan.groups[-1].program.weights is not None
    end = simulate(star, 1.0, save="end").final
    np.testing.assert_allclose(end.source.i, -jnp.sum(3.0 / resistances), rtol=1e-12)
    np.testing.assert_allclose(end.ground.p.i, 0.0, atol=1e-12)


@pytest.mark.parametrize("make", [grid_of_arrays, grid_of_singles])
@pytest.mark.thorough
def test_a_mode_of_a_grid_decays(make: Callable[[int], Component]) -> None:
    n, end = 7, 2.0
    solution = simulate(make(n), end, rtol=1e-8, save="end")
    assert "Steps: sparse" in str(structure(make(n)))
    found = [solution[f"nodes[{i}].v"][-1] for i in range(n * n)]
    np.testing.assert_allclose(found, slowest(n) * np.exp(-decay(n) * end), rtol=1e-6, atol=1e-8)


def test_rows_with_a_column_of_their_own_are_in_no_combination() -> None:
    rows = [{0: 1, 1: 1}, {1: 1, 2: 1}, {2: 1, 3: -1}, {2: 2, 3: -2}, {3: 1, 4: 1}]
    assert dependencies(rows, FRACTIONS) == [{2: -2, 3: 1}]
    assert dependencies(rows[:3], FRACTIONS) == []


@pytest.mark.thorough
def test_cells_of_a_pack() -> None:
    """At a constant current i into the load, the charge falls with time, and each RC pair approaches -R i."""
    n, current, end = 11, 10.0, 600.0
    pack = replace(_pack.pack(n), {"cycle.values": jnp.full(3601, current)})
    assert "Steps: sparse" in str(structure(pack))
    cells = simulate(pack, end, rtol=1e-8, save="end").final.cells.item
    np.testing.assert_allclose(cells.soc, 0.9 - current * end / _pack.CAPACITY, rtol=1e-9)
    resistance, capacity = np.array([1e-3, 2e-3]), np.array([1e4, 1e5])
    expected = -resistance * current * (1.0 - np.exp(-end / (resistance * capacity)))
    np.testing.assert_allclose(cells.v_rc, np.broadcast_to(expected, (n, 2)), rtol=1e-6)
