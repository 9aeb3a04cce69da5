"""Rope and tackle against closed forms."""

import math

import pytest

from acausal import Component, Connections, SimulationError, connect, initialise, replace, simulate
from acausal.testing import check_law
from components.translational import Fixed, Mass, Rope, Tackle
from docs._execute import DOCS, namespace


class Hanging(Component):
    """A load on a rope."""

    rope: Rope
    load: Mass
    top: Fixed = Fixed()

    def connections(self) -> Connections:
        return connect(self.top.flange, self.rope.b), connect(self.rope.a, self.load.a)


def test_a_rope_only_pulls() -> None:
    """EA x / length beyond its length, with limited damping; nothing while slack."""
    rope = Rope(EA=1e6, length=10.0, d=2e3)
    for place, speed, tension in (
        (10.02, 0.0, 2000.0),
        (10.02, 0.5, 3000.0),
        (10.02, -5.0, 0.0),
        (9.9, 1.0, 0.0),
    ):
        given = {"a.s": 0.0, "b.s": place, "der(a.s)": 0.0, "der(b.s)": speed}
        check_law(rope, given=given, expected={"f": tension, "a.f": -tension, "b.f": tension}, atol=1e-6)


def test_a_tackle_divides_the_force() -> None:
    check_law(Tackle(falls=4.0), given={"b.s": 0.5, "b.f": -8000.0}, expected={"a.s": 2.0, "a.f": 2000.0})


@pytest.mark.thorough
def test_a_slack_rope_needs_a_guess_to_start_at_rest() -> None:
    """A slack rope has no equilibrium: the error says what to guess. Then x = m g length/EA."""
    hanging = Hanging(rope=Rope(EA=1e6, length=10.0, d=1e3), load=Mass(m=500.0, incline=math.pi / 2))
    with pytest.raises(SimulationError, match=r"of rope would fire.*guess the variables.*the s_rel of a stretch"):
        initialise(hanging, steady=True)
    rest = initialise(replace(hanging, {"rope.s_rel": 10.01}), steady=True)
    assert float(rest.rope.s_rel) == pytest.approx(10.0 + 500.0 * 9.80665 * 10.0 / 1e6, rel=1e-9)


@pytest.mark.slow
def test_hoist_of_the_documentation() -> None:
    """At rest, the brake holds m g r/(falls ratio). If it stops the motor, the load flies on by v^2/2g."""
    with namespace(DOCS / "hoist.md", blocks=1) as page:
        hoist = page.hoist
        torque = 500.0 * 9.80665 * 0.1 / (2.0 * 20.0)
        sol = simulate(hoist, 6.0, energy=True)
        for place in (0, -1):
            assert abs(float(sol["brake.tau"][place])) == pytest.approx(torque, rel=1e-4)
        rise = float(sol["load.a.s"][-1] - sol["load.a.s"][0])
        assert rise == pytest.approx(200.0 * 3.2 * 0.1 / 20.0 / 2.0, rel=2e-3)
        lifted, work = 500.0 * 9.80665 * rise, float(sol.energy.supplied["supply"])
        assert lifted + float(sol.energy.dissipated["drive"]) == pytest.approx(work, rel=1e-4)
        assert abs(float(sol.energy.imbalance)) < 1e-6 * work
        failed = simulate(replace(hoist, {"release.width": 2.0}), 6.0, energy=True)
        stopped = failed.at(failed.events.of("stick").times[-1])
        assert float(stopped.rope.f) == pytest.approx(0.0, abs=1e-6)
        rise = failed.peak(lambda s: s.load.a.s).value - stopped.load.a.s
        assert float(rise) == pytest.approx(float(stopped.load.v) ** 2 / (2.0 * 9.80665), rel=1e-4)
        assert float(failed["brake.tau"][-1]) == pytest.approx(float(sol["brake.tau"][-1]), rel=1e-3)
