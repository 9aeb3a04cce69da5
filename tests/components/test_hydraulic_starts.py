"""Hydraulic circuits find their pressures from rest, with any valves open or shut."""

from random import Random
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _hydraulic_networks import Layout, Network, lack, random_layout, random_network

from acausal import Component, Connections, connect, simulate
from acausal._evaluate.building import system_of
from acausal._evaluate.observe import observe
from components.blocks import Constant
from components.hydraulic import ConstantFlow, OnOffValve, ReliefValve, Tank

ALIKE = 20  # circuits of one layout, which one program solves


def pressures(layout: Layout, networks: list[Network]) -> np.ndarray:
    """The pressures of all nodes of alike circuits, each solved from its start values."""
    system = system_of(networks[0])
    place = {leaf.path: i for i, leaf in enumerate(system.flat.leaves)}
    nodes = networks[0].nodes[1:]
    leaves = [place[f"parts[{node[0][0]}].{node[0][1]}.p"] for node in nodes]
    rest = jnp.zeros(int(system.plan.starts[-1]))

    def solved(network: Any) -> Any:
        return observe(system, 0.0, rest, system.pack(network), leaves)

    stacked = jax.tree.map(lambda *values: jnp.stack([jnp.asarray(x, float) for x in values]), *networks)
    found = np.asarray(jax.jit(jax.vmap(solved))(stacked))
    return np.concatenate([np.zeros((1, len(networks))), found]).T


def are_found(seed: int) -> list[bool]:
    """Whether circuits of one random layout start with pressures that balance the flows.

    Pressures are found to a 1e-9th of 10 MPa, by which the flow over a check valve, whose corner is 1 kPa wide, changes
    by a 1e-5th.
    """
    random = Random(seed)
    layout = random_layout(random)
    networks = [random_network(layout, random) for _ in range(ALIKE)]
    found = pressures(layout, networks)
    are_good = [bool(np.all(np.isfinite(row))) for row in found]
    for network, row, is_good in zip(networks, found, are_good, strict=True):
        assert not is_good or np.all(np.abs(lack(layout, network, row)) < 1e-5), layout
    return are_good


@pytest.mark.thorough
def test_random_circuits_start_from_rest() -> None:
    assert all(is_good for seed in range(5) for is_good in are_found(seed))


@pytest.mark.slow
def test_nearly_all_random_circuits_start_from_rest() -> None:
    assert np.mean([is_good for seed in range(100, 140) for is_good in are_found(seed)]) > 0.99


class Blocked(Component):
    """A flow against a relief valve and a shut valve."""

    flow: ConstantFlow
    relief: ReliefValve
    opening: Constant
    valve: OnOffValve
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, self.relief.a, self.valve.a),
            connect(self.relief.b, self.valve.b, self.tank.port),
            connect(self.opening.y, self.valve.u),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("cracking", [1e6, 2e7, 7e8])
def test_a_flow_against_a_relief_valve_and_a_shut_valve(cracking: float) -> None:
    """Beyond its rounded corner, q = conductance (dp - cracking + leakage dp)."""
    model = Blocked(
        flow=ConstantFlow(flow=1e-3),
        relief=ReliefValve(conductance=1e-9, cracking_pressure=cracking),
        opening=Constant(k=0.0),
        valve=OnOffValve(area=1e-5, density=860.0),
    )
    end = simulate(model, 1.0, save="end").final
    assert float(end.flow.port.p) == pytest.approx((1e-3 / 1e-9 + cracking) / (1.0 + 1e-6), rel=1e-9)
