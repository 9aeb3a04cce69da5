"""The vector field against equations written by hand."""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import RC, Chain, oscillator, rc, rectifier
from _reading import rates
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from acausal import Array as Parts
from acausal import Component, Connections, Equations, Scalar, Var, connect, eq, repeat, simulate, stack
from acausal._evaluate.building import system_of
from acausal._evaluate.plan import joined
from components.electrical import Capacitor, ConstantVoltage, DCMotor, Ground, Resistor
from components.rotational import Inertia, Spring


class Bridge(Component):
    """Wheatstone's bridge with a capacitor for a galvanometer, behind a resistor: a linear block for the voltages."""

    source: ConstantVoltage
    inner: Resistor
    arms: tuple[Resistor, Resistor, Resistor, Resistor]
    c: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        a, b, c, d = self.arms
        return (
            connect(self.source.p, self.inner.p),
            connect(self.inner.n, a.p, b.p),
            connect(a.n, c.p, self.c.p),
            connect(b.n, d.p, self.c.n),
            connect(c.n, d.n, self.source.n, self.ground.p),
        )


ARMS = (3.0, 5.0, 7.0, 2.0)


def bridge() -> Bridge:
    a, b, c, d = (Resistor(R=R) for R in ARMS)
    return Bridge(source=ConstantVoltage(V=12.0), inner=Resistor(R=1.5), arms=(a, b, c, d), c=Capacitor(C=0.1))


def bridge_rates(x: dict[str, Any]) -> dict[str, Any]:
    """Node voltages top, left, right and the capacitor's current, from Kirchhoff's laws as one matrix."""
    a, b, c, d = ARMS
    matrix = np.array(
        [
            [1 / 1.5 + 1 / a + 1 / b, -1 / a, -1 / b, 0.0],
            [-1 / a, 1 / a + 1 / c, 0.0, 1.0],
            [-1 / b, 0.0, 1 / b + 1 / d, -1.0],
            [0.0, 1.0, -1.0, 0.0],
        ]
    )
    current = np.linalg.solve(matrix, [12.0 / 1.5, 0.0, 0.0, x["c.v"]])[3]
    return {"c.v": current / 0.1}


class Drive(Component):
    source: ConstantVoltage
    motor: DCMotor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return connect(self.source.p, self.motor.p), connect(self.source.n, self.motor.n, self.ground.p)


def drive() -> Drive:
    return Drive(source=ConstantVoltage(V=12.0), motor=DCMotor(R=0.5, L=2e-3, k=0.04, J=3e-4, friction=1e-3))


def drive_rates(x: dict[str, Any]) -> dict[str, Any]:
    i, w = x["motor.inductor.i"], x["motor.rotor.w"]
    (angle,) = set(x) - {"motor.inductor.i", "motor.rotor.w"}
    return {
        "motor.inductor.i": (12.0 - 0.5 * i - 0.04 * w) / 2e-3,
        "motor.rotor.w": (0.04 * i - 1e-3 * w) / 3e-4,
        angle: w,
    }


def oscillator_rates(x: dict[str, Any]) -> dict[str, Any]:
    (position,) = set(x) - {"mass.v"}
    return {"mass.v": (-50.0 * x[position] - 4.0 * x["mass.v"]) / 2.0, position: x["mass.v"]}


def rectifier_rates(x: dict[str, Any]) -> dict[str, Any]:
    """The diode's voltage by bracketing: the current through the resistor is the diode's."""
    over = 5.0 - x["c.v"]
    excess = lambda v: 1e-12 * np.expm1(v / 0.025) - (over - v) / 100.0  # noqa: E731
    v = float(brentq(excess, min(over, 0.0) - 1.0, 0.8, xtol=1e-15))  # pyright: ignore[reportArgumentType]
    return {"c.v": (over - v) / 100.0 / 1e-3}


class Case(NamedTuple):
    model: Callable[[], Component]
    by_hand: Callable[[dict[str, Any]], dict[str, Any]]
    kinds: set[str]  # of the simultaneous blocks


CASES = {
    "oscillator": Case(lambda: oscillator(m=2.0, c=50.0, d=4.0), oscillator_rates, set()),
    "drive": Case(drive, drive_rates, set()),
    "bridge": Case(bridge, bridge_rates, {"linear"}),
    "rectifier": Case(lambda: rectifier(5.0), rectifier_rates, {"nonlinear"}),
}


@pytest.mark.parametrize("name", CASES)
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3))
def test_vector_field(name: str, numbers: list[float]) -> None:
    model, by_hand, kinds = CASES[name].model(), CASES[name].by_hand, CASES[name].kinds
    system = system_of(model)
    assert {torn.method for torn in system.torn if torn.tears} == kinds
    states = dict(zip(system.state_names, numbers, strict=False))
    found, expected = rates(model, system, 0.0, states), by_hand(states)
    assert found.keys() == expected.keys()
    for state, rate in expected.items():
        np.testing.assert_allclose(found[state], rate, rtol=1e-9, atol=1e-9)


