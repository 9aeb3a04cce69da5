"""Temperatures of nodes without heat capacity, and other variables with a declared range."""

from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Equations,
    ModelError,
    ParameterError,
    Result,
    Scalar,
    SimulationError,
    Var,
    check,
    connect,
    eq,
    positive,
    replace,
    simulate,
)
from components.electrical import ConstantVoltage, Ground, HeatingResistor
from components.thermal import (
    BodyRadiation,
    ConstantHeatFlow,
    FixedTemperature,
    HeatCapacitor,
    HeatPort,
    ThermalConductor,
)

STEFAN_BOLTZMANN = 5.670374419e-8


class HotWire(Component):
    """A wire that a voltage heats, cooled by conduction to a room."""

    source: ConstantVoltage
    wire: HeatingResistor
    path: ThermalConductor
    room: FixedTemperature
    ground: Ground

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.wire.p),
            connect(self.source.n, self.wire.n, self.ground.p),
            connect(self.wire.heat, self.path.a),
            connect(self.path.b, self.room.port),
        )


def hot_wire(V: Scalar = 10.0, R: Scalar = 1.0, alpha: Any = 3.9e-3, G: Any = 0.5, T: Scalar = 293.15) -> HotWire:
    return HotWire(
        source=ConstantVoltage(V=V),
        wire=HeatingResistor(R_ref=R, alpha=alpha),
        path=ThermalConductor(G=G),
        room=FixedTemperature(temperature=T),
        ground=Ground(),
    )


def wire_temperature(V: Scalar, R: Scalar, alpha: Any, G: Any, T: Scalar) -> Any:
    """G (x - T) R (1 + alpha (x - T_ref)) = V^2, the larger of its roots."""
    a, b, c = alpha, 1.0 + alpha * (T - 293.15), -(V**2) / (G * R)
    return T + (-b + jnp.sqrt(b**2 - 4.0 * a * c)) / (2.0 * a)


class Network(Component):
    """Places that links join, some of them at a fixed temperature or heated."""

    links: tuple[BodyRadiation | ThermalConductor, ...]
    sources: tuple[ConstantHeatFlow | FixedTemperature, ...]
    ends: tuple[tuple[int, int], ...]  # of the links
    places: tuple[int, ...]  # of the sources

    def connections(self) -> Connections:
        sets: dict[int, list[HeatPort]] = {}
        for link, (a, b) in zip(self.links, self.ends, strict=True):
            sets.setdefault(a, []).append(link.a)
            sets.setdefault(b, []).append(link.b)
        for source, place in zip(self.sources, self.places, strict=True):
            sets.setdefault(place, []).append(source.port)
        return tuple(connect(*ports) for ports in sets.values() if len(ports) > 1)


def random_network(seed: int, share_of_conductors: float) -> Network:
    """A connected graph with a fixed temperature, perhaps that of space, at place 0, and heat at others."""
    random = np.random.default_rng(seed)
    n = int(random.integers(3, 7))
    ends = [(int(random.integers(0, i)), i) for i in range(1, n)]
    ends += [(int(a), int(b)) for a, b in random.integers(0, n, (2, 2)) if a != b]
    links = tuple(
        ThermalConductor(G=10.0 ** random.uniform(-1, 1))
        if random.uniform() < share_of_conductors
        else BodyRadiation(Gr=10.0 ** random.uniform(-3, 0))
        for _ in ends
    )
    heated = range(1, n)
    sink = FixedTemperature(temperature=float(random.choice([1e-3, 4.0, 300.0])))
    sources = (sink, *(ConstantHeatFlow(heat_flow=10.0 ** random.uniform(-1, 3)) for _ in heated))
    return Network(links=links, sources=sources, ends=tuple(ends), places=(0, *heated))


@pytest.mark.parametrize("seed", range(6))
def test_random_wires(seed: int) -> None:
    random = np.random.default_rng(seed)
    V, R, alpha, G = (10.0 ** random.uniform([-1, -2, -4, -2], [3, 2, -2, 2])).tolist()
    T = random.uniform(4.0, 1000.0)
    model = hot_wire(V, R, alpha, G, T)
    assert check(model)
    solution = simulate(model, 1.0, save="end")
    np.testing.assert_allclose(solution.final.wire.heat.T, wire_temperature(V, R, alpha, G, T), rtol=1e-8)
    assert solution.final.wire.i > 0


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(3))
def test_random_networks_of_radiation(seed: int) -> None:
    network = random_network(seed, 0.0)
    n = len(network.places)
    laplacian, heat = np.zeros((n, n)), np.zeros(n)
    for link, (a, b) in zip(network.links, network.ends, strict=True):
        assert isinstance(link, BodyRadiation)
        laplacian[np.ix_([a, b], [a, b])] += float(link.Gr) * STEFAN_BOLTZMANN * np.array([[1.0, -1.0], [-1.0, 1.0]])
    sink, *sources = network.sources
    assert isinstance(sink, FixedTemperature)
    for place, source in zip(network.places[1:], sources, strict=True):
        assert isinstance(source, ConstantHeatFlow)
        heat[place] = float(source.heat_flow)
    fourth = np.linalg.solve(laplacian[1:, 1:], heat[1:]) + float(sink.temperature) ** 4
    final: Any = simulate(network, 1.0, save="end").final
    np.testing.assert_allclose([source.port.T for source in final.sources[1:]], fourth**0.25, rtol=1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(3, 5))
