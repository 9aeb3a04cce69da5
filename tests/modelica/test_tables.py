"""Tables of the Modelica Standard Library: interpolation, extrapolation, time events."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import Component, Equations, ModelError, Scalar, Var, eq, structure
from acausal.modelica._translate.external import EXTERNAL
from acausal.modelica._translate.tables import Table1D, Table2D, TimeTable
from acausal.modelica._translate.tables.by_time import NEVER
from acausal.modelica._translate.tables.files import matrix
from acausal.modelica._translate.tables.kinds import CUBIC, Smoothness

SQUARES = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 4.0], [4.0, 16.0]])


def curve(table: np.ndarray = SQUARES, smoothness: int = 1, extrapolation: int = 2) -> Table1D:
    return Table1D.of(table, [2], smoothness, extrapolation)


def test_a_linear_table_holds_its_ends_or_continues_its_lines_or_repeats() -> None:
    assert curve().value(1, 3.0) == 10.0
    assert curve(extrapolation=1).value(1, 5.0) == 16.0
    assert curve(extrapolation=1).value(1, -1.0) == 0.0
    assert curve(extrapolation=2).value(1, 5.0) == 22.0
    assert curve(extrapolation=2).value(1, -1.0) == -1.0
    assert curve(extrapolation=3).value(1, 4.0) == 16.0
    assert curve(extrapolation=3).value(1, 4.5) == 0.5
    assert curve(extrapolation=3).value(1, -0.5) == 13.0


def test_a_table_without_extrapolation_has_no_value_outside() -> None:
    table = curve(extrapolation=4)
    with pytest.raises(ModelError, match="without extrapolation has no value at 5"):
        table.value(1, 5.0)
    assert jnp.isnan(table.value(1, jnp.asarray(5.0)))
    assert table.value(1, jnp.asarray(4.0)) == 16.0


def test_constant_segments_change_at_their_knots() -> None:
    table = curve(smoothness=3, extrapolation=1)
    assert [float(table.value(1, u)) for u in (-1.0, 0.9, 1.0, 3.9, 4.0, 9.0)] == [0.0, 0.0, 1.0, 4.0, 16.0, 16.0]


@pytest.mark.parametrize("smoothness", CUBIC)
def test_smooth_curves_pass_through_the_points_of_a_line(smoothness: Smoothness) -> None:
    line = curve(np.array([[0.0, 1.0], [0.5, 2.0], [2.0, 5.0], [3.0, 7.0]]), smoothness)
    assert_allclose([line.value(1, u) for u in (-1.0, 0.2, 1.0, 2.7, 4.0)], [-1.0, 1.4, 3.0, 6.4, 9.0])
    assert_allclose([curve(smoothness=smoothness).value(1, u) for u in SQUARES[:, 0]], SQUARES[:, 1])


@pytest.mark.parametrize("smoothness", [Smoothness.FRITSCH_BUTLAND, Smoothness.STEFFEN])
def test_monotone_curves_do_not_overshoot(smoothness: Smoothness) -> None:
    step = np.array([[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [3.0, 1.0]])
    values = np.array([curve(step, smoothness).value(1, u) for u in np.linspace(0.0, 3.0, 61)])
    assert np.all(np.diff(values) >= 0.0)


def test_akima_has_the_slopes_of_its_paper() -> None:
    """Between chords 1, 1, 3, 3 the slope is their mean."""
    table = curve(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 5.0], [4.0, 8.0]]), Smoothness.AKIMA)
    slope = jax.jit(jax.grad(lambda u: jnp.asarray(table.value(1, u))))(2.0)
    assert slope == 2.0
    assert EXTERNAL["ModelicaStandardTables_CombiTable1D_getDerValue"](table, 1, 0.5, 2.0) == 2.0


@pytest.mark.parametrize("smoothness", list(Smoothness))
def test_a_table_is_differentiable_by_its_data(smoothness: Smoothness) -> None:
    def value(data: jax.Array) -> jax.Array:
        return jnp.asarray(Table1D.of(data, [2], smoothness, 2).value(1, 1.5))

    data, direction = jnp.asarray(SQUARES) + 0.1, jnp.ones_like(SQUARES).at[:, 0].set(0.0)
    found, slope = jax.jit(jax.value_and_grad(value))(data)
    assert_allclose(found, curve(np.asarray(data), smoothness).value(1, 1.5))
    assert_allclose(jnp.sum(slope * direction), 1.0)  # all values rise together


GRID = np.array([[0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 1.0, 3.0], [2.0, 4.0, 6.0, 10.0]])  # 2 x + y + x y / 2


@pytest.mark.parametrize("smoothness", [1, 2])
def test_a_surface_reproduces_a_bilinear_function(smoothness: int) -> None:
    table = Table2D.of(GRID, smoothness, 2)
    traced = jax.jit(table.value)
    for x, y in ((0.5, 2.0), (2.0, 3.0), (3.0, 0.5), (-1.0, 5.0)):
        assert_allclose(table.value(x, y), 2.0 * x + y + 0.5 * x * y)
        assert_allclose(traced(x, y), 2.0 * x + y + 0.5 * x * y)
    slope, curvature = (EXTERNAL[f"ModelicaStandardTables_CombiTable2D_get{name}Value"] for name in ("Der", "Der2"))
    assert_allclose(slope(table, 1.0, 2.0, 1.0, 0.0), 3.0)
    assert_allclose(curvature(table, 1.0, 2.0, 1.0, 1.0, 0.0, 0.0), 1.0)
    assert_allclose(Table2D.of(GRID, smoothness, 1).value(3.0, -1.0), 4.0)


def test_a_surface_of_one_row_is_a_curve() -> None:
    table = Table2D.of(np.array([[0.0, 0.0, 1.0, 2.0], [7.0, 0.0, 1.0, 4.0]]), 2, 2)
    assert_allclose(table.value(99.0, 0.5), curve(SQUARES[:3], 2).value(1, 0.5))


def time_table(rows: list[list[float]], smoothness: int = 1, extrapolation: int = 1, **other: float) -> TimeTable:
    start = other.get("start", 0.0)
    shift, events = other.get("shift", start), other.get("events", 1)
    return TimeTable.of(np.array(rows), start, [2], smoothness, extrapolation, shift, events)


def events_of(table: TimeTable, count: int) -> list[float]:
    found, t, next_event = [], 0.0, jax.jit(table.next_event)
    for _ in range(count):
        t = float(next_event(t))
        found.append(t)
    return found


JUMP = [[0.0, 0.0], [1.0, 1.0], [1.0, 3.0], [2.0, 3.0]]


def test_the_events_of_a_table_are_its_knots_or_jumps_or_ends() -> None:
    assert events_of(time_table(JUMP), 3) == [1.0, 2.0, NEVER]
    assert events_of(time_table([[0.0, 0.0], [1.0, 1.0], [2.0, 3.0]], events=2), 2) == [2.0, NEVER]
    assert events_of(time_table(JUMP, events=2), 3) == [1.0, 2.0, NEVER]
    assert events_of(time_table(JUMP, events=3), 2) == [2.0, NEVER]
    assert_allclose(events_of(time_table(JUMP, extrapolation=3), 5), [1.0, 2.0, 3.0, 4.0, 5.0])
    assert_allclose(events_of(time_table(JUMP, start=0.5, shift=0.7), 4), [0.5, 0.7, 1.7, 2.7])
    assert_allclose(events_of(time_table([[k * 0.1, k % 7] for k in range(11)], extrapolation=3), 25)[-1], 2.5)


def test_the_next_event_tells_the_side_of_a_jump() -> None:
    table = time_table(JUMP)
    assert table.value(1, 1.0, 1.0) == 1.0
    assert table.value(1, 1.0, 2.0) == 3.0
    assert table.value(1, 1.0 - 1e-16, 2.0) == 3.0
    assert_allclose(table.value(1, 1.1, 1.0), 1.1)  # a step beyond the event sees no jump
    assert table.value(1, jnp.asarray(1.0), jnp.asarray(2.0)) == 3.0


@pytest.mark.parametrize("extrapolation", [1, 2, 3])
def test_a_table_of_time_does_not_jump_between_its_events(extrapolation: int) -> None:
    table = time_table(JUMP, extrapolation=extrapolation, events=2)

    class Signal(Component):
        following: Var[Scalar, "1"] = 1.0
        y: Var[Scalar, "1"] = 0.0

        def equations(self, d: Any) -> Equations:
            y = table.value(1, 0.5 * self.following, self.following)
            return dict(following=eq(d.following, 1.0, check_units=False), y=eq(self.y, y))

    structure(Signal())  # without a JumpWarning


def test_a_table_is_zero_before_its_start() -> None:
    table = time_table(JUMP, start=0.5, shift=0.0)
    assert table.value(1, 0.2, 0.5) == 0.0
    assert table.value(1, 0.5, 0.5) == 0.0
    assert table.value(1, 0.5, 1.0) == 0.5


def test_a_table_of_time_holds_or_continues_or_repeats() -> None:
    after = 3.0, NEVER
    ramp = [[0.0, 0.0], [1.0, 1.0], [2.0, 3.0]]
    assert time_table(ramp, extrapolation=1).value(1, *after) == 3.0
    assert time_table(ramp, extrapolation=2).value(1, *after) == 5.0
    assert np.isnan(time_table(ramp, extrapolation=4).value(1, *after))
    assert_allclose(time_table(ramp, extrapolation=3).value(1, 7.5, 8.0), 2.0)
    assert_allclose(time_table(ramp, extrapolation=1, shift=1.0).value(1, 0.5, 1.0), 0.0)
    assert_allclose(time_table(ramp, extrapolation=2, shift=1.0).value(1, 0.5, 1.0), -0.5)
    slope = EXTERNAL["ModelicaStandardTables_CombiTimeTable_getDerValue"]
    assert_allclose(slope(time_table(ramp, 1, 2), 1, 1.5, 2.0, 0.0, 3.0), 6.0)


def test_constant_segments_of_time_hold_until_the_event() -> None:
    table = time_table([[0.0, 1.0], [1.0, 2.0], [2.0, 5.0]], smoothness=3)
    assert [float(table.value(1, *at)) for at in ((0.5, 1.0), (1.1, 1.0), (1.0, 2.0), (2.0, NEVER))] == [1, 1, 2, 5]


def test_wrong_tables_are_refused() -> None:
    with pytest.raises(ModelError, match="abscissas of a table must be strictly increasing"):
        curve(np.array(JUMP))
    with pytest.raises(ModelError, match="times of a table must be increasing"):
        time_table([[1.0, 0.0], [0.0, 1.0]])
    with pytest.raises(ModelError, match="no monotone or modified cubics"):
        Table2D.of(GRID, 5, 1)
    with pytest.raises(ModelError, match=r"the columns \[3\] are not all in a table with 2 columns"):
        Table1D.of(SQUARES, [3], 1, 1)
    with pytest.raises(ModelError, match="positive period"):
        time_table([[1.0, 0.0], [1.0, 1.0]], extrapolation=3)


def test_tables_are_read_from_files(tmp_path) -> None:
    text = tmp_path / "t.txt"
    text.write_text("#1\ndouble a(1,2)\n7 8\ndouble b (2 2) # two rows\n 0 1 # first\n\n2\n 3\n")
    assert matrix(str(text), "b").tolist() == [[0.0, 1.0], [2.0, 3.0]]
    table = EXTERNAL["ModelicaStandardTables_CombiTable1D_init3"]("b", str(text), np.zeros((0, 2)), [2], 1)
    assert table.value(1, 1.0) == 2.0
    with pytest.raises(ModelError, match="has no table c"):
        matrix(str(text), "c")
    with pytest.raises(ModelError, match="does not exist"):
        matrix(str(tmp_path / "none.txt"), "c")
    (tmp_path / "t.csv").write_text("x;y\n1;2\n3;4\n")
    assert matrix(str(tmp_path / "t.csv"), "Values", ";", 1).tolist() == [[1.0, 2.0], [3.0, 4.0]]