class Bank(Component):
    members: Parts[RC]


class Singles(Component):
    members: tuple[RC, ...]


@pytest.mark.thorough
def test_array_equals_singles_equals_closed_form() -> None:
    resistances = np.linspace(50.0, 150.0, 50)
    chargers = [rc(R=R) for R in resistances]
    array = simulate(Bank(members=stack(chargers)), 0.1, save="end", rtol=1e-10)
    singles = simulate(Singles(members=tuple(chargers)), 0.1, save="end", rtol=1e-10)
    expected = 5.0 * (1.0 - np.exp(-0.1 / (resistances * 1e-3)))
    np.testing.assert_allclose(array.final.members.item.c.v, expected, rtol=1e-8)
    np.testing.assert_allclose(np.array([member.c.v for member in singles.final.members]), expected, rtol=1e-8)
    np.testing.assert_allclose([float(array[f"members[{i}].c.i"][-1]) for i in (0, 17, 49)],
                               [float(singles[f"members[{i}].c.i"][-1]) for i in (0, 17, 49)], rtol=1e-12)  # fmt: skip


def traced_equations(n: int) -> int:
    """Operations in the vector field of a chain, those within calls and loops included."""
    model = Chain(masses=repeat(Inertia(J=2.0), n), springs=repeat(Spring(c=3.0), n - 1))
    system = system_of(model)
    size = len(system.nominals)
    assert size == 2 * n
    closed = jax.make_jaxpr(lambda y, inputs: system.vector_field(0.0, y, inputs))(jnp.zeros(size), system.pack(model))
    return count(closed.jaxpr)


def count(jaxpr: Any) -> int:
    inner = [getattr(value, "jaxpr", None) for eqn in jaxpr.eqns for value in eqn.params.values()]
    return len(jaxpr.eqns) + sum(count(part) for part in inner if part is not None and hasattr(part, "eqns"))


def test_the_program_does_not_grow_with_the_array() -> None:
    assert traced_equations(20) == traced_equations(200)


@pytest.mark.parametrize("sizes", [(), (1,), (1, 1), (1,) * 8, (1,) * 9, (2, 1)])
def test_parts_are_joined_in_their_order(sizes: tuple[int, ...]) -> None:
    ends = np.cumsum([0, *sizes])

    def parts(x: Any) -> list[Any]:
        return [x[a:b] for a, b in itertools.pairwise(ends)]

    x = jnp.arange(1.0, 1.0 + ends[-1]).at[-1:].set(jnp.nan)
    np.testing.assert_array_equal(joined(parts(x)), x)
    np.testing.assert_array_equal(jax.jacrev(lambda x: joined(parts(x)))(x), np.eye(len(x)))


def test_no_rate_is_computed_again_for_another() -> None:
    system = system_of(oscillator())
    inputs = system.pack(oscillator())
    program = jax.make_jaxpr(lambda y: system.vector_field(0.0, y, inputs))(jnp.ones(2))
    assert "concatenate" not in str(program)  # XLA computes the operands of a short one anew for each element


def test_chain_vector_field() -> None:
    n = 20
    model = Chain(masses=repeat(Inertia(J=2.0), n), springs=repeat(Spring(c=3.0), n - 1))
    system = system_of(model)
    y = np.random.default_rng(0).normal(size=2 * n)
    dy = np.asarray(system.vector_field(0.0, jnp.asarray(y), system.pack(model)))
    number = {name: i for i, name in enumerate(system.state_names)}
    speeds = [number[f"masses[{i}].w"] for i in range(n)]
    # What else is a state is the angle of each mass, under the name of one of its flanges, or differences of them.
    assert all(".phi" in name for name in system.state_names if not name.endswith(".w"))
    angles = [i for name, i in sorted(number.items(), key=lambda item: _index(item[0])) if not name.endswith(".w")]
    phi, w = y[angles], y[speeds]
    torque = 3.0 * np.diff(phi)
    np.testing.assert_allclose(dy[angles], w, rtol=1e-14)
    np.testing.assert_allclose(dy[speeds], (np.append(torque, 0.0) - np.append(0.0, torque)) / 2.0, rtol=1e-12)


def _index(name: str) -> int:
    return int(name.partition("[")[2].partition("]")[0])


class Constants(Component):
    """a + b = 3 and a - b = 1, beside a state: equations that read no parameter and no variable from outside."""

    a: Var[Scalar, "1"] = 0.0
    b: Var[Scalar, "1"] = 0.0
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(
            total=eq(self.a + self.b, 3.0), apart=eq(self.a - self.b, 1.0), decay=eq(d.x, -self.x, check_units=False)
        )


def test_a_block_of_constants() -> None:
    final = simulate(Constants(), 1.0, save="end", rtol=1e-9).final
    np.testing.assert_allclose(jnp.stack([final.a, final.b, final.x]), [2.0, 1.0, np.exp(-1.0)], rtol=1e-8)
