"""Rope and tackle against closed forms."""

from acausal.testing import check_law
from components.translational import Rope, Tackle


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
