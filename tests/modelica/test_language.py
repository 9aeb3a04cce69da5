"""The elements of the Modelica language against closed forms: a few texts, each with many elements, are run once."""

from typing import Any

import numpy as np
import pytest

from acausal import ModelError, SimulationError, simulate
from acausal.modelica import load

TIMES = np.array([0.05, 0.3, 0.45, 0.55, 0.8, 0.95, 1.2])

CONTINUOUS = """
package P
  type Form = enumeration(linear, square, cubic);
  record Pair
    Real a;
    Real b;
  end Pair;
  function sums "Several results by a loop"
    input Real x[:];
    input Integer order = 2;
    output Real total;
    output Real powers;
  algorithm
    total := 0;
    powers := 0;
    for i in 1:size(x, 1) loop
      total := total + x[i];
      powers := powers + x[i]^order;
    end for;
  end sums;
  function root "The square root by a loop whose end is not known"
    input Real x;
    output Real y = 1;
  protected
    Real before = 0;
  algorithm
    while abs(y - before) > 1e-12 loop
      before := y;
      y := (y + x / y) / 2;
    end while;
  end root;
  model Continuous
    parameter Integer n = 3;
    parameter Boolean isFast = true;
    parameter Form form = Form.square;
    parameter Real k[n] = {1, 2, 3};
    parameter Pair gains(a = 2, b = 5);
    parameter Real A[2, 2] = [0, 1; -4, 0];
    Real x[n](start = k, each fixed = true) "decay";
    Real v[2](start = {1, 0}, each fixed = true) "oscillation";
    Real steps, triangle, plain, shaped, total, powers, rooted, last;
    Real mixed[2], T[2, 2], z[n - 1];
    Pair pair;
    Real s(start = 0), u;
    parameter Real found(fixed = false, start = 1) "by an initial equation";
    Real p, rest(start = 1), slope;
  equation
    der(p) = 1;
    der(rest) = found - 4 * rest;
    for i in 1:n loop
      der(x[i]) = -k[i] * x[i];
    end for;
    for i in 1:n - 1 loop
      z[i] = x[i + 1] - x[i];
    end for;
    der(v) = A * v;
    steps = if time < 0.5 then 1 elseif time < 0.9 then 2 else 3;
    triangle = smooth(0, if time < 0.5 then time else 1 - time);
    plain = noEvent(if time < 0.5 then time else 1 - time);
    if form == Form.linear then
      shaped = time;
    elseif form == Form.square then
      shaped = time^2;
    else
      shaped = time^3;
    end if;
    (total, powers) = sums({time, 2, 3});
    rooted = root(1 + time);
    mixed = T * {1, time} + {sum(k), max(k)};
    T = transpose([1, 2; 3, 4]) * (if isFast then 2 else 1);
    last = k[end] + size(A, 1) + scalar([time]) + sum(i^2 for i in 1:n);
    pair = Pair(gains.a * time, gains.b);
    der(s) = time;
    slope = der(sin(k[2] * time));
  initial equation
    s = gains.b - 4;
    p = 2;
    der(rest) = 0;
    found = (p + s) / 2;
  algorithm
    if time > 0.5 then
      u := time + 6;
    else
      u := time;
    end if;
  end Continuous;
end P;
"""


def test_equations_functions_arrays_and_records() -> None:
    t = TIMES
    sol: Any = simulate(load(CONTINUOUS, "P.Continuous"), 1.2, save=t)
    k = np.array([1.0, 2.0, 3.0])
    x = k * np.exp(-k * t[:, None])
    assert np.allclose(sol.x, x, rtol=1e-4)
    assert np.allclose(sol.z, x[:, 1:] - x[:, :-1], rtol=1e-3, atol=1e-4)
    assert np.allclose(sol.v, np.stack([np.cos(2 * t), -2 * np.sin(2 * t)], axis=1), atol=1e-4)
    assert np.allclose(sol.steps, np.select([t < 0.5, t < 0.9], [1, 2], 3))
    assert np.allclose(sol.triangle, np.minimum(t, 1 - t))
    assert np.allclose(sol.plain, np.minimum(t, 1 - t))
    assert np.allclose(sol.shaped, t**2)
    assert np.allclose(sol.total, t + 5)
    assert np.allclose(sol.powers, t**2 + 13)
    assert np.allclose(sol.rooted, np.sqrt(1 + t))
    assert np.allclose(sol.T[0], [[2, 6], [4, 8]])
    assert np.allclose(sol.mixed, np.stack([2 + 6 * t + 6, 4 + 8 * t + 3], axis=1))
    assert np.allclose(sol.last, 3 + 2 + t + 14)
    assert np.allclose(sol.pair.a, 2 * t)
    assert np.allclose(sol.pair.b, 5)
    assert np.allclose(sol.s, 1 + t**2 / 2, atol=1e-6)
    assert np.allclose(sol.slope, 2 * np.cos(2 * t))
    assert np.allclose(sol.p, 2 + t)
    assert np.allclose(sol.found, 1.5)
    assert np.allclose(sol.rest, 1.5 / 4)
    assert np.allclose(sol.u, t + 6 * (t > 0.5))


