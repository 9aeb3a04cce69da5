"""After `replace`, a component is one that its constructor accepts, or it is refused."""

import dataclasses
import pickle
import re
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, ModelError, ParameterError, Result, check, parameters, replace, simulate
from components import blocks, electrical, hydraulic, rotational, translational

COIL: dict[str, Any] = dict(R=10.0, L0=0.1, g0=1e-4, m=0.02, spring=1e3, preload=5.0, stroke=1e-3, density=850.0)
HOLDING = hydraulic.HoldingValve(**COIL, seat=1e-6, width=1e-3, residual_gap=1e-4)
SOLENOID = hydraulic.SolenoidValve(**COIL, area=1e-6, residual_gap=1e-4)
CYLINDER = hydraulic.HydraulicCylinder(
    chambers=hydraulic.DoubleActingCylinder(
        bore=0.04, rod=0.02, stroke=0.2, dead_a=1e-6, dead_b=1e-6, liquid=hydraulic.iso_vg_46()
    ),
    m=1.0, Fc=10.0, Fs=20.0, vs=0.01,
)  # fmt: skip
STOPPED = hydraulic.StoppedCylinder(bore=0.02, stroke=0.05)
MOTOR = electrical.BrushedMotor(R=1.0, k=0.03, J=1e-5, winding=10.0, housing=100.0, G_wh=1.0, G_ha=1.0)
PIPE = hydraulic.Pipe(n=4, length=1.0, diameter=0.01, liquid=hydraulic.iso_vg_46(), p=1e6, q=0.0)
ANGLES = np.linspace(0.0, 2.0 * np.pi, 9)
CAM = rotational.TabulatedLift(angles=ANGLES, lifts=1e-3 * (1.0 - np.cos(ANGLES)))
STATES = blocks.StateSpace(A=np.eye(2), B=np.ones((2, 1)), C=np.ones((1, 2)))
FILTER = blocks.TransferFunction(b=[1.0], a=[1.0, 2.0, 1.0])

# What a constructor gives to several parts, or what decides how many parts there are.
TIED: list[tuple[Component, dict[str, Any], str]] = [
    (HOLDING, {"stop.s_max": 2e-3}, "stop.s_max must equal poppet.stroke"),
    (HOLDING, {"poppet.stroke": 2e-3}, "stop.s_max must equal poppet.stroke"),
    (HOLDING, {"poppet.seated": 2e-3}, "poppet.seated must equal poppet.stroke"),
    (HOLDING, {"poppet.sense": 1.0}, "poppet.sense must be -1"),
    (HOLDING, {"stop.s_min": 1e-4}, "stop.s_min must be 0"),
    (HOLDING, {"coil.closed": 0.5e-3}, "coil.closed must be at least poppet.stroke"),
    (SOLENOID, {"stop.s_max": 2e-3}, "stop.s_max must equal valve.stroke"),
    (SOLENOID, {"valve.stroke": 0.5e-3}, "stop.s_max must equal valve.stroke"),
    (SOLENOID, {"coil.closed": 0.5e-3}, "coil.closed must be at least valve.stroke"),
    (CYLINDER, {"chambers.stroke": 0.3}, "stop.s_max must equal chambers.stroke"),
    (CYLINDER, {"stop.s_max": 0.3}, "stop.s_max must equal chambers.stroke"),
    (STOPPED, {"stop.s_min": 0.01}, "stop.s_min must be 0"),
    (MOTOR, {"emf.T_ref": 300.0}, "emf.T_ref must equal resistor.T_ref"),
    (blocks.WeightedSum(k=[1.0, 2.0]), {"k": np.ones(3)}, "k must have shape"),
    (blocks.WeightedSum(k=[1.0, 2.0]), {"k": np.ones(1)}, "k must have shape"),
    (STATES, {"B": np.ones((2, 2))}, "B must have shape"),
    (STATES, {"C": np.ones((2, 2))}, "C must have shape"),
    (STATES, {"D": np.ones((2, 2))}, "D must have shape"),
    (STATES, {"A": np.eye(3)}, "A must have shape"),
    (FILTER, {"a": np.ones(2)}, "a must have shape"),
    (FILTER, {"a": np.ones(4)}, "a must have shape"),
    (FILTER, {"b": np.ones(4)}, "b must have 1 to 3 coefficients"),
]
TOGETHER: list[tuple[Component, dict[str, Any]]] = [
    (HOLDING, {"stop.s_max": 0.5e-3, "poppet.stroke": 0.5e-3, "poppet.seated": 0.5e-3}),
    (HOLDING, {"spring.c": 2e3, "coil.closed": 2e-3}),
    (SOLENOID, {"stop.s_max": 0.5e-3, "valve.stroke": 0.5e-3}),
    (CYLINDER, {"stop.s_max": 0.3, "chambers.stroke": 0.3}),
    (MOTOR, {"emf.T_ref": 300.0, "resistor.T_ref": 300.0}),
    (FILTER, {"b": np.ones(3)}),
]