def test_random_networks_of_conduction_and_radiation(seed: int) -> None:
    network = random_network(seed, 0.5)
    final: Any = simulate(network, 1.0, save="end").final
    balance = np.zeros(len(network.places))
    for link, (a, b) in zip(final.links, network.ends, strict=True):
        assert min(link.a.T, link.b.T) >= 0
        flow = link.Gr * STEFAN_BOLTZMANN * (link.a.T**4 - link.b.T**4) if hasattr(link, "Gr") else (
            link.G * (link.a.T - link.b.T)
        )  # fmt: skip
        balance[a] += flow
        balance[b] -= flow
    for place, source in zip(network.places[1:], final.sources[1:], strict=True):
        balance[place] -= source.heat_flow
    largest = max(float(source.heat_flow) for source in final.sources[1:])
    np.testing.assert_allclose(balance[1:], 0.0, atol=1e-8 * largest)


@pytest.mark.thorough
def test_gradients_and_batches_of_wires() -> None:
    def found(V: Scalar) -> Scalar:
        return simulate(hot_wire(V=V), 1.0, save="end", throw=False).final.wire.heat.T

    def stated(V: Scalar) -> Scalar:
        return wire_temperature(V, 1.0, 3.9e-3, 0.5, 293.15)

    voltages = jnp.array([0.1, 3.0, 50.0])
    np.testing.assert_allclose(jax.jit(jax.vmap(found))(voltages), stated(voltages), rtol=1e-8)
    np.testing.assert_allclose(jax.jvp(found, (10.0,), (1.0,))[1], jax.grad(stated)(10.0), rtol=1e-7)
    np.testing.assert_allclose(jax.grad(found)(10.0), jax.grad(stated)(10.0), rtol=1e-7)


class Cooled(Component):
    """Heat is taken from a place that conducts or radiates to a room."""

    link: ThermalConductor | BodyRadiation
    taken: ConstantHeatFlow
    room: FixedTemperature

    def connections(self) -> Connections:
        return (connect(self.link.a, self.taken.port), connect(self.link.b, self.room.port))


@pytest.mark.thorough
@pytest.mark.parametrize("link", [ThermalConductor(G=1.0), BodyRadiation(Gr=1.0)])
def test_no_temperature_below_zero(link: ThermalConductor | BodyRadiation) -> None:
    """Neither where one equation determines it, nor where iterations do."""
    model = Cooled(link=link, taken=ConstantHeatFlow(heat_flow=-1e3), room=FixedTemperature(temperature=300.0))
    named = r"T must be positive \(unit K\)"
    with pytest.raises(SimulationError, match=named):
        simulate(model, 1.0)
    assert any("T must be positive (unit K)" in problem for problem in check(model).problems)
    assert simulate(model, 1.0, throw=False).result == Result.not_finite


class Drained(Component):
    """A body that loses heat at a constant rate, as no real one does near absolute zero."""

    body: HeatCapacitor
    drain: ConstantHeatFlow

    def connections(self) -> Connections:
        return (connect(self.body.port, self.drain.port),)


def test_a_run_ends_where_a_state_leaves_its_range() -> None:
    model = Drained(body=HeatCapacitor(C=1.0, T=300.0), drain=ConstantHeatFlow(heat_flow=-100.0))
    np.testing.assert_allclose(simulate(model, 2.0).final.body.T, 100.0)
    with pytest.raises(SimulationError, match=r"body.T must be positive \(unit K\)"):
        simulate(model, 4.0)


@pytest.mark.thorough
def test_start_values_outside_their_range_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"HeatCapacitor.T must be positive and finite, got -5.0 K"):
        HeatCapacitor(C=1.0, T=-5.0)
    fine = Drained(body=HeatCapacitor(C=1.0, T=300.0), drain=ConstantHeatFlow(heat_flow=-100.0))
    model = eqx.tree_at(lambda m: m.body.T, fine, -5.0)
    with pytest.raises(ParameterError, match=r"body.T must be positive and finite, but starts from -5.0 K"):
        simulate(model, 1.0)
    assert "body.T must be positive" in str(check(model))

    def result(T: Scalar) -> Scalar:
        return simulate(eqx.tree_at(lambda m: m.body.T, fine, T), 1.0, throw=False).result == Result.bad_parameter

    np.testing.assert_array_equal(jax.jit(jax.vmap(result))(jnp.array([-5.0, 300.0])), [True, False])


class Warm(Component):
    """A body whose class and whose port declare different start values."""

    T: Var[Scalar, "K"] = 350.0
    port: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(temperature=eq(self.T, self.port.T), heating=eq(d.T, self.port.Q_flow, check_units=False))


def test_a_component_says_where_to_start_before_a_port_does() -> None:
    assert simulate(Warm(), 1.0)["T"][0] == 350.0


class Mirrored(Component):
    """x = -y, with two roots y of one law; only one gives x > 0: 3."""

    x: Var[Scalar, "", positive] = 1.5
    y: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(mirror=eq(self.y, -self.x), law=eq(self.y**2 + 2.0 * self.y, 3.0))


@pytest.mark.thorough
def test_ranges_hold_for_aliases_of_other_sign() -> None:
    np.testing.assert_allclose(simulate(Mirrored(), 1.0).final.x, 3.0, rtol=1e-9)
    with pytest.raises(SimulationError, match="x must be positive"):
        simulate(replace(Mirrored(), {"x": 0.5}), 1.0)


@pytest.mark.thorough
def test_a_class_starts_in_its_own_range() -> None:
    with pytest.raises(ModelError, match=r"Cold.T must be positive, but starts from 0"):

        class Cold(Component):  # pyright: ignore[reportUnusedClass]
            T: Var[Scalar, "K", positive]
