"""Start pressures and preloads that follow from the load, so that no number is stated twice."""

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Component, Connections, Scalar, connect, eq, initialise, replace, simulate
from components.hydraulic import SingleActingCylinder, iso_vg_46
from components.translational import Fixed, Mass, Spring

G = 9.80665  # standard gravity, m/s2


class Lift(Component):
    """A closed vertical cylinder carries a mass."""

    cylinder: SingleActingCylinder
    load: Mass

    def connections(self) -> Connections:
        return (connect(self.cylinder.flange, self.load.a),)


def lift() -> Lift:
    cylinder = SingleActingCylinder(bore=0.05, liquid=iso_vg_46(), dead=1e-4)
    return Lift(cylinder=cylinder, load=Mass(m=500.0, incline=jnp.pi / 2.0, s=0.2))


def test_the_pressure_follows_from_the_load() -> None:
    """p = m g / A, with its derivative by the mass; the run stays at rest where the load was put."""
    area = 0.25 * np.pi * 0.05**2

    def pressure(m: Scalar) -> Scalar:
        return initialise(replace(lift(), {"load.m": m}), steady=True).cylinder.p

    value, slope = jax.value_and_grad(pressure)(500.0)
    np.testing.assert_allclose([value, slope], [500.0 * G / area, G / area], rtol=1e-9)
    run = simulate(initialise(lift(), steady=True), 1.0, save=[0.0, 1.0])
    np.testing.assert_allclose(run["load.a.s"], 0.2, atol=1e-9)
    np.testing.assert_allclose(run["load.v"], 0.0, atol=1e-9)


class Suspended(Component):
    """A mass hangs on a spring."""

    ceiling: Fixed
    spring: Spring
    load: Mass

    def connections(self) -> Connections:
        return (connect(self.ceiling.flange, self.spring.b), connect(self.spring.a, self.load.b))


def test_the_preload_of_a_spring_follows_from_the_place_of_the_load() -> None:
    """c (s_rel - s_rel0) = m g: the free length is solved for, with its derivative by the mass."""
    model = Suspended(ceiling=Fixed(s0=1.0), spring=Spring(c=2e4), load=Mass(m=10.0, incline=jnp.pi / 2.0))

    def free_length(m: Scalar) -> Scalar:
        place = lambda s, d: dict(place=eq(s.load.b.s, 0.7))  # noqa: E731
        held = initialise(replace(model, {"load.m": m}), place, steady=True, solve_for=["spring.s_rel0"])
        return held.spring.s_rel0

    value, slope = jax.value_and_grad(free_length)(10.0)
    np.testing.assert_allclose([value, slope], [0.3 - 10.0 * G / 2e4, -G / 2e4], rtol=1e-8)
