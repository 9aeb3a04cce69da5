"""The synchronous language elements of Modelica, against sequences calculated by hand."""

from fractions import Fraction
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import ModelError, simulate
from acausal.modelica._frontend.flatten import flat_model
from acausal.modelica._translate.build import component
from acausal.modelica._translate.clock_inference import Base, Clock, Partitions


def model(text: str) -> Any:
    name = text.split()[1]
    return component(flat_model(text, name))


def run(text: str, times: Any, **changes: float) -> Any:
    made = model(text)
    return simulate(made, float(times[-1]), save=np.asarray(times))


RATES = """model Rates
  Integer n(start = 0), slow, late(start = -1), early, count(start = 10);
  Real fast, x, dt, u = time^2, held, back;
  Boolean first;
  Clock c = Clock(1, 10);
equation
  when c then
    n = previous(n) + 1;
    x = sample(u);
    dt = interval(n);
    first = firstTick(n);
    back = sample(held);
  end when;
  slow = subSample(n, 2);
  fast = superSample(x, 2);
  count = previous(count) + (if fast > -1 then 1 else 0);
  late = shiftSample(n, 1, 2);
  early = backSample(late, 1, 2);
  held = hold(late);
end Rates;
"""


def test_clocks_of_related_rates() -> None:
    t = np.arange(0.025, 0.5, 0.05)
    sol = run(RATES, t)
    tenths = np.repeat(np.arange(5), 2)
    halves = (np.arange(10) - 1) // 2
    assert np.array_equal(sol.n, tenths + 1)
    assert np.allclose(sol.x, (0.1 * tenths) ** 2, atol=1e-12)
    assert np.allclose(sol.dt, 0.1)
    assert np.array_equal(sol.first, tenths == 0)
    assert np.array_equal(sol.slow, 2 * (tenths // 2) + 1)
    assert np.allclose(sol.fast, sol.x)
    assert np.array_equal(sol.count, 11 + np.arange(10))
    assert np.array_equal(sol.late[1:], halves[1:] + 1)
    assert np.array_equal(sol.early, np.where(tenths == 0, -1, tenths))
    assert np.array_equal(sol.held, np.where(np.arange(10) == 0, -1, halves + 1))
    assert np.array_equal(sol.back, sol.early)  # the value just before the tick


JUMP = """model Jump
  Boolean step = time >= 0.2;
  Boolean seen;
  Real control, y(start = 3), passed, seen_at, z;
  Clock c = Clock(0.1);
equation
  seen = sample(step, c);
  passed = sample(time);
  seen_at = if seen then passed else 0;
  y = hold(control);
  z = sample(y);
  control = 2*z + 0*seen_at;
end Jump;
"""


def test_a_sample_is_the_value_just_before_the_tick() -> None:
    sol = run(JUMP, [0.05, 0.15, 0.25, 0.35])
    assert np.array_equal(sol.seen, [0, 0, 0, 1])
    assert np.allclose(sol.seen_at, [0, 0, 0, 0.3])


EVENTS = """model Events
  parameter Real level = 0.15;
  Real x(start = 0, fixed = true), hit, dt, other;
  Integer n(start = 0);
  Boolean b = x > level*(1 + hold(n));
  Clock c = Clock(b, 0.5);
equation
  der(x) = 1;
  when c then
    n = previous(n) + 1;
    hit = sample(time);
    dt = interval(n);
  end when;
  other = hold(hit);
end Events;
"""


def test_event_clocks() -> None:
    sol = run(EVENTS, [0.1, 0.2, 0.4, 0.5, 0.7])
    assert np.array_equal(sol.n[1:], [1, 2, 3, 4])
    assert np.allclose(sol.other, [0, 0.15, 0.3, 0.45, 0.6], atol=1e-9)
    assert np.allclose(sol.dt[1:], [0.5, 0.15, 0.15, 0.15], atol=1e-9)


CONTROL = """model Control
  parameter Real period = 0.5, k = 1, first = 3;
  Real x(start = 1, fixed = true), e, y, f[2], g[2](start = {1, 2}), h(start = first);
  Integer a(start = 3);
  Clock c = Clock(period);
equation
  der(x) = hold(y);
  e = sample(x, c);
  y = -k*e;
  f = {y, e};
  g = previous(g) + f;
  when Clock() then
    h = previous(h) + 1;
    if e > 0.9 then
      a = 5;
    else
      a = previous(a) + integer(8*e + 0.5);
    end if;
  end when;
end Control;
"""


def test_a_discrete_controller() -> None:
    t = np.array([0.25, 0.75, 1.25])
    made = model(CONTROL)
    sol = simulate(made, 1.25, save=t)
    assert np.allclose(sol.y, [-1, -0.5, -0.25], atol=1e-9)
    assert np.allclose(sol.x, [0.75, 0.375, 0.1875], atol=1e-9)
    assert np.allclose(sol.g, [[0, 3], [-0.5, 3.5], [-0.75, 3.75]], atol=1e-9)
    assert np.array_equal(sol.a, [5, 9, 11])
    assert np.array_equal(sol.h, [4, 5, 6])
    sol = simulate(eqx.tree_at(lambda m: (m.first, m.period), made, (jnp.asarray(0.0), jnp.asarray(1.0))), 1.25, save=t)
    assert np.array_equal(sol.h, [1, 1, 2])
    assert np.allclose(sol.y, [-1, -1, 0], atol=1e-9)


DECAY = """model Decay
  Clock c = Clock(Clock(1, 10), solverMethod = "{method}");
  Real x(start = 1), v[2](each start = 1), z;
equation
  z = sample(time, c);
  der(x) = 0 * z - x;
  der(v[1]) = 0 * z - v[1];
  der(v[2]) = 0 * z - 2 * v[2];
end Decay;
"""


@pytest.mark.parametrize(
    ("method", "factor"),
    [
        ("ImplicitEuler", lambda h: 1.0 / (1.0 + h)),
        pytest.param("ExplicitEuler", lambda h: 1.0 - h, marks=pytest.mark.thorough),
        pytest.param("ImplicitTrapezoid", lambda h: (1.0 - h / 2.0) / (1.0 + h / 2.0), marks=pytest.mark.thorough),
    ],
)
def test_methods_of_integration_of_clocked_equations(method: str, factor: Any) -> None:
    final = simulate(model(DECAY.format(method=method)), 0.25).final
    one, two = factor(0.1) ** 2, factor(0.2) ** 2
    np.testing.assert_allclose([final.x, *final.v], [one, one, two], atol=1e-12)


BASE = Clock(Base(0, None))


@pytest.mark.parametrize(
    ("given", "factor", "shift", "message"),
    [
        ({"u": BASE, "y": BASE}, 2, 0, "y has two different clocks"),
        ({"u": BASE}, None, 0, "factor of subSample cannot be inferred"),
        ({}, 2, 0, "u has no clock"),
        ({"u": BASE}, 1, -1, "y would tick before the start"),
        ({"u": BASE.later(Fraction(2), Fraction(0)), "y": BASE.later(Fraction(3), Fraction(0))}, None, 0, "no whole"),
    ],
)
def test_clocks_that_contradict_each_other(given: Any, factor: int | None, shift: int, message: str) -> None:
    clocks = Partitions()
    for name in ("u", "y"):
        clocks.mark(name)
        if name in given:
            clocks.give(name, given[name])
    clocks.relate("u", "y", None if factor is None else Fraction(factor), Fraction(shift), "subSample")
    with pytest.raises(ModelError, match=message):
        clocks.solve()
