"""Finding the initial pieces of tables, contacts and modes does no work in the energy account."""

import jax
import numpy as np
import pytest

from acausal import Component, Connections, Scalar, connect, simulate
from components.electrical import Battery, ConstantCurrent, Ground
from components.translational import ElastoGap, Fixed, Flange, HardStop, Mass, TabulatedSpring


class Stores(Component):
    """A battery, a spring by a table, a ball in contact or above it, and a block that hits a stop, each by itself."""

    battery: Battery
    load: ConstantCurrent
    spring: TabulatedSpring
    body: Mass
    gap: ElastoGap
    ball: Mass
    stop: HardStop
    block: Mass
    floor: Fixed = Fixed()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.battery.p, self.load.p),
            connect(self.spring.flange, self.body.a),
            connect(self.floor.flange, self.gap.a),
            connect(self.gap.b, self.ball.a),
            connect(self.block.b, self.stop.flange),
            connect(self.ground.p, self.battery.n, self.load.n),
        )


def stores(soc: Scalar, place: Scalar, height: Scalar) -> Stores:
    charges, voltages = [0.0, 0.1, 0.5, 0.9, 1.0], [3.0, 3.4, 3.6, 3.9, 4.2]
    positions, forces = [-2e-3, 0.0, 1e-3, 3e-3, 6e-3], [-50.0, 0.0, 80.0, 120.0, 90.0]
    return Stores(
        battery=Battery(Q=3600.0, charges=charges, voltages=voltages, R0=0.01, soc=soc),
        load=ConstantCurrent(I=20.0),
        spring=TabulatedSpring(positions=positions, forces=forces),
        body=Mass(m=1.0, a=Flange(s=place)),
        gap=ElastoGap(c=1e3, d=0.5),
        ball=Mass(m=1.0, a=Flange(s=height), v=-1.0),
        stop=HardStop(s_min=0.0),
        block=Mass(m=2.0, v=-1.0),
    )


@pytest.mark.thorough
def test_finding_pieces_and_modes_at_the_start_is_no_work() -> None:
    """From random states, on all pieces of the tables and beyond them; later impacts dissipate energy."""

    def account(soc: Scalar, place: Scalar, height: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        energy = simulate(stores(soc, place, height), 0.02, energy=True, save="end", rtol=1e-10).energy
        impacts = {name: lost for name, lost in energy.events.items() if name.startswith("stop.")}
        others = sum(abs(lost) for name, lost in energy.events.items() if name not in impacts)
        return energy.imbalance, others, sum(impacts.values())

    draw = np.random.default_rng(0)
    starts = draw.uniform([-0.1, -3e-3, -0.02], [1.1, 7e-3, 0.01], (12, 3)).T
    imbalance, others, impacts = jax.jit(jax.vmap(account))(*starts)
    np.testing.assert_allclose(imbalance, 0.0, atol=1e-6)
    np.testing.assert_allclose(others, 0.0, atol=1e-9)
    assert np.all((impacts > -1e-9) & (impacts < 1.0 + 1e-9))
