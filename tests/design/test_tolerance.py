"""Scatter of results: each method against closed forms, members that fail, worst cases and yields."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rigs import Rig, rig
from scipy.stats import binomtest, chi2, norm

from acausal import (
    Component,
    ModelError,
    Param,
    ParameterError,
    Scalar,
    SimulationError,
    UnknownNameError,
    parameters,
    quantity,
    simulate,
)
from acausal._units.display import Scale
from acausal.design import Normal, Samples, Spread, Tolerance, Triangular, Uniform, percentile_of, sensitivities
from studies.actuators import ema_maxon

C, D = "link.c", "link.d"


def linear(model: Rig) -> Any:
    return 2.0 * model.link.c + 10.0 * model.link.d


def squares(model: Rig) -> Any:
    return (model.link.c - 40.0) ** 2 + (model.link.c - 40.0) * (model.link.d - 1.5)


def study(result: Any = linear, distributions: Any = None, **options: Any) -> Tolerance[Rig]:
    given = {C: Normal(std=2.0), D: Uniform(1.2, 1.8)} if distributions is None else distributions
    return Tolerance(rig(), given, {"y": result}, **options)


def test_first_order_is_exact_for_a_linear_result() -> None:
    found = study().first_order()["y"]
    variances = np.array([(2.0 * 2.0) ** 2, (10.0 * 0.6) ** 2 / 12.0])
    assert found.mean == pytest.approx(95.0, rel=1e-12)
    assert found.std == pytest.approx(np.sqrt(variances.sum()), rel=1e-12)
    np.testing.assert_allclose(list(found.shares.values()), variances / variances.sum(), rtol=1e-12)
    assert found.percentile(95.0) == pytest.approx(norm.ppf(0.95, 95.0, found.std), rel=1e-12)


def test_correlated_parameters() -> None:
    """Two normal parameters whose sum is certain."""
    both = {C: Normal(std=2.0), D: Normal(std=0.4)}
    found = study(distributions=both, correlation={(C, D): -0.999999}).first_order()["y"]
    assert found.std == pytest.approx(np.sqrt(16.0 + 16.0 - 2 * 0.999999 * 16.0), rel=1e-6)
    sampled = study(distributions=both, correlation={(C, D): 0.8}).members(
        np.random.default_rng(1).normal(size=(4000, 2))
    )
    assert np.corrcoef(sampled.parameters.T)[0, 1] == pytest.approx(0.8, abs=0.02)


def test_second_order_is_exact_for_squares() -> None:
    """x^2 + x y of independent normal x and y: mean 4, variance 2 * 4^2 + 4 * 0.16."""
    found = study(squares, {C: Normal(std=2.0), D: Normal(std=0.4)}).second_order()["y"]
    assert found.mean == pytest.approx(4.0, rel=1e-9)
    assert found.std == pytest.approx(np.sqrt(2 * 16.0 + 4.0 * 0.16), rel=1e-3)
    pure = study(lambda m: (m.link.c - 40.0) ** 2, {C: Normal(std=2.0)}).second_order()["y"]
    np.testing.assert_allclose(pure.percentile([5.0, 50.0, 95.0]), 4.0 * chi2.ppf([0.05, 0.5, 0.95], 1), rtol=2e-3)


def test_samples_agree_with_the_closed_form() -> None:
    exact = study().first_order()["y"]
    drawn, even = study().monte_carlo(4000, seed=3)["y"], study().sobol_sequence(4096)["y"]
    assert abs(drawn.mean - exact.mean) < 4.0 * drawn.std_error
    assert drawn.std_error == pytest.approx(exact.std / np.sqrt(4000), rel=0.05)
    assert even.mean == pytest.approx(exact.mean, rel=1e-5)
    assert even.std == pytest.approx(exact.std, rel=1e-2)
    assert drawn.failed == {}
    inside = drawn.share(high=100.0)
    assert inside.low < norm.cdf(100.0, exact.mean, exact.std) + 0.01
    assert inside.low < inside.share < inside.high


@pytest.mark.parametrize(
    ("distribution", "mean", "std", "box"),
    [
        (Normal(std="5 %"), 40.0, 2.0, (34.0, 46.0)),
        (Normal(mean="50 N/m", std=quantity(0.01, "N/mm")), 50.0, 10.0, (20.0, 80.0)),
        (Uniform("-10 %", "+20 %"), 42.0, 12.0 / np.sqrt(12.0), (36.0, 48.0)),
        (Triangular(30.0, 60.0), 130.0 / 3.0, np.sqrt(700.0 / 18.0), (30.0, 60.0)),
        (Samples([35.0, 45.0, 40.0, 40.0]), 40.0, np.sqrt(50.0 / 3.0), (35.0, 45.0)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_distributions(distribution: Any, mean: float, std: float, box: tuple[float, float]) -> None:
    one = study(lambda m: m.link.c, {C: distribution})
    (found,) = one.distributions
    assert (found.mean, found.std) == pytest.approx((mean, std), rel=1e-12)
    assert found.box(3.0) == pytest.approx(box, rel=1e-12)
    scores = norm.ppf((np.arange(20000) + 0.5) / 20000)[:, None]
    values = one.parameters_at(scores)[:, 0]
    assert np.mean(values) == pytest.approx(mean, rel=1e-4)
    if not isinstance(distribution, Samples):  # which is linear between its values
        assert np.std(values) == pytest.approx(std, rel=1e-3)
        assert np.all(np.diff(values) > 0.0)


def test_sobol_indices_of_ishigami() -> None:
    """sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1 on (-pi, pi): closed form of Ishigami and Homma (1990)."""

    def ishigami(model: Rig) -> Any:
        x, y, z = model.link.c - 10.0, model.link.d - 10.0, model.mass.m - 10.0
        return jnp.sin(x) + 7.0 * jnp.sin(y) ** 2 + 0.1 * z**4 * jnp.sin(x)

    even = Uniform(10.0 - np.pi, 10.0 + np.pi)
    found = study(ishigami, {C: even, D: even, "mass.m": even}).indices(4096)
    v1, v2 = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 49.0 / 8.0
    v13 = 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    total = v1 + v2 + v13
    np.testing.assert_allclose(found.first[0], np.array([v1, v2, 0.0]) / total, atol=0.02)
    np.testing.assert_allclose(found.total[0], np.array([v1 + v13, v2, v13]) / total, atol=0.02)
    assert np.all(np.abs(found.first[0] - np.array([v1, v2, 0.0]) / total) < 5.0 * found.first_error[0] + 1e-3)
    assert "link.c" in str(found)


def test_worst_case_in_a_corner_and_within() -> None:
    corner = study().worst_case("y")
    assert (corner.low, corner.high) == pytest.approx((2 * 34 + 12, 2 * 46 + 18), rel=1e-9)
    assert corner.at_high == pytest.approx({C: 46.0, D: 1.8})
    assert corner.units == ("N/m", "N.s/m")
    assert str(corner).splitlines()[1].split() == ["link.c", "0.034", "0.046", "N/mm"]
    inner = study(lambda m: (m.link.c - 41.0) ** 2, {C: Uniform(30.0, 50.0)}).worst_case()
    assert inner.low == pytest.approx(0.0, abs=1e-9)
    assert inner.at_low[C] == pytest.approx(41.0, abs=1e-4)
    assert inner.high == pytest.approx(121.0, rel=1e-9)


def first_passage(model: Rig) -> Any:
    return simulate(model, 0.3, until=lambda s: s.link.s_rel, save="end", rtol=1e-8, throw=False)


@pytest.mark.thorough
def test_failed_members_keep_their_code_and_are_counted() -> None:
    """A soft spring does not bring the mass through zero in time: a quarter of a period is 0.25 s at 40 N/m."""
    soft = Tolerance(rig(), {C: Uniform(20.0, 60.0)}, {"time": (lambda s: s.t1, "ms")}, run=first_passage)
    scores = norm.ppf((np.arange(80) + 0.5) / 80)[:, None]
    members = soft.members(scores)
    c = members.parameters[:, 0]
    lost = ~members.outcomes.are_good
    assert 0 < np.sum(lost) < 40
    assert np.max(c[lost]) < np.min(c[~lost])  # those of soft springs
    assert members.outcomes.failed == {"never_stopped": int(np.sum(lost))}
    found = soft.monte_carlo(80, scores=scores)["time"]
    assert found.failed == members.outcomes.failed
    assert found.share(high="1 s").share == pytest.approx(1.0 - np.mean(lost), rel=1e-12)
    assert "never_stopped" in str(found)
    none = Tolerance(rig(c=2.0), {C: Uniform(1.0, 3.0)}, lambda s: s.t1, run=first_passage)
    with pytest.raises(SimulationError, match=r"Fewer than two of 8 members could be computed: never_stopped \(8\)"):
        none.monte_carlo(8)
    with pytest.raises(SimulationError, match="cannot be computed with the means"):
        none.first_order()


def test_a_percentile_as_a_function_of_the_design() -> None:
    """The 90th percentile of 2 c + 10 d about any c: its gradient is that of the result, as the scatter stays."""
    high = percentile_of(rig(), {C: Normal(std=2.0), D: Uniform(1.2, 1.8)}, linear, 90.0, n=512)
    exact = study().sobol_sequence(512)["y"].percentile(90.0)
    assert float(high(rig())) == pytest.approx(exact, rel=1e-9)
    slopes = parameters(eqx.filter_grad(high)(rig()))
    assert float(slopes[C]) == pytest.approx(2.0, rel=1e-9)
    relative = percentile_of(rig(), {C: Normal(std="5 %")}, lambda m: m.link.c, 90.0, n=64)
    ratio = float(relative(rig(c=80.0))) / float(relative(rig()))
    assert ratio == pytest.approx(2.0, rel=1e-9)
    assert float(jax.jit(relative)(rig())) == pytest.approx(float(relative(rig())), rel=1e-12)


def test_sensitivities_of_all_parameters() -> None:
    table = sensitivities(rig(), lambda m: jnp.sqrt(m.link.c / m.mass.m))
    assert [row.parameter for row in table.rows[:2]] == [C, "mass.m"] or table.rows[0].parameter == "mass.m"
    assert table[C].relative == pytest.approx(0.5, rel=1e-12)
    assert table["mass.m"].relative == pytest.approx(-0.5, rel=1e-12)
    assert table[C].per_unit == pytest.approx(0.5 / np.sqrt(40.0), rel=1e-12)
    assert table[C].unit == "N/m"
    assert table[D].per_unit == 0.0
    with pytest.raises(UnknownNameError, match=r"no sensitivity to 'link.k'"):
        table["link.k"]
    both = sensitivities(rig(), {"y": (linear, "kN"), "z": squares})
    assert set(both) == {"y", "z"}
    assert "change [kN per unit]" in str(both["y"])
    with pytest.raises(SimulationError, match="There are no sensitivities"):
        sensitivities(rig(), lambda m: jnp.log(-m.link.c))


def test_pictures_and_tables() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    drawn = study().monte_carlo(100)
    assert drawn["y"].plot(limits=[100.0]).get_xlabel() == "y"
    panel = study((linear, "ms")).first_order()["y"].plot()
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("y [ms]", "density per ms")
    assert study().first_order()["y"].plot().get_title().startswith("first order")
    assert study().indices(16).plot().get_xlabel() == "share of the variance of y"
    assert sensitivities(rig(), linear).plot().get_xlabel().startswith("change of result in %")
    plt.close("all")
    assert "Monte Carlo" in str(drawn)
    assert "worst case of y" in str(study().worst_case("y"))


@pytest.mark.thorough
def test_the_actuator_against_an_independent_program() -> None:
    """Opening time of the RE50 actuator with ten normal parameters: gradient, spread and members of a given seed.

    The figures are those of a collocation method (Radau IIA, five stages) with derivatives by complex steps.
    """
    paths = {
        "motor.resistor.R": (5.0, 0.2223809761875959), "motor.bearing.C": (10.0, 9.040414985310164),
        "motor.emf.k": (3.0, -0.6584291913917413), "clutch.rate": (4.0, 5.376557550028129e-07),
        "supply.V": (2.0, -0.008302364401137201), "cam.profile.eccentricity": (1.0, -10.6448387344514),
        "master.bore": (0.2, -6.338971577536441), "motor.rotor.J": (5.0, 34.4313613622812),
        "line.damping": (20.0, -2.1649557277498673e-17), "line.stiffness": (10.0, -3.919702753451612e-18),
    }  # fmt: skip

    def run(model: Any) -> Any:
        return simulate(model, 5.0, until=lambda s: s.slave.rod.s - 12e-3, save="end", rtol=1e-10)

    model = ema_maxon(rotor_inertia=56e-6, gearbox_inertia=0.0)
    normal = {path: Normal(std=f"{share} %") for path, (share, _) in paths.items()}
    actuator = Tolerance(model, normal, {"time": (lambda s: s.t1, "ms")}, run=run)
    found = actuator.first_order()["time"]
    assert found.mean == pytest.approx(0.08345388161637354, abs=1e-11)
    assert found.std == pytest.approx(0.005696868163112444, rel=1e-8)
    slopes = [slope for _, slope in paths.values()]
    np.testing.assert_allclose(actuator._derivatives[1][0], slopes, rtol=1e-6)
    scores = np.random.default_rng(4711).standard_normal((2000, 10))[:5]
    times = actuator.members(scores).outcomes.values[:, 0]
    expected = [0.08515001486966149, 0.08577940068738288, 0.0740675342001458, 0.08821993013830044, 0.08690054462801407]
    np.testing.assert_allclose(times, expected, rtol=1e-10)


BAD: dict[str, tuple[Any, type[Exception], str]] = {
    "no spread": (
        lambda: study(distributions={C: Normal()}),
        ParameterError,
        "link.c: Normal needs a standard deviation",
    ),
    "spread of zero": (
        lambda: study(distributions={C: Normal(std=0.0)}),
        ParameterError,
        "must be positive and finite",
    ),
    "limits crossed": (lambda: study(distributions={C: Uniform(2.0, 1.0)}), ParameterError, "must be below the upper"),
    "mode outside": (
        lambda: study(distributions={C: Triangular(1.0, 2.0)}),
        ParameterError,
        "the mode 0.04 N/mm is outside the bounds 0.001 to 0.002 N/mm",
    ),
    "one sample": (lambda: study(distributions={C: Samples([1.0])}), ParameterError, "at least two different finite"),
    "not a number": (
        lambda: study(distributions={C: Samples([1.0, np.nan])}),
        ParameterError,
        "at least two different",
    ),
    "other unit": (lambda: study(distributions={C: Uniform("1 m", "2 m")}), ParameterError, "link.c is in N/m"),
    "no distribution": (lambda: study(distributions={C: 2.0}), ModelError, "give a distribution"),
    "unknown path": (
        lambda: study(distributions={"link.k": Normal(std=1.0)}),
        ModelError,
        "no parameter or start value",
    ),
    "unknown pair": (lambda: study(correlation={(C, "mass.m"): 0.5}), ModelError, "'mass.m' has a correlation but"),
    "no pair": (lambda: study(correlation={(C, C): 0.5}), ModelError, "pairs of different parameters"),
    "impossible": (lambda: study(correlation={(C, D): 1.5}), ParameterError, "contradict one another"),
    "dependent": (lambda: study(correlation={(C, D): 0.5}).indices(8), ModelError, "independent parameters"),
    "too few": (lambda: study().monte_carlo(1), ParameterError, "an integer of at least 2, got 1"),
    "no column": (
        lambda: study().monte_carlo(scores=np.zeros((5, 3))),
        ModelError,
        "a column for each of 2 parameters",
    ),
    "no limit": (lambda: study().first_order()["y"].share(), ModelError, "A yield needs a limit"),
    "no percentile": (lambda: study().first_order()["y"].percentile(120), ParameterError, "between 0 and 100"),
    "no result": (lambda: study().worst_case("z"), UnknownNameError, "There is no result 'z'"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case: str) -> None:
    make, error, text = BAD[case]
    with pytest.raises(error, match=text):
        make()


def test_a_limit_has_the_unit_of_the_result() -> None:
    timed = Tolerance(rig(), {C: Uniform(30.0, 50.0)}, {"time": (lambda m: 1.0 / m.link.c, "ms")})
    found: Spread = timed.monte_carlo(200)["time"]
    assert (
        found.share(high="25 ms").share == found.share(high=0.025).share == found.share(high=quantity(0.025, "s")).share
    )
    with pytest.raises(ParameterError, match="time is in"):
        found.share(high="25 mm")


@pytest.mark.parametrize(("inside", "failed"), [(0, 0), (3, 0), (17, 0), (20, 0), (17, 5)])
def test_a_yield_has_the_interval_of_wilson(inside: int, failed: int) -> None:
    lost = {"failed": failed} if failed else {}
    spread = Spread("y", Scale(), "Monte Carlo", 0.0, 1.0, np.arange(20.0), failed=lost, std_error=0.1)
    found = spread.share(high=inside - 0.5)
    expected = binomtest(inside, 20 + failed).proportion_ci(method="wilson")
    assert found.share == pytest.approx(inside / (20 + failed), rel=1e-12)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), rel=1e-9, abs=1e-12)


def test_samples_and_indices_without_derivatives_before() -> None:
    assert list(study().monte_carlo(8)) == ["y"]
    assert study().indices(8).results == ("y",)
    drawn = study().monte_carlo(8)["y"]
    assert drawn.share(high=np.int64(1000)) == drawn.share(high=1000.0)


class Oil(Component):
    """A temperature."""

    T: Param[Scalar, "K"] = 300.0


@pytest.mark.parametrize("std", ["2 degC", quantity(2.0, "degC"), "2 K", 2.0])
def test_a_spread_of_temperature_is_a_difference(std: Any) -> None:
    found = Tolerance(Oil(), {"T": Normal(std=std)}, {"T": lambda m: m.T}).first_order()["T"]
    assert found.std == pytest.approx(2.0)


def test_first_order_prints_what_each_parameter_causes() -> None:
    """2 c + 10 d: variances 16 and 100 * 0.03; independent, and with a correlation of normal parameters of -0.5."""
    printed = str(study((linear, "kN")).first_order()).splitlines()
    assert [line.split() for line in printed[2:]] == [
        ["variance", "of", "y", "share", "change", "[kN]", "for", "std", "unit"],
        [C, "0.8421", "0.004", "0.002", "N/mm"],
        [D, "0.1579", "0.001732", "0.1732", "N.s/m"],
    ]
    both = {C: Normal(std=2.0), D: Normal(std=0.4)}
    found = study(distributions=both, correlation={(C, D): -0.5}).first_order()["y"]
    # Both changes are 4: the variance is 16 + 16 - 16, of which each parameter has a half.
    assert [cause.change for cause in found.causes] == pytest.approx([4.0, 4.0], rel=1e-12)
    assert found.shares == pytest.approx({C: 0.5, D: 0.5}, rel=1e-9)
    assert "share" not in str(study().sobol_sequence(8))
