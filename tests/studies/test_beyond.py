"""`python -m studies beyond`."""

import dataclasses
import json
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, replace, simulate
from acausal.design import Normal, Tolerance
from components.catalogues import brushed_motor
from components.electrical import BrushedMotor, ConstantCurrent, Ground
from components.hydraulic import dot_4
from components.rotational import Fixed
from components.thermal import FixedTemperature
from studies.__main__ import main
from studies.beyond import ITEMS, _load, _passages, _series, _temperature
from studies.beyond._cycles import COLD, Cycle
from studies.beyond._prototypes import PROTOTYPES
from studies.beyond._row import Row


def test_closed_clutch_rests_on_its_cushion_and_the_worn_one_is_the_stronger() -> None:
    travel, loads = _load.curves()
    for name in (_load.NEW, _load.WORN):
        assert loads[name][0] == pytest.approx(0.0, abs=1e-6)
        assert np.all(np.diff(loads[name])[:5] > 0.0)
    assert np.max(loads[_load.WORN]) > np.max(loads[_load.NEW])
    # Beyond the cushion, the load is that of the spring at the fingers divided by the fork ratio.
    one = _load.mechanism(_load.WEAR)
    deflection = _load.ENGAGED - _load.WEAR + travel[-1] / _load.FORK / float(_load.SPRING.lever)
    force = float(_load.SPRING.force(jnp.asarray(deflection)) / _load.SPRING.lever) / _load.FORK
    assert float(_load.slave_load(one, jnp.asarray(travel[-1]))) == pytest.approx(force)


@pytest.mark.thorough
def test_drop_of_the_passages_by_hand() -> None:
    flow, liquid = 3e-5, dot_4(293.15)
    housing = _passages.housing(flow, liquid)
    state: Any = simulate(housing, 1.0, save="end").final
    density, nu = float(liquid.reference_density), float(liquid.kinematic_viscosity(0.0))
    area = 0.25 * np.pi * _passages.DIAMETER**2
    sections = [_passages.SECTIONS[name] for name in ("pump", "valve", "outlet")]
    length, corners = (sum(column) for column in zip(*sections, strict=True))
    laminar = 128.0 * density * nu * length * flow / (np.pi * _passages.DIAMETER**4)
    assert float(state.drop) == pytest.approx(laminar + 0.6 * corners * density * (flow / area) ** 2)


@pytest.mark.thorough
def test_diameters_of_the_lightest_housing_are_in_balance() -> None:
    """At the optimum, a gram more in any passage of the pressure side reduces the pressure drop equally."""
    found = _passages.lightest(3e-5)
    assert found.status == "optimal"
    assert found.kkt_residual < 1e-7
    price = []
    for name in ("pump", "valve", "outlet"):
        step, place = 1e-7, f"{name}.diameter"
        ends = []
        for sign in (1.0, -1.0):
            changed = replace(found.model, {place: found.values[place] + sign * step})
            ends.append((float(changed.mass), float(simulate(changed, 1.0, save="end").final.drop)))
        (mass, drop), (less, more) = ends
        price.append((mass - less) / (more - drop))
    assert price == pytest.approx([found.multipliers["drop"]] * 3, rel=1e-4)


@pytest.mark.thorough
def test_halving_a_tolerance_takes_three_quarters_of_its_share() -> None:
    def spread(first: float) -> Any:
        distributions = {"pump.diameter": Normal(std=f"{first} %"), "valve.diameter": Normal(std="1 %")}
        study = Tolerance(_passages.housing(3e-5, dot_4(293.15)), distributions, {"mass": lambda m: m.mass})
        return study.first_order()["mass"]

    gains = _series.tightened(spread(2.0))
    assert spread(2.0).std - spread(1.0).std == pytest.approx(gains["pump.diameter"], rel=1e-9)


class Held(Component):
    """A motor at standstill with a constant current."""

    source: ConstantCurrent
    motor: BrushedMotor
    ambient: FixedTemperature
    ground: Ground = Ground()
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.motor.p),
            connect(self.source.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.wall.flange),
            connect(self.motor.ambient, self.ambient.port),
        )


AMBIENT = 353.15  # K


def cycle(**changes: float) -> Cycle:
    motor = brushed_motor("148867", L=None, T=AMBIENT)
    return dataclasses.replace(Cycle(motor, AMBIENT, opening=0.3, burst=60.0, current=20.0, hold=1.0), **changes)


@pytest.mark.thorough
def test_winding_warms_as_that_of_the_component() -> None:
    held = cycle(burst=0.0, hold=10.0)
    model = Held(
        source=ConstantCurrent(I=-held.current), motor=held.motor, ambient=FixedTemperature(temperature=AMBIENT)
    )
    final = simulate(model, held.hold, save="end", rtol=1e-9).final
    assert held.warmest(COLD) == pytest.approx(float(final.motor.winding.T), rel=1e-8)