def said(component: Component) -> str:
    return "\n".join(check(component).problems)


@pytest.mark.parametrize(("component", "change", "text"), TIED)
def test_what_a_constructor_ties_stays_tied(component: Component, change: dict[str, Any], text: str) -> None:
    assert text not in said(component)
    with pytest.raises(ParameterError, match=re.escape(text)):
        replace(component, change)


@pytest.mark.parametrize(("component", "change"), TOGETHER)
def test_what_is_changed_together_is_accepted(component: Component, change: dict[str, Any]) -> None:
    assert "must" not in said(replace(component, change))


def test_a_spline_over_other_angles_is_another_one() -> None:
    cam, angles = rotational.Cam(profile=CAM), ANGLES + 0.1 * (np.arange(9) == 3)
    assert "coefficients" not in said(cam)
    with pytest.raises(ParameterError, match=r"profile\.coefficients must be those of the spline over angles"):
        replace(cam, {"profile.angles": angles})
    scaled = replace(cam, {"profile.coefficients": 2.0 * CAM.coefficients})
    assert "coefficients" not in said(scaled)


def test_arguments_of_constructors_are_replaced() -> None:
    """`p` of a pipe is that of all nodes, and no variable; the number of segments changes the start values, too."""
    np.testing.assert_array_equal(replace(PIPE, {"p": 2e6}).p, np.full(5, 2e6))
    np.testing.assert_array_equal(replace(PIPE, {"n": 2}).p, np.full(3, 1e6))
    changed = replace(PIPE, {"p_a": 3e6, "p_inner": 2e6, "p_b": 1e6})
    np.testing.assert_array_equal(jnp.broadcast_to(changed.p_inner, 3), np.full(3, 2e6))
    with pytest.raises(ParameterError, match=r"n determines p_inner, which was set since\. Set n first\."):
        replace(changed, {"n": 2})
    for fixed, name in ((translational.Fixed(s0=1.0), "s0"), (rotational.Fixed(phi0=1.0), "phi0")):
        for path in (name, f"place.{name}"):
            assert float(parameters(replace(fixed, {path: 2.0}))[f"place.{name}"]) == 2.0


def test_arguments_are_no_part_of_a_model() -> None:
    """A model that was built and one that went through jax or a file have one structure."""
    mass = translational.Mass(m=2.0, s=0.3)
    assert len(vars(mass)) == len(dataclasses.fields(mass))
    again = jax.tree_util.tree_map(lambda x: x, mass)
    assert jax.tree_util.tree_structure(again) == jax.tree_util.tree_structure(mass)
    for copy in (pickle.loads(pickle.dumps(mass)), pickle.loads(pickle.dumps(again))):
        assert parameters(copy) == parameters(mass)


def test_a_traced_model_does_not_know_its_arguments() -> None:
    mass = translational.Fixed(s0=1.0)
    with pytest.raises(ModelError, match=r"s0: the constructor computes .* Replace it before"):
        jax.jit(lambda model: replace(model, {"s0": 2.0}))(mass)
    slope = jax.grad(lambda s0: parameters(replace(mass, {"s0": s0}))["place.s0"])(3.0)
    assert float(slope) == 1.0


@pytest.mark.thorough
def test_a_run_of_traced_parameters_tells() -> None:
    def result(stroke: Any) -> Any:
        rig = replace(STOPPED, {"stop.s_min": stroke})
        return simulate(rig, 1e-3, save="end", throw=False).result == Result.bad_parameter

    assert bool(jax.jit(result)(1e-3))
