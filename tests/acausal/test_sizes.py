"""Nominal sizes of single variables: a model in other units is as accurate as before."""

import pickle
from collections.abc import Callable, Mapping
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _sized_models import circuit, shaft

from acausal import (
    Array,
    Component,
    Connections,
    Equations,
    ModelError,
    Nominal,
    Param,
    ParameterError,
    Scalar,
    Var,
    choose_states,
    connect,
    eq,
    positive,
    quantity,
    repeat,
    replace,
    simulate,
    sized,
)
from acausal._evaluate.building import build
from components.electrical import ConstantVoltage, Ground, Pin, Resistor
from components.rotational import Damper, Fixed, Inertia, SpeedSensor

TIMES = jnp.linspace(0.0, 5.0, 11)


def run(model: Component, nominal: Mapping[str, float] | None = None) -> Any:
    return simulate(model, 5.0, save=TIMES, nominal=nominal)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(3))
def test_circuits_in_any_unit(seed: int) -> None:
    random = np.random.default_rng(seed)
    R, L, C = random.uniform(0.3, 2.0, 3).tolist()
    volt, ampere = (10.0 ** random.integers([-9, -9], [10, 10])).tolist()
    plain = run(circuit(R=R, L=L, C=C))
    scaled = run(circuit(volt, ampere, R, L, C), {"c.v": volt, "l.i": ampere})
    np.testing.assert_allclose(scaled["c.v"] / volt, plain["c.v"], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(scaled["r.i"] / ampere, plain["r.i"], rtol=1e-9, atol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(2))
def test_shafts_in_any_unit(seed: int) -> None:
    random = np.random.default_rng(seed)
    J, c, d = random.uniform(0.3, 2.0, 3).tolist()
    torque, angle = (10.0 ** random.integers([-9, -9], [10, 10])).tolist()
    plain = run(shaft(J=J, c=c, d=d))
    nominal = {"rotor.w": 10.0 * angle, "damper.phi_rel": angle, "drive.flange.tau": torque}
    scaled = run(shaft(torque, angle, J, c, d), nominal)
    np.testing.assert_allclose(scaled["rotor.w"] / angle, plain["rotor.w"], rtol=1e-9, atol=1e-12)


@pytest.mark.thorough
def test_a_slow_shaft_has_three_digits_at_the_default_tolerance() -> None:
    model = shaft(torque=1e-3, angle=1e-3)
    final = simulate(model, 5.0, save="end", nominal={"rotor.w": 1e-3, "damper.phi_rel": 1e-3}).final
    damping = 0.1
    frequency = np.sqrt(1.0 - damping**2)
    exact = 1e-3 * np.exp(-damping * 5.0) * np.sin(frequency * 5.0) / frequency
    np.testing.assert_allclose(final.rotor.w, exact, rtol=1e-3)


class Law(Component):
    """A conductor with i = I sinh(v / V)."""

    V: Param[Scalar, "V", positive]
    I: Param[Scalar, "A", positive]  # noqa: E741
    p: Pin = Pin()
    n: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        law = self.I * jnp.sinh((self.p.v - self.n.v) / self.V)
        return dict(law=eq(self.p.i, law), balance=eq(self.p.i + self.n.i))


class Loop(Component):
    """Two such conductors and a resistor, without a state: the voltages between them are found by iteration."""

    source: ConstantVoltage
    laws: tuple[Law, ...]
    r: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        first, second = self.laws
        return (
            connect(self.source.p, first.p),
            connect(first.n, self.r.p, second.p),
            connect(self.r.n, second.n, self.source.n, self.ground.p),
        )


@pytest.mark.thorough
@pytest.mark.parametrize(("volt", "ampere"), [(1e-8, 1e6), (1e7, 1e-9)])
def test_iterations_in_any_unit(volt: float, ampere: float) -> None:
    def loop(volt: float, ampere: float) -> Loop:
        laws = (Law(V=0.3 * volt, I=2.0 * ampere), Law(V=0.7 * volt, I=0.1 * ampere))
        return Loop(source=ConstantVoltage(V=volt), laws=laws, r=Resistor(R=3.0 * volt / ampere))

    nominal = {"laws[0].n.v": volt, "r.v": volt, "source.i": ampere, "r.i": ampere, "laws[1].p.i": ampere}
    found = simulate(loop(volt, ampere), 1.0, nominal=nominal).final.r.v / volt
    np.testing.assert_allclose(found, simulate(loop(1.0, 1.0), 1.0).final.r.v, rtol=1e-8)


@pytest.mark.thorough
def test_under_jit_and_vmap_and_for_gradients() -> None:
    nominal = {"c.v": 1e-5, "l.i": 1e-5}

    def voltage(volt: Scalar) -> Scalar:
        return simulate(circuit(volt, 1e-5), 5.0, save="end", nominal=nominal).final.c.v

    volts = jnp.array([1e-5, 3e-5])
    values = jax.jit(jax.vmap(voltage))(volts)
    plain = run(circuit()).final.c.v
    np.testing.assert_allclose(values[0], 1e-5 * plain, rtol=1e-6)
    step = 1e-8
    difference = (voltage(1e-5 + step) - voltage(1e-5 - step)) / (2.0 * step)
    np.testing.assert_allclose(jax.grad(voltage)(1e-5), difference, rtol=1e-4)
    np.testing.assert_allclose(jax.jvp(voltage, (1e-5,), (1.0,))[1], jax.grad(voltage)(1e-5), rtol=1e-9)


def sizes(model: Component) -> dict[str, float]:
    """The nominal sizes of the states, by name."""
    system = build(model)
    return dict(zip(system.state_names, system.nominals.tolist(), strict=True))


class Big(Component):
    """A charge whose class declares a size of its voltage."""

    v: Var[Scalar, "V", Nominal(7.0)] = 0.0
    p: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(voltage=eq(self.v, self.p.v), law=eq(d.v, self.p.i, check_units=False))


class Charged(Component):
    """One such charge and a resistor to ground."""

    big: Big
    r: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (connect(self.big.p, self.r.p), connect(self.r.n, self.ground.p))


def charged(**given: Any) -> Charged:
    return Charged(big=Big(**given), r=Resistor(R=1.0))


def test_which_size_counts() -> None:
    """The sizes of an outer component take precedence over those of an inner one, and these over those of a class."""
    assert sizes(charged()) == {"big.v": 7.0}
    assert sizes(charged(nominal=dict(v=2.0))) == {"big.v": 2.0}
    assert sizes(charged(nominal={"p.v": 2.0})) == {"big.v": 2.0}
    assert sizes(sized(charged(nominal=dict(v=2.0)), {"big.v": 3.0})) == {"big.v": 3.0}
    assert sizes(sized(charged(), {"r.p.v": quantity(4.0, "mV")})) == {"big.v": 4e-3}
    assert sizes(sized(sized(charged(), {"big.v": 3.0}), {"r.v": 5.0})) == {"big.v": 3.0}


class Chain(Component):
    """Inertias that springs join, and another one."""

    links: Array[Inertia] | tuple[Inertia, ...]
    others: tuple[Inertia, ...]

    def connections(self) -> Connections:
        return ()


@pytest.mark.parametrize("name", ["links.item.w", "links[2].w", "links[].w"])
def test_members_of_arrays_have_one_size(name: str) -> None:
    chain = Chain(links=repeat(Inertia(J=1.0), 3), others=(Inertia(J=1.0), Inertia(J=1.0)))
    found = sizes(sized(chain, {name: 2.0, "others[1].w": 3.0}))
    speeds = {path: size for path, size in found.items() if path.endswith(".w")}
    assert speeds == {**{f"links[{i}].w": 2.0 for i in range(3)}, "others[0].w": 10.0, "others[1].w": 3.0}


class Coupled(Component):
    """Two inertias that are joined rigidly, between a sensor and a damper to the wall."""

    one: Inertia
    other: Inertia
    sensor: SpeedSensor
    damper: Damper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.one.b, self.other.a, self.sensor.flange, self.damper.a),
            connect(self.damper.b, self.wall.flange),
        )