def test_operations_that_are_allowed_just_reach_the_limit() -> None:
    """In the periodic steady state at the allowed rate; later at a higher rate; at once with too long a hold."""
    one, limit = cycle(), 428.15
    period = one.shortest_period(limit)
    assert one.peak(period) == pytest.approx(limit, abs=1e-6)
    state, warmest, whole = COLD, [], one.whole(period)
    for _ in range(2000):
        warmest.append(one.warmest(state))
        state = whole @ state
    assert warmest[-1] == pytest.approx(limit, abs=1e-6)
    assert np.all(np.diff(warmest) > -1e-9)
    assert one.time_to(limit, 1.01 * period) == np.inf
    assert 10.0 * period < one.time_to(limit, 0.9 * period) < 1e4
    assert one.time_to(limit, 0.5 * period) < one.time_to(limit, 0.9 * period)
    assert cycle(hold=20.0).shortest_period(limit) == np.inf
    cool = cycle(current=0.0, burst=1.0)
    assert cool.shortest_period(limit) == cool.shortest


@pytest.mark.thorough
@pytest.mark.parametrize("name", _temperature.ORDERS)
def test_heat_that_leaves_the_motor(name: str) -> None:
    """Without a hold, the winding hardly swings: the allowed heat is that of the thermal resistances at its limit."""
    ambient = 298.15
    one = _temperature.allowed(name, ambient, 0.0)
    motor = one.cycle.motor
    passed = (one.limit - ambient) / float(1.0 / motor.inside.G + 1.0 / motor.outside.G)
    assert one.per_minute / 60.0 * one.heat < passed
    assert one.per_minute / 60.0 * one.heat == pytest.approx(passed, rel=0.02)


@pytest.mark.parametrize("name", _temperature.ORDERS)
def test_heat_of_a_hold(name: str) -> None:
    """A longer hold adds R i^2 of the winding at its limit, and fewer operations are allowed."""
    short, long = (_temperature.allowed(name, 298.15, hold) for hold in (0.0, 1.0))
    motor = long.cycle.motor
    resistance = float(motor.resistor.R_ref * (1.0 + motor.resistor.alpha * (long.limit - motor.resistor.T_ref)))
    assert long.heat - short.heat == pytest.approx(resistance * long.cycle.current**2, rel=1e-3)
    assert long.per_minute < short.per_minute


@pytest.mark.slow
def test_rows_and_report(tmp_path: Any) -> None:
    main(["beyond", "--json", str(tmp_path / "rows.json"), "--out", str(tmp_path)])
    rows = [Row(**row) for row in json.loads((tmp_path / "rows.json").read_text())["rows"]]
    assert {row.item for row in rows} == set(ITEMS)
    found = {(row.case, row.quantity): row.value for row in rows}
    opening = "opening time"
    # Each load is heavier than the one before.
    for name in PROTOTYPES:
        cases = (_load.RIG, _load.NEW, _load.WORN, _load.STIFF)
        assert np.all(np.diff([found[f"{name}, {case}", opening] for case in cases]) > 0.0)
    # The inertia of the liquid matters less than its friction.
    spring, friction, whole = (found[f"EHS, RE40, 2 m, {what}", opening] for what in (
        "spring", "spring and friction", "spring, friction and inertia"
    ))  # fmt: skip
    assert abs(whole - friction) < 0.2 * (friction - spring)
    # Soft landings keep the speed limit and take longer.
    for name in ("EMA, FISE", "EMA, RE50", "EHS, RE40"):
        assert found[f"{name}, soft", "speed of arrival"] <= 5e-3 * (1.0 + 1e-6)
        assert found[f"{name}, soft", opening] > found[f"{name}, full voltage", opening]
    # A hot motor can open less often, and a valve relieves it of the hold.
    allowed = {case: value for (case, quantity), value in found.items() if quantity == "operations allowed"}
    assert allowed["EHS, RE40, 80 C, 1 s held by its motor"] < allowed["EHS, RE40, 25 C, 1 s held by its motor"]
    assert allowed["EHS, RE40, 80 C, 1 s held by its motor"] < allowed["EHS, RE40, 80 C, 1 s held by its valve"]
    assert allowed["EHS, RE40, 80 C, 10 s held by its motor"] == 0.0
    warm = found["EHS, RE40, 80 C, 10 s held by its motor", "winding after the first operation"]
    assert warm > 155.0  # degC, which the winding stands
    assert {row.unit for row in rows if row.quantity.startswith("winding")} == {"degC"}
    written = {path.name for path in tmp_path.iterdir()}
    assert {f"beyond_{name.replace(' ', '_')}.png" for name in ITEMS} | {"beyond.html"} <= written
