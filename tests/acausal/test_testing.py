"""Checks of single components find what is wrong with them, and nothing else."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    AcausalError,
    Array,
    Component,
    Connections,
    Discrete,
    Energy,
    Equations,
    Events,
    Flow,
    ModelError,
    Param,
    Port,
    Scalar,
    UnknownNameError,
    Var,
    connect,
    eq,
    nonnegative,
    positive,
    repeat,
    when,
)
from acausal.testing import (
    CheckFailed,
    check_component,
    check_gradients,
    check_law,
    check_power_balance,
    check_units,
    solved,
)
from components.electrical import Capacitor, Inductor, Pin, Resistor, TwoPin
from components.hydraulic import Orifice
from components.rotational import ElastoBacklash, Flange, Inertia, SpringDamper, StribeckFriction, ToGround


class Fan(ToGround):
    k: Param[Scalar, "N.m.s2/rad2", nonnegative]

    def torque(self) -> Scalar:
        return self.k * self.w * jnp.abs(self.w)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drag=eq(self.flange.tau, self.torque()))

    def energy(self) -> Energy:
        return Energy(dissipated=self.torque() * self.w)


def test_a_right_component_passes() -> None:
    check_component(Fan(k=1e-3), given={"w": [-20.0, 0.0, 30.0]}, expected={"flange.tau": [-0.4, 0.0, 0.9]})


class ForgetfulFan(ToGround):
    """Its account lacks a factor."""

    k: Param[Scalar, "N.m.s2/rad2", nonnegative]

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drag=eq(self.flange.tau, self.k * self.w * jnp.abs(self.w)))

    def energy(self) -> Energy:
        return Energy(dissipated=0.5 * self.k * self.w**2 * jnp.abs(self.w))


class DrivingFan(ToGround):
    """A wrong sign, in the account as well."""

    k: Param[Scalar, "N.m.s2/rad2", nonnegative]

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drag=eq(self.flange.tau, -self.k * self.w * jnp.abs(self.w)))

    def energy(self) -> Energy:
        return Energy(dissipated=-self.k * self.w**2 * jnp.abs(self.w))


class WrongUnits(ToGround):
    k: Param[Scalar, "N.m.s2/rad2", nonnegative]

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(drag=eq(self.flange.tau, self.k * self.w))

    def energy(self) -> Energy:
        return Energy(dissipated=self.flange.tau * self.w)


@jax.custom_jvp
def square(x: Scalar) -> Scalar:
    return x * x


@square.defjvp
def _(primals: Any, tangents: Any) -> Any:
    return square(*primals), primals[0] * tangents[0]


def half(x: Scalar) -> Scalar:
    """x / 2, whose derivative is right in forward mode only."""
    return jax.lax.custom_linear_solve(lambda y: 2.0 * y, x, lambda _, b: b / 2.0, lambda _, b: b / 3.0)


class Law(TwoPin):
    """v = R f(i)."""

    R: Param[Scalar, "ohm"]
    kind: str

    def equations(self, d: Self) -> Equations:
        match self.kind:
            case "wrong rule":
                law = square(self.i)
            case "reverse":
                law = half(self.i)
            case _:
                law = jnp.sqrt(jnp.abs(self.i))
        return super().equations(d) | dict(law=eq(self.v, self.R * law, check_units=False))


@pytest.mark.parametrize(
    ("check", "component", "message"),
    [
        (check_power_balance, ForgetfulFan(k=1e-3), r"not the rate of stored 0 W \+ dissipated .*k = 0.001.*Remedy"),
        (check_power_balance, DrivingFan(k=1e-3), r"It dissipates -[\d.]+ W, at k = 0.001.*declare generated power"),
        (check_units, WrongUnits(k=1e-3), "equation drag: equates self.flange.tau in N.m"),
        (check_gradients, Law(R=2.0, kind="wrong rule"), "derivative of law is .* in forward mode, .* by differences"),
        (check_gradients, Law(R=2.0, kind="reverse"), "in forward and reverse mode differ"),
        (check_gradients, Law(R=2.0, kind="root"), "derivative of law is not finite at the start values"),
    ],
)
def test_each_mistake_is_found_by_its_check_and_by_all(check: Any, component: Component, message: str) -> None:
    for one in (check, check_component):
        with pytest.raises(CheckFailed, match=rf"(?s)^{type(component).__name__}: \d problems? found\.\n.*{message}"):
            one(component)


def test_a_failed_check_is_an_assertion_and_an_error_of_the_library() -> None:
    assert issubclass(CheckFailed, AssertionError)
    assert issubclass(CheckFailed, AcausalError)


def test_a_wrong_law_is_told_with_its_case() -> None:
    with pytest.raises(CheckFailed, match=r"flange.tau is 0.9, not 1, where w = 30\.$"):
        check_law(Fan(k=1e-3), {"w": [20.0, 30.0]}, {"flange.tau": [0.4, 1.0]})


def test_laws_with_derivatives_and_arrays_of_cases() -> None:
    check_law(Inductor(L=2.0), {"der(i)": [1.0, 3.0]}, {"v": [2.0, 6.0]})
    check_law(Capacitor(C=0.5), {"der(i)": 2.0}, {"der(v, 2)": 4.0})
    found = solved(Resistor(R=2.0), {"i": np.ones((2, 3)), "n.v": 1.0})
    np.testing.assert_allclose(found["p.v"], np.full((2, 3), 3.0))


def test_laws_in_the_modes_that_the_values_imply() -> None:
    """A play of 0.6 about 0.1, and sliding friction either way."""
    backlash = ElastoBacklash(c=1000.0, d=0.0, play=0.6, phi_rel0=0.1)
    check_law(backlash, {"phi_rel": [0.5, 0.3, -0.3], "w_rel": 0.0}, {"tau": [100.0, 0.0, -100.0]}, atol=1e-9)
    bearing = StribeckFriction(Tc=0.4, Ts=0.6, ws=0.5, C=0.7)
    check_law(bearing, {"w": [50.0, -50.0], "acceleration": 0.0}, {"tau": [35.4, -35.4]})


class Fuse(TwoPin):
    """It conducts until its current exceeds the limit."""

    limit: Param[Scalar, "A", positive]
    R: Param[Scalar, "ohm", positive] = 0.1
    burst: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq((1.0 - self.burst) * self.v, self.R * self.i))

    def events(self) -> Events:
        return dict(burst=when(self.i > self.limit, burst=1.0))


def test_laws_in_given_modes() -> None:
    """A discrete variable can be given and expected, as far as events do not change it."""
    fuse = Fuse(limit=10.0)
    check_law(fuse, {"v": 0.5, "burst": [0.0, 1.0]}, {"i": [5.0, 0.0], "burst": [0.0, 1.0]}, atol=1e-9)
    check_law(fuse, {"v": [0.5, 2.0]}, {"i": [5.0, 0.0], "burst": [0.0, 1.0]}, atol=1e-9)
    with pytest.raises(CheckFailed, match=r"An event sets burst to 1 for v = 2, burst = 0\."):
        solved(fuse, {"v": [0.5, 2.0], "burst": 0.0})
    with pytest.raises(UnknownNameError, match="limit of Fuse is a parameter, not a variable: set it in the component"):
        solved(fuse, {"v": 0.5, "limit": 1.0})


def test_what_does_not_follow_is_missing() -> None:
    assert "v" not in solved(Inductor(L=2.0), {"i": 1.0})
    with pytest.raises(CheckFailed, match="v does not follow from i: give more"):
        check_law(Inductor(L=2.0), {"i": 1.0}, {"v": 1.0})
    with pytest.raises(CheckFailed, match="u is not a variable"):
        check_law(Inductor(L=2.0), {"i": 1.0}, {"u": 1.0})


def test_given_values_that_cannot_be() -> None:
    with pytest.raises(UnknownNameError, match=r"Inductor has no variable 'der\(j\)'\. Did you mean"):
        solved(Inductor(L=2.0), {"der(j)": 1.0})
    with pytest.raises(CheckFailed, match=r"Its equations have no solution for v = 1, i = 1"):
        solved(Resistor(R=2.0), {"v": 1.0, "i": [0.5, 1.0]})


class Contradiction(TwoPin):
    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(one=eq(self.v**2, -1.0, check_units=False))


def test_equations_that_cannot_be_met() -> None:
    with pytest.raises(CheckFailed, match=r"near only 0 of 8 random points\. Remedy: .*contradict"):
        check_component(Contradiction())


class Tube(Port):
    p: Var[Scalar, "Pa"] = 0.0
    m_flow: Flow[Scalar, "kg/s"] = 0.0


class Plug(Component):
    tube: Tube = Tube()

    def equations(self, d: Self) -> Equations:
        return dict(closed=eq(self.tube.m_flow))


def test_a_port_has_to_state_its_power() -> None:
    check_units(Plug())
    with pytest.raises(ModelError, match=r"Tube does not state its power\. Remedy: .*def power\(self, d\)"):
        check_power_balance(Plug())


class Chain(Component):
    """An array of parts between ports, and one part alone."""

    rotors: Array[Inertia]
    shafts: Array[SpringDamper]
    filter: Resistor
    a: Flange = Flange()
    p: Pin = Pin()
    n: Pin = Pin()

    def connections(self) -> Connections:
        return (
            connect(self.a, self.rotors[0].a),
            connect(self.rotors[:-1].b, self.shafts[:].a),
            connect(self.shafts[:].b, self.rotors[1:].a),
            connect(self.p, self.filter.p),
            connect(self.n, self.filter.n),
        )


@pytest.mark.thorough
def test_composites_and_arrays() -> None:
    shafts = repeat(SpringDamper(c=jnp.array([1.0, 2.0]), d=0.3), 2)
    check_component(
        Chain(rotors=repeat(Inertia(J=jnp.array([0.5, 1.0, 2.0])), 3), shafts=shafts, filter=Resistor(R=2.0))
    )


def test_sizes_of_real_parts() -> None:
    """Nominal sizes of variables and numbers of real parts, far from one."""
    orifice = Orifice(area=1e-6, density=850.0, discharge_coefficient=0.7, transition_pressure=1e3)
    flow = 0.7e-6 * np.sqrt(2e6 / 850.0)
    check_component(orifice, given={"dp": [1e6, -1e6]}, expected={"q": [flow, -flow]}, rtol=1e-3)