EVENTS = """
model Events
  function tell "has no result, as a message"
    input Real x;
  algorithm
    assert(x > 0, "x");
  end tell;
  parameter Real level = 0.5;
  Boolean high = time > level;
  Integer rises(start = 0, fixed = true), changes(start = 0, fixed = true), order(start = 0, fixed = true);
  Integer ticks(start = 0, fixed = true), begun(start = 7, fixed = true), turns(start = 0, fixed = true);
  discrete Real taken(start = -1, fixed = true), first(start = 0), second(start = 0), given;
  Real wave = sin(10 * time), saw(start = 0, fixed = true), held(start = 3, fixed = true);
equation
  when {edge(high), initial()} then
    rises = pre(rises) + 1;
  end when;
  when change(high) then
    changes = pre(changes) + 1;
  end when;
  when time > 0.9 then
    order = 2;
  elsewhen time > 0.4 then
    order = pre(order) + 1;
  end when;
  when sample(0.1, 0.25) then
    ticks = pre(ticks) + 1;
    taken = time;
  end when;
  when initial() then
    begun = 1;
  end when;
  when wave > 0.5 then
    turns = pre(turns) + 1;
  end when;
  der(saw) = 1;
  when saw >= 0.42 then
    reinit(saw, pre(saw) - 0.42);
  end when;
  der(held) = if pre(order) > 0 then 1 else 0;
initial algorithm
  given := 2;
  for i in 1:3 loop
    given := given * i;
  end for;
equation
  when time > 1 then
    given = pre(given) + 1;
    tell(time);
  end when;
algorithm
  when high then
    first := pre(first) + 1;
    second := 10 * first;
  elsewhen time > 1 then
    first := 5;
  end when;
end Events;
"""


def test_events() -> None:
    t = TIMES
    sol: Any = simulate(load(EVENTS, "Events"), 1.2, save=t)
    assert np.array_equal(sol.high, t > 0.5)
    assert np.array_equal(sol.rises, 1 + (t > 0.5))
    assert np.array_equal(sol.changes, t > 0.5)
    assert np.array_equal(sol.order, np.select([t > 0.9, t > 0.4], [2, 1], 0))
    assert np.array_equal(sol.ticks, np.floor((t - 0.1) / 0.25) + 1)
    assert np.allclose(sol.taken, np.where(t < 0.1, -1, 0.1 + 0.25 * np.floor((t - 0.1) / 0.25)))
    assert np.array_equal(sol.begun, np.ones(7))
    rises_of_wave = (np.arcsin(0.5) + 2 * np.pi * np.arange(3)) / 10
    assert np.array_equal(sol.turns, [np.sum(x > rises_of_wave) for x in t])
    assert np.allclose(sol.saw, t % 0.42, atol=1e-6)
    assert np.allclose(sol.held, 3 + np.maximum(t - 0.4, 0), atol=1e-6)
    assert np.array_equal(sol.given, 12 + (t > 1))
    assert np.array_equal(sol.first, np.select([t > 1, t > 0.5], [5, 1], 0))
    assert np.array_equal(sol.second, 10 * (t > 0.5))


BALL = """
model Ball
  parameter Real e = 0.7 "restitution";
  parameter Real g = 9.81;
  Real h(start = 1, fixed = true), v(start = 0, fixed = true);
  Boolean flying(start = true, fixed = true);
  Boolean impact = h <= 0;
equation
  der(h) = v;
  der(v) = if flying then -g else 0;
  when {impact, h <= 0 and v <= 0} then
    flying = edge(impact);
    reinit(v, -e * pre(v));
  end when;
end Ball;
"""


def test_a_bouncing_ball() -> None:
    t = np.array([0.2, 0.6, 1.2, 1.6])
    sol: Any = simulate(load(BALL, "Ball"), 1.6, save=t)
    g, e = 9.81, 0.7
    start, speed, height, expected = 0.0, 0.0, 1.0, []
    for x in t:
        while True:
            end = start + (speed + np.sqrt(speed**2 + 2 * g * height)) / g
            if end > x:
                break
            start, speed, height = end, -e * (speed - g * (end - start)), 0.0
        expected.append(height + speed * (x - start) - g * (x - start) ** 2 / 2)
    assert np.allclose(sol.h, expected, atol=1e-5)


GUARDED = """
model Guarded
  parameter Real top = 0.5;
  Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  assert(x < top, "x is above its top");
  assert(x < 0.1, "x is high", AssertionLevel.warning);
end Guarded;
"""


def test_a_violated_assertion_ends_a_run() -> None:
    with pytest.raises(SimulationError, match="x is above its top"):
        simulate(load(GUARDED, "Guarded"), 1.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("y = delay(x, x, 2.0);", "delay"),
        ("y = spatialDistribution(x, 0, 0.1, true);", "spatialDistribution"),
    ],
)
def test_what_is_not_supported_is_refused_by_name(line: str, message: str) -> None:
    text = f"""
    package P
      model Part Real x(start = 1, fixed = true), y; equation der(x) = 1; {line} end Part;
      model Whole Part part; end Whole;
    end P;"""
    with pytest.raises(ModelError, match=message) as caught:
        load(text, "P.Whole")
    assert "part" in str(caught.value) or message == "spatialDistribution"
