"""Parameters from measurements: estimates, their intervals, and what is said of data that do not tell them."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _problems import Valleys
from _rigs import Rig, Twins, rig
from scipy.stats import binom, chi2

from acausal import (
    Component,
    ModelError,
    Param,
    ParameterError,
    Scalar,
    SimulationError,
    UnknownNameError,
    quantity,
    simulate,
)
from acausal.design import Experiment, Fit, Normal, identify
from acausal.design._identify.estimate import _whiteness
from acausal.design._identify.prepare import prepared
from studies.actuators import ema_maxon

TIMES = np.linspace(0.05, 1.5, 30)
NOISE = 2e-3  # m
FREE = {"link.c": (5.0, 500.0), "link.d": (0.1, 10.0)}
TRUE = {"link.c": 40.0, "link.d": 1.5}


def position(m: float = 1.0, c: float = 40.0, d: float = 1.5, s0: float = 0.1) -> np.ndarray:
    """s of the mass that is let go, in closed form."""
    damping, frequency = d / (2 * m), np.sqrt(c / m - (d / (2 * m)) ** 2)
    wave = np.cos(frequency * TIMES) + damping / frequency * np.sin(frequency * TIMES)
    return s0 * np.exp(-damping * TIMES) * wave


def drop(measured: Any, sigma: Any = NOISE, mass: float = 1.0, **options: Any) -> Experiment:
    given = {} if sigma is None else {"link.s_rel": sigma}
    changes = {"mass.m": mass}
    return Experiment.of_run(TIMES, {"link.s_rel": measured}, sigma=given, changes=changes, rtol=1e-8, **options)


def noisy(seed: int, **numbers: float) -> np.ndarray:
    return position(**numbers) + NOISE * np.random.default_rng(seed).standard_normal(len(TIMES))


def covers(fit: Fit[Rig]) -> list[bool]:
    triples = zip(fit.names, fit.low, fit.high, strict=True)
    return [bool(low <= TRUE[name] <= high) for name, low, high in triples]


@pytest.fixture(scope="module")
def both() -> Fit[Rig]:
    """Two masses, one spring."""
    experiments = [drop(noisy(1), name="light"), drop(noisy(2, m=2.5), mass=2.5, name="heavy")]
    return identify(rig(c=60.0, d=1.0), FREE, experiments)


@pytest.mark.thorough
def test_exact_data_give_the_true_values() -> None:
    fit = identify(rig(c=70.0, d=0.7), FREE, drop(position()), tolerance=1e-11)
    np.testing.assert_allclose(fit.estimates, [40.0, 1.5], rtol=1e-6)
    assert fit.chi2 < 1e-6
    assert float(fit.model.link.c) == fit.estimates[0]


@pytest.mark.thorough
@pytest.mark.parametrize("given", [True, False], ids=["noise given", "noise estimated"])
def test_intervals_hold_the_true_values_at_their_rate(given: bool) -> None:
    """200 replications with intervals of 90 %: as many hold as a binomial distribution allows, at either end 0.1 %."""
    start, n = rig(c=60.0, d=1.0), 200
    fits = [identify(start, FREE, drop(noisy(100 + i), NOISE if given else None), level=0.9) for i in range(n)]
    low, high = binom.ppf([0.001, 0.999], n, 0.9)
    hits = np.sum([covers(fit) for fit in fits], axis=0)
    assert np.all((low <= hits) & (hits <= high)), hits
    # The spread of the estimates is what each fit says of it, and chi2 has its distribution.
    spread = np.std([fit.estimates for fit in fits], axis=0, ddof=1)
    np.testing.assert_allclose(spread, np.mean([fit.std for fit in fits], axis=0), rtol=0.2)
    if given:
        assert 0.001 < chi2.cdf(sum(fit.chi2 for fit in fits), sum(fit.dof for fit in fits)) < 0.999
    else:
        noises = [float(fit.sigma["experiment 1: link.s_rel"][0]) ** 2 for fit in fits]
        np.testing.assert_allclose(np.mean(noises), NOISE**2, rtol=0.1)


@pytest.mark.thorough
def test_several_experiments_determine_what_they_share(both: Fit[Rig]) -> None:
    single = identify(rig(c=60.0, d=1.0), FREE, drop(noisy(1)))
    assert np.all(both.std < single.std)
    understated = identify(rig(c=60.0, d=1.0), FREE, drop(noisy(1), 0.2 * NOISE))
    np.testing.assert_allclose(understated.std, 0.2 * single.std, rtol=1e-4)
    np.testing.assert_allclose(understated.std_scaled_by_residual, single.std_scaled_by_residual, rtol=1e-4)
    assert both.dof == 58
    assert all(covers(both))
    np.testing.assert_allclose(both.predicted["heavy: link.s_rel"], position(2.5, *both.estimates), atol=1e-6)
    measured = np.concatenate([channel.measured for channel in both.channels])
    residuals = np.concatenate(list(both.residuals.values()))
    predicted = np.concatenate(list(both.predicted.values()))
    np.testing.assert_allclose(residuals, (predicted - measured) / NOISE, rtol=1e-9, atol=1e-9)


def test_derivatives_agree_with_those_of_the_closed_form(both: Fit[Rig]) -> None:
    step = 1e-5 * both.estimates
    for i, (name, m) in enumerate([("light", 1.0), ("heavy", 2.5)]):
        rows = both.jacobian[30 * i : 30 * (i + 1)]
        assert both.channels[i].experiment == name
        for j in range(2):
            up, down = (both.estimates + sign * step * (np.arange(2) == j) for sign in (1, -1))
            slope = (position(m, *up) - position(m, *down)) / (2 * step[j] * NOISE)
            np.testing.assert_allclose(rows[:, j], slope, rtol=1e-4, atol=1e-4 * np.max(np.abs(slope)))


@pytest.mark.thorough
def test_combinations_that_the_data_cannot_tell_apart_are_named() -> None:
    """The motion depends on c/m and d/m only, not on m, c and d separately."""
    fit = identify(rig(m=1.2, c=50.0, d=1.5), {"mass.m": (0.5, 2.0), **FREE}, _free_mass(noisy(3)))
    assert fit.rank == 2
    (lost,) = fit.indistinguishable
    np.testing.assert_allclose(list(lost.shares.values()), np.full(3, 3**-0.5), rtol=1e-4)
    assert np.all(np.isinf(fit.std))
    assert "+0.58 mass.m +0.58 link.c +0.58 link.d" in str(fit)
    assert "not determined" in str(fit)
    c_over_m = fit.estimates[1] / fit.estimates[0]
    assert abs(c_over_m - 40.0) < 1.0


def _free_mass(measured: Any) -> Experiment:
    return Experiment.of_run(TIMES, {"link.s_rel": measured}, sigma={"link.s_rel": NOISE}, rtol=1e-8)


def test_a_prior_adds_what_the_data_do_not_tell() -> None:
    free = {"mass.m": (0.5, 2.0), **FREE}
    prior = {"mass.m": Normal(1.0, 0.01)}
    fit = identify(rig(m=1.2, c=50.0, d=1.5), free, _free_mass(noisy(3)), priors=prior)
    known = identify(rig(c=50.0, d=1.5), FREE, drop(noisy(3)))
    assert fit.rank == 3
    np.testing.assert_allclose(fit.estimates, [1.0, *known.estimates], rtol=1e-5)
    assert fit.std[0] == pytest.approx(0.01, rel=1e-4)
    assert fit.dof == known.dof  # one parameter and one prior more
    # The stiffness takes over the relative uncertainty of the mass.
    expected = np.hypot(known.std[0], 0.01 * known.estimates[0])
    assert fit.std[1] == pytest.approx(expected, rel=1e-3)


@pytest.mark.thorough
def test_one_value_for_several_paths() -> None:
    measured = {"a.link.s_rel": position(), "b.link.s_rel": position(m=2.5)}
    experiment = Experiment.of_run(TIMES, measured, sigma=dict.fromkeys(measured, NOISE), rtol=1e-8)
    twins = Twins(a=rig(c=60.0), b=rig(c=60.0, m=2.5))
    fit = identify(twins, {("a.link.c", "b.link.c"): (5.0, 500.0)}, experiment)
    assert fit.names == ("a.link.c, b.link.c",)
    np.testing.assert_allclose(fit.estimates, 40.0, rtol=1e-5)
    assert float(fit.model.a.link.c) == float(fit.model.b.link.c)


@pytest.mark.thorough
def test_what_is_free_in_one_experiment_alone() -> None:
    """One spring for three masses of which two are not known: c is shared, the masses are not."""
    free = {"mass.m": (0.3, 5.0)}
    experiments = [
        drop(noisy(1), name="known"),
        drop(noisy(2, m=2.5), mass=2.0, name="heavy", free=free),
        drop(noisy(3, m=0.7), mass=1.0, name="light", free=free),
    ]
    fit = identify(rig(c=60.0, d=1.0), FREE, experiments, priors={"heavy: mass.m": Normal(2.5, 0.5)})
    assert fit.names == ("link.c", "link.d", "heavy: mass.m", "light: mass.m")
    assert np.all(np.abs(fit.estimates - [40.0, 1.5, 2.5, 0.7]) < 4.0 * fit.std)
    assert np.all(fit.std[2:] < 0.05)
    # A run tells of its own mass only: derivatives of the others are zero.
    rows = {channel.experiment: fit.jacobian[channel.rows] for channel in fit.channels}
    assert not np.any(rows["known"][:, 2:])
    assert not np.any(rows["heavy"][:, 3])
    assert np.any(rows["heavy"][:, 2])
    assert float(fit.model_of("heavy").mass.m) == fit.estimates[2]
    assert float(fit.model_of("light").link.c) == float(fit.model.link.c) == fit.estimates[0]
    assert float(fit.model.mass.m) == 1.0
    with pytest.raises(UnknownNameError, match="no experiment 'heav'"):
        fit.model_of("heav")
    alone = identify(rig(c=60.0, d=1.0), {}, drop(noisy(1), free=FREE))
    both = identify(rig(c=60.0, d=1.0), FREE, drop(noisy(1)))
    np.testing.assert_allclose(alone.estimates, both.estimates, rtol=1e-8)
    with pytest.raises(ModelError, match=r"experiment 1: link.c is free in all experiments already"):
        identify(rig(), FREE, drop(noisy(1), free={"link.c": (5.0, 50.0)}))


def test_several_starts_run_side_by_side() -> None:
    """(x^2 - 1)^2 + 0.1 x has two valleys, that of negative x being the deeper one; its slope is that of b."""

    def predict(model: Valleys) -> dict[str, Any]:
        return {"a": model.x**2 - 1.0, "b": model.x}

    experiment = Experiment(predict, {"a": 0.0, "b": -1.0}, {"a": 1.0, "b": 4.0})
    single = identify(Valleys(x=1.5), {"x": (-3.0, 3.0)}, experiment)
    several = identify(Valleys(x=1.5), {"x": (-3.0, 3.0)}, experiment, starts=8)
    assert single.estimates[0] > 0.9
    assert single.ends == ()
    np.testing.assert_allclose(several.estimates, -1.0, atol=1e-6)
    ends = np.array([end.estimates[0] for end in several.ends])
    assert len(ends) == 8
    # Each start leads into the valley that it lies in, and the better one comes first.
    np.testing.assert_allclose(np.sort(np.unique(ends.round(4))), [-1.0, round(single.estimates[0], 4)], atol=1e-4)
    assert np.all(np.diff([end.chi2 for end in several.ends]) >= 0.0)
    assert f"{int(np.sum(ends < 0.0))} of 8 starts lead to this sum of squares" in str(several)


def test_starts_that_meet_a_bound() -> None:
    plain = identify(rig(c=20.0, d=1.0), {"link.c": (5.0, 30.0), "link.d": (0.1, 10.0)}, drop(noisy(4)))
    several = identify(rig(c=20.0, d=1.0), {"link.c": (5.0, 30.0), "link.d": (0.1, 10.0)}, drop(noisy(4)), starts=4)
    np.testing.assert_allclose(several.estimates, plain.estimates, rtol=1e-6)
    assert several.at_bound.tolist() == [True, False]


@pytest.mark.thorough
def test_a_bound_that_holds_a_parameter_back() -> None:
    """The others are fitted as if its value were known."""
    fit = identify(rig(c=20.0, d=1.0), {"link.c": (5.0, 30.0), "link.d": (0.1, 10.0)}, drop(noisy(4)))
    known = identify(rig(c=30.0, d=1.0), {"link.d": (0.1, 10.0)}, drop(noisy(4)))
    assert fit.at_bound.tolist() == [True, False]
    assert fit.estimates[0] == pytest.approx(30.0, rel=1e-12)
    assert fit.estimates[1] == pytest.approx(known.estimates[0], rel=1e-6)
    assert fit.std[1] == pytest.approx(known.std[0], rel=1e-6)
    assert np.isnan(fit.std[0])
    assert "at its bound" in str(fit)


@pytest.mark.thorough
def test_a_start_on_a_bound_is_left() -> None:
    fit = identify(rig(c=25.0, d=1.0), {"link.c": (25.0, 500.0), "link.d": (0.1, 10.0)}, drop(noisy(4)))
    assert all(covers(fit))


@pytest.mark.thorough
def test_units_of_data_are_converted() -> None:
    plain = identify(rig(c=60.0), FREE, drop(noisy(5)))
    sigma = {"link.s_rel": quantity(2.0, "mm")}
    experiment = Experiment.of_run(
        quantity(1e3 * TIMES, "ms"), {"link.s_rel": quantity(1e3 * noisy(5), "mm")}, sigma=sigma, rtol=1e-8
    )
    np.testing.assert_allclose(identify(rig(c=60.0), FREE, experiment).estimates, plain.estimates, rtol=1e-7)


@pytest.mark.thorough
def test_scalar_results_and_outputs() -> None:
    """The time of the first passage of zero, and the kinetic energy over time."""

    def passage(model: Rig) -> dict[str, Any]:
        solution = simulate(model, 2.0, until=lambda s: s.link.s_rel, save="end", rtol=1e-9, throw=False)
        return {"time": solution.t1}

    true = rig()
    time = passage(true)["time"]
    solution = simulate(true, TIMES[-1], save=TIMES, rtol=1e-9)
    energy = 0.5 * solution["mass.v"] ** 2
    timed = Experiment(passage, {"time": quantity(1e3 * float(time), "ms")}, {"time": 1e-4}, units={"time": "s"})
    weighed = Experiment.of_run(
        TIMES, {"energy": energy}, outputs={"energy": lambda s: 0.5 * s.mass.m * s.mass.v**2}, sigma={"energy": 1e-3}
    )
    fit = identify(rig(c=50.0, d=1.2), FREE, [timed, weighed])
    np.testing.assert_allclose(fit.estimates, [40.0, 1.5], rtol=1e-4)
    assert [channel.unit for channel in fit.channels] == ["s", ""]


def test_profile_likelihood(both: Fit[Rig]) -> None:
    """Near its minimum chi2 is the parabola of the covariance; each end is where it has risen to the threshold."""
    profile = both.profile("link.c", points=3)
    np.testing.assert_allclose([profile.low, profile.high], [both.low[0], both.high[0]], rtol=0.02)
    np.testing.assert_allclose(profile.chi2[[0, -1]], profile.threshold, rtol=1e-5)
    parabola = both.chi2 + ((profile.values - both.estimates[0]) / both.std[0]) ** 2
    np.testing.assert_allclose(profile.chi2, parabola, atol=0.05 * (profile.threshold - both.chi2))
    with pytest.raises(UnknownNameError, match=r"no parameter 'link.k'"):
        both.profile("link.k")


@pytest.mark.thorough
def test_tests_of_residuals(both: Fit[Rig]) -> None:
    assert [test.name for test in both.tests] == ["size", *["normality", "whiteness"] * 2]
    assert all(test.passed for test in both.tests)
    # A model that lacks a part of what happens leaves residuals that are large and follow one another.
    wrong = identify(rig(c=60.0), {"link.c": (5.0, 500.0)}, drop(noisy(1, d=3.0)))
    failed = {test.name for test in wrong.tests if not test.passed}
    assert {"size", "whiteness"} <= failed
    assert "unlikely to be noise" in str(wrong)


def test_statistic_of_ljung_and_box() -> None:
    """Residuals that alternate have the autocorrelations -7/8 and 6/8: Q = 8 * 10 (49/64/7 + 36/64/6) = 16.25."""
    found = _whiteness(np.array([1.0, -1.0] * 4), "link.s_rel")
    assert found.statistic == pytest.approx(16.25, rel=1e-12)
    assert found.probability == pytest.approx(np.exp(-0.5 * 16.25), rel=1e-9)  # chi2 with two degrees of freedom


def test_pictures_and_text(both: Fit[Rig]) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    assert both.plot().shape == (2, 1)
    assert both.plot_residuals().shape == (2, 2)
    assert len(both.plot_correlation().texts) == 4
    assert both.profile("link.d", points=2).plot().get_xlabel() == "link.d [N.s/m]"
    plt.close("all")
    assert "N.s/m" in str(both)
    assert "rank 2 of 2" in str(both)
    assert repr(both).startswith("<Fit of link.c, link.d: chi2 = ")


@pytest.mark.thorough
def test_the_actuator_against_an_independent_program() -> None:
    """Winding resistance, friction and torque constant of the RE50 actuator, from travel and current.

    The figures are those of a collocation method (Radau IIA, five stages) with its own least squares: estimate and
    covariance for data without noise of 20 um and 0.2 A.
    """
    times = 1.6e-3 * np.arange(1, 51)
    true = simulate(ema_maxon(), times[-1], save=times, rtol=1e-10)
    measured = {"slave.rod.s": true["slave.rod.s"], "motor.p.i": true["motor.p.i"]}
    sigma = {"slave.rod.s": 20e-6, "motor.p.i": 0.2}
    experiment = Experiment.of_run(times, measured, sigma=sigma, rtol=1e-10)
    assert float(true["motor.p.i"][0]) == pytest.approx(38.54717641691361, rel=1e-8)
    free = {"motor.resistor.R": (0.1, 1.0), "motor.bearing.C": (1e-4, 1e-2), "motor.emf.k": (0.02, 0.08)}
    fit = identify(ema_maxon(resistance=0.35, friction=0.003, torque_constant=0.042), free, experiment)
    np.testing.assert_allclose(fit.estimates, [0.309, 0.004, 0.0385], rtol=1e-9)
    covariance = [
        [7.894898507762633e-07, -2.2270230778325e-08, -1.2140856959233104e-07],
        [-2.2270230778325e-08, 6.542153935445253e-10, 3.6242516225663485e-09],
        [-1.2140856959233104e-07, 3.6242516225663485e-09, 2.207056506313211e-08],
    ]
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-8)
    assert fit.correlation[0, 1] == pytest.approx(-0.9799209946136731, abs=1e-9)
    assert fit.dof == 97


def _with(values: Any, index: int, value: float) -> np.ndarray:
    changed = np.array(values)
    changed[index] = value
    return changed


def _stiffness(model: Rig) -> dict[str, Any]:
    return {"a": model.link.c}


BAD: dict[str, tuple[Any, type[Exception], str]] = {
    "not a number": (
        lambda: drop(_with(position(), 3, np.nan)),
        ParameterError,
        r"experiment 1: 1 of 30 values of link.s_rel are not finite; the first is link.s_rel\[3\], at 0.2 s",
    ),
    "times out of order": (
        lambda: Experiment.of_run([0.1, 0.3, 0.2], {"link.s_rel": [0.1, 0.0, 0.1]}),
        ParameterError,
        r"times must increase, but times\[2\] = 0.2 s follows times\[1\] = 0.3 s",
    ),
    "time twice": (
        lambda: Experiment.of_run([0.1, 0.1], {"link.s_rel": [0.1, 0.0]}),
        ParameterError,
        r"times must increase",
    ),
    "infinite time": (
        lambda: Experiment.of_run([0.1, np.inf], {"link.s_rel": [0.1, 0.0]}),
        ParameterError,
        r"times must be finite",
    ),
    "another unit": (
        lambda: drop(quantity(position(), "N")),
        ParameterError,
        r"experiment 1: link.s_rel is in m.*, but is given in",
    ),
    "times in another unit": (
        lambda: Experiment.of_run(quantity(TIMES, "m"), {"link.s_rel": position()}),
        ParameterError,
        r"experiment 1: times is in s",
    ),
    "other length": (
        lambda: drop(position()[:5]),
        ParameterError,
        r"link.s_rel has the shape \(5,\), but there are 30 times",
    ),
    "noise of zero": (
        lambda: drop(position(), 0.0),
        ParameterError,
        r"sigma of link.s_rel must be positive",
    ),
    "unknown variable": (
        lambda: Experiment.of_run(TIMES, {"link.s_relative": position()}),
        UnknownNameError,
        r"no variable 'link.s_relative'. Did you mean link.s_rel",
    ),
    "noise of something else": (
        lambda: Experiment.of_run(TIMES, {"link.s_rel": position()}, sigma={"link.s": 1.0}),
        ModelError,
        r"sigma names 'link.s', which is not measured",
    ),
    "too few": (
        lambda: Experiment.of_run([0.1], {"link.s_rel": [0.1]}, sigma={"link.s_rel": 1e-3}),
        ParameterError,
        r"1 measured values cannot determine 2 parameters",
    ),
    "too few for the noise": (
        lambda: Experiment.of_run([0.1, 0.2], {"link.s_rel": [0.1, 0.2]}),
        ParameterError,
        r"2 measured values cannot determine 2 parameters and the noise of 1 channels",
    ),
    "nothing": (lambda: Experiment.of_run(TIMES, {}), ModelError, r"nothing is measured"),
    "predicts something else": (
        lambda: Experiment(_stiffness, {"b": 1.0, "a": 2.0}, {"a": 1.0, "b": 1.0}),
        ModelError,
        r"predict does not return b, but a",
    ),
    "predicts another shape": (
        lambda: Experiment(_stiffness, {"a": [2.0, 3.0]}, {"a": 1.0}),
        ModelError,
        r"predict returns a with the shape \(\), but the measured values have the shape \(2,\)",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_data(case: str) -> None:
    make, error, text = BAD[case]
    with pytest.raises(error, match=text):
        identify(rig(), FREE, make())


def test_bad_experiments_and_priors() -> None:
    with pytest.raises(ModelError, match="must be unique, got a, a"):
        identify(rig(), FREE, [drop(position(), name="a"), drop(position(), name="a")])
    with pytest.raises(ModelError, match="at least one Experiment"):
        identify(rig(), FREE, [])
    with pytest.raises(ModelError, match=r"priors names 'link.k', which is not free"):
        identify(rig(), FREE, drop(position()), priors={"link.k": Normal(1.0, 0.1)})
    with pytest.raises(ParameterError, match="must be positive and finite"):
        identify(rig(), FREE, drop(position()), priors={"link.c": Normal(1.0, 0.0)})
    with pytest.raises(ModelError, match=r"at least one free parameter"):
        identify(rig(), {}, drop(position()))
    with pytest.raises(ModelError, match=r"cannot be differentiated"):
        identify(rig(), FREE, Experiment(lambda m: {"a": float(m.link.c)}, {"a": [1.0, 2.0, 3.0]}, {"a": 1.0}))
    with pytest.raises(ModelError, match=r"must be Normal"):
        identify(rig(), FREE, drop(position()), priors={"link.c": 1.0})  # pyright: ignore[reportArgumentType]


@pytest.mark.thorough
def test_a_model_that_cannot_be_run_from_its_start() -> None:
    steps = [drop(position(), name="fine"), drop(position(), max_steps=3, name="short")]
    text = (
        r"short: At t = .* s: The maximum number of steps.*cannot start with link.c = 0.04 N/mm, link.d = 1.5 N.s/m\."
    )
    with pytest.raises(SimulationError, match=text + ".*pass starts=10"):
        identify(rig(), FREE, steps)


@pytest.mark.parametrize("throw", [True, False])
def test_runs_of_functions_may_fail_on_the_way(throw: bool) -> None:
    """The mass is let go at 0.1 m and passes zero only if d is less than the critical damping, 12.6 N.s/m.

    Otherwise, a finite time is no result of the failed run, whatever its `throw`.
    """

    def passage(model: Rig) -> dict[str, Any]:
        run = simulate(model, 0.5, until=lambda s: s.link.s_rel, save="end", rtol=1e-8, throw=throw)
        return {"time": jnp.minimum(run.t1, 1.0)}

    free = {"link.d": (0.1, 100.0)}
    experiment = Experiment(passage, {"time": 0.3}, {"time": 1e-3}, units={"time": "s"})
    with pytest.raises(SimulationError, match=r"At t = 0.5 s: The stop condition was never met.*link.d = 50 N.s/m"):
        identify(rig(d=50.0), free, experiment)
    fit = identify(rig(d=50.0), free, experiment, starts=4)
    # x = exp(-a t) (cos w t + a/w sin w t) is zero at tan w t = -w/a.
    a, w = fit.estimates[0] / 2.0, np.sqrt(40.0 - fit.estimates[0] ** 2 / 4.0)
    assert (np.pi - np.arctan(w / a)) / w == pytest.approx(0.3, rel=1e-6)
    assert float(fit.log_density([50.0])) < -1e10


class Line(Component):
    """Two numbers that two measured values determine, one of them also by many others."""

    a: Param[Scalar, "m"] = 0.5
    b: Param[Scalar, "m"] = 0.5


@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_noise_that_does_not_converge_is_refused(loss: Any) -> None:
    """The noise of `few` has an estimate only if the two values disagree enough with the many others, which then have
    a share in b according to their variances.
    """

    def predict(model: Line) -> dict[str, Any]:
        return {"few": jnp.stack([model.a, model.a + model.b]), "many": model.b * jnp.ones(20)}

    def fitted(few: Any, **options: Any) -> Fit[Line]:
        measured = {"few": few, "many": 1.0 + 0.1 * np.linspace(-1.0, 1.0, 20)}
        free = {"a": (-10.0, 10.0), "b": (-10.0, 10.0)}
        return identify(Line(), free, Experiment(predict, measured, **options), loss=loss)

    with pytest.raises(SimulationError, match=r"noise of experiment 1: few has not converged.*its 2 values.*its sigma"):
        fitted([0.0, 1.01])
    known = fitted([0.0, 1.01], sigma={"few": 1e-2})
    assert np.all(np.isfinite(known.std))
    apart = fitted([0.0, 1.05])
    a, b = apart.estimates
    assert a == pytest.approx(0.5 * (1.05 - b), rel=1e-6)
    if loss == "huber":
        return
    many = apart.sigma["experiment 1: many"][0] ** 2 / 20.0
    few = 2.0 * apart.sigma["experiment 1: few"][0] ** 2
    assert b - 1.0 == pytest.approx(0.05 * many / (few + many), rel=1e-5)


@pytest.mark.thorough
def test_a_failed_run_that_does_not_throw_is_named() -> None:
    """Another experiment, with a failed run and a result without it, is not blamed."""

    def predict(model: Rig) -> dict[str, Any]:
        return {"y": simulate(model, TIMES[-1], save=TIMES, max_steps=3, throw=False)["link.s_rel"]}

    def guarded(model: Rig) -> dict[str, Any]:
        return {"y": jnp.nan_to_num(predict(model)["y"])}

    experiments = [Experiment(f, {"y": position()}, {"y": NOISE}, name=f.__name__) for f in (guarded, predict)]
    with pytest.raises(SimulationError, match=r"^predict: At t = .* s: The maximum number of steps.*cannot start"):
        identify(rig(), FREE, experiments)


def test_a_derivative_that_is_not_finite_at_the_start() -> None:
    experiment = Experiment(lambda m: {"y": jnp.sqrt(m.link.s_rel0)}, {"y": 1.0}, {"y": 1.0}, name="root")
    with pytest.raises(SimulationError, match=r"root: y: the derivative with respect to link.s_rel0 is not finite"):
        identify(rig(), {"link.s_rel0": (0.0, 1.0)}, experiment)


def test_all_starts_fail() -> None:
    experiment = Experiment(lambda m: {"y": jnp.log(-m.link.c)}, {"y": 1.0}, {"y": 1.0})
    with pytest.raises(SimulationError, match=r"experiment 1: y is nan. .*N/mm, nor from 2 other points. Start from"):
        identify(rig(), {"link.c": (5.0, 50.0)}, experiment, starts=3)


def test_a_start_that_cannot_be_computed_is_given_up_soon() -> None:
    calls = []

    def predict(model: Rig) -> dict[str, Any]:
        jax.debug.callback(lambda: calls.append(1))
        return {"y": jnp.nan * model.link.c * jnp.ones(2)}

    with pytest.raises(SimulationError, match=r"experiment 1: y is nan. The fit cannot start"):
        identify(rig(), FREE, Experiment(predict, {"y": [1.0, 2.0]}, {"y": 1.0}))
    jax.effects_barrier()
    assert len(calls) < 10


def test_places_that_cannot_be_run_are_stepped_back_from() -> None:
    """The result exists for soft springs only; Gauss and Newton's first step leads past that."""

    def predict(model: Rig) -> dict[str, Any]:
        c = model.link.c
        return {"y": jnp.where(c < 300.0, jnp.log(c), jnp.nan), "z": c / 100.0}

    experiment = Experiment(predict, {"y": np.log(200.0), "z": 2.0}, {"y": 1e-3, "z": 1.0})
    fit = identify(rig(c=6.0), {"link.c": (5.0, 45.0 * 10)}, experiment)
    np.testing.assert_allclose(fit.estimates, 200.0, rtol=1e-6)