@pytest.mark.parametrize("name", ["one.w", "other.w", "sensor.y.value", "damper.w_rel"])
def test_a_size_holds_for_what_is_the_same_derivative(name: str) -> None:
    """Whichever of the speeds along a shaft is a state, or the derivative of an angle; the smallest one counts."""
    coupled = Coupled(one=Inertia(J=1.0), other=Inertia(J=1.0), sensor=SpeedSensor(), damper=Damper(d=1.0))
    assert sizes(coupled)["one.w"] == 10.0
    assert sizes(sized(coupled, {name: 1e-6}))["one.w"] == 1e-6
    assert sizes(sized(coupled, {"one.w": 1e-4, name: 1e-6}))["one.w"] == 1e-6


def test_components_that_differ_in_sizes_only_share_their_equations() -> None:
    parts = (Inertia(J=1.0), Inertia(J=1.0, nominal=dict(w=1e-3)))
    system = build(Chain(links=(), others=parts))
    assert [instances.total for instances in system.flat.instances] == [2]


def test_models_with_sizes_are_models() -> None:
    model = sized(circuit(), {"c.v": 1e-5})
    assert sizes(pickle.loads(pickle.dumps(model)))["c.v"] == 1e-5
    assert sizes(replace(model, {"r.R": 3.0, "c.v": 0.1}))["c.v"] == 1e-5
    assert sizes(jax.tree_util.tree_map(lambda x: x, model)) == sizes(model)
    assert simulate(model, 1.0, system=choose_states(model)).system.nominals.tolist() == list(sizes(model).values())
    with pytest.raises(ModelError, match=r"nominal sizes of .* differ .* make it again"):
        simulate(circuit(), 1.0, nominal={"c.v": 1e-5}, system=choose_states(circuit()))


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        (lambda: sized(circuit(), {"c.w": 1.0}), ModelError, r"no variable 'c\.w'\. Did you mean c\.v"),
        (lambda: simulate(circuit(), 1.0, nominal={"r.R": 1.0}), ModelError, r"no variable 'r\.R'"),
        (lambda: Resistor(R=1.0, nominal=dict(V=1.0)), ModelError, "no variable 'V'"),
        (lambda: Resistor(R=1.0, nominal=dict(v=-1.0)), ModelError, r"size of v must be a positive number \(unit V\)"),
        (lambda: Resistor(R=1.0, nominal=dict(v=np.inf)), ModelError, "size of v must be a positive number"),
        (lambda: Resistor(R=1.0, nominal=dict(v="one")), ParameterError, r"must be a real number, .*, got 'one'"),
        (lambda: Resistor(R=1.0, nominal=1.0), ModelError, "is not a dictionary of sizes by name"),  # pyright: ignore[reportArgumentType]
        (lambda: Resistor(R=1.0, nominal=dict(v=quantity(1.0, "A"))), ParameterError, "v is in V"),
        (lambda: jax.jit(lambda v: sized(circuit(), {"c.v": v}).r.R)(1.0), ModelError, "must be a plain number"),
    ],
)  # fmt: skip
def test_wrong_sizes(wrong: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        wrong()
