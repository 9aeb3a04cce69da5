"""Column separation behind a closed valve: the void grows along the pipe."""

import diffrax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, replace, simulate
from components.hydraulic import ConstantPressure, NoFriction, Pipe, iso_vg_46

LENGTH, SPEED, DROP, N = 10.0, 3.0, 3e5, 60  # of pipe, of the column, and from the vessel to the vapour; segments


class Torn(Component):
    """A pipe closed at a; the column in it flows on into a vessel at b."""

    line: Pipe
    vessel: ConstantPressure

    def connections(self) -> Connections:
        return (connect(self.line.b, self.vessel.port),)


@pytest.mark.thorough
def test_void_behind_a_rigid_column() -> None:
    """It grows to v^2 rho L/(2 dp) and shuts after 2 v rho L/dp, more than the node at the valve holds.

    The column's elasticity lets it be some per cent less: v/c, and what the air in it takes up.
    """
    oil = iso_vg_46(air=1e-4)
    line = Pipe(n=N, length=LENGTH, diameter=0.012, liquid=oil, p=DROP - 101315.0, friction=NoFriction())
    line = replace(line, {"q": np.full(N, SPEED * float(line.area))})
    inertia = float(oil.reference_density) * LENGTH / DROP
    times = jnp.linspace(0.0, 2.5 * SPEED * inertia, 301)
    rig = Torn(line=line, vessel=ConstantPressure(pressure=DROP - 101315.0))
    sol = simulate(rig, times[-1], save=times, solver=diffrax.Tsit5(), max_steps=40_000, rtol=1e-7, energy=True)
    p = jnp.transpose(sol.line.p)
    shares = jnp.ones(N + 1).at[jnp.array([0, -1])].set(0.5) * LENGTH / N
    void = shares @ (1.0 - oil.relative_density(p))
    assert float(jnp.max(void)) == pytest.approx(0.5 * SPEED**2 * inertia, rel=0.04)
    shut = float(times[int(jnp.argmax(void)) :][np.argmax(sol.line.p_a[int(jnp.argmax(void)) :] > DROP)])
    assert shut == pytest.approx(2.0 * SPEED * inertia, rel=0.04)
    assert float(jnp.min(p)) > -101325.0
    kinetic = 0.5 * SPEED**2 * float(oil.reference_density * line.area) * LENGTH
    assert float(sol.energy.imbalance) == pytest.approx(0.0, abs=1e-5 * kinetic)