def test_a_second_fit_of_other_data_compiles_nothing() -> None:
    calls = []

    def output(s: Any) -> Any:
        calls.append(None)
        return s.link.s_rel

    for seed, c in ((6, 60.0), (7, 55.0)):
        seen = len(calls)
        experiment = Experiment.of_run(TIMES, {"x": noisy(seed)}, outputs={"x": output}, sigma={"x": NOISE}, rtol=1e-8)
        identify(rig(c=c, d=1.0), FREE, experiment)
    assert len(calls) == seen


class Oil(Component):
    """A temperature."""

    T: Param[Scalar, "K"] = 300.0


def three_readings(oil: Oil) -> Any:
    return {"T": oil.T * jnp.ones(3)}


@pytest.mark.thorough
def test_noise_of_temperature_is_a_difference() -> None:
    measured = {"T": quantity(np.array([20.0, 21.0, 22.0]), "degC")}
    given = Experiment(three_readings, measured, {"T": quantity(0.5, "degC")}, units={"T": "K"})
    fit = identify(Oil(), {"T": (200.0, 400.0)}, given)
    assert fit.estimates[0] == pytest.approx(294.15)
    assert fit.std[0] == pytest.approx(0.5 / np.sqrt(3.0))


def test_data_of_a_path_may_have_another_unit_than_the_model() -> None:
    """Plain numbers in `units`, like quantities, are compared in the unit of the model and shown in their own."""
    plain = drop(1e3 * position(), 2.0, units={"link.s_rel": "mm"}, name="plain")
    named = drop(quantity(1e3 * position(), "mm"), quantity(2.0, "mm"), name="named")
    ready, labels = prepared([plain, named, drop(position())], rig(c=60.0, d=1.0))
    for one in ready:
        np.testing.assert_allclose(one.measured["link.s_rel"], position())
        np.testing.assert_allclose(one.sigma["link.s_rel"], NOISE)
    assert [label.units["link.s_rel"] for label in labels] == ["m", "m", "m"]
    assert [label.scales["link.s_rel"].shown for label in labels] == ["mm", "mm", "m"]
    np.testing.assert_allclose(labels[0].scales["link.s_rel"].value(position()), 1e3 * position())


def test_missing_values_have_no_weight() -> None:
    """The mean of the values that are there, with their standard deviation and degrees of freedom."""
    values = np.array([21.0, np.nan, 22.0]) + 273.15
    with pytest.raises(ParameterError, match=r"1 of 3 values of T are not finite.* missing=True"):
        identify(Oil(), {"T": (200.0, 400.0)}, Experiment(three_readings, {"T": values}))
    fit = identify(Oil(), {"T": (200.0, 400.0)}, Experiment(three_readings, {"T": values}, missing=True))
    np.testing.assert_allclose(fit.estimates, [294.65], rtol=1e-9)
    assert fit.dof == 1
    np.testing.assert_allclose(fit.std, [0.5], rtol=1e-6)
    np.testing.assert_array_equal(np.isnan(fit.residuals["experiment 1: T"]), [False, True, False])
    with pytest.raises(ParameterError, match="3 of 3 values of T are not finite"):
        identify(Oil(), {"T": (200.0, 400.0)}, Experiment(three_readings, {"T": [np.nan] * 3}, missing=True))
