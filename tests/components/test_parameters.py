"""Parameters outside their range are refused where the component is built."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import pytest

from acausal import Component, ParameterError, Record
from components import electrical, hydraulic, rotational, translational

BAD: dict[str, Callable[[], Component | Record]] = {
    "Mass.m": lambda: translational.Mass(m=-1.0),
    "Inertia.J": lambda: rotational.Inertia(J=0.0),
    "Inductor.L": lambda: electrical.Inductor(L=0.0),
    "Resistor.R": lambda: electrical.DCMotor(R=-1.0, k=1.0, J=1.0),
    "SlaveCylinder.bore": lambda: hydraulic.SlaveCylinder(bore=float("nan")),
    "Line.stiffness": lambda: hydraulic.Line.from_bulk_modulus(bulk_modulus=-1e9, volume=1e-5),
    "MeshLoss.efficiency": lambda: rotational.MeshLoss(efficiency=1.1),
    "PlanetaryGearbox.ratio": lambda: rotational.PlanetaryGearbox(ratio=1.0),
    "EccentricDisc.eccentricity": lambda: rotational.EccentricDisc(eccentricity=2.0, radius=1.0),
    "TabulatedLift.angles": lambda: rotational.TabulatedLift(angles=jnp.array([0.0, 2.0, 1.0]), lifts=jnp.zeros(3)),
    "TabulatedLift.lifts must be equal": lambda: rotational.TabulatedLift(
        angles=jnp.arange(3.0), lifts=jnp.array([0.0, 1.0, 2.0])
    ),
    "TabulatedSpring.positions": lambda: translational.TabulatedSpring(positions=jnp.zeros(2), forces=jnp.zeros(2)),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_parameter(name: str) -> None:
    with pytest.raises(ParameterError, match=name):
        BAD[name]()


def test_components_can_be_built_from_traced_parameters() -> None:
    def lift(e: float, radius: float) -> jax.Array:
        return jnp.asarray(rotational.EccentricDisc(eccentricity=e, radius=radius).lift(jnp.pi))

    assert jax.jit(lift)(0.2, 1.0) == pytest.approx(0.4)
    assert jax.grad(lift)(0.2, 1.0) == pytest.approx(2.0)
