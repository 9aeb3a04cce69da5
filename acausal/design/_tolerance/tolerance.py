"""`Tolerance`: scatter of results caused by scatter of parameters."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import ModelError, SimulationError, UnknownNameError, suggestion
from ..._units.display import Scale
from .._compute.evaluator import CHANGED, EXPLAINED, Evaluator
from .._problem.distributions import Distribution, member_count, sobol_scores
from .._problem.limits import objectives_of
from .._problem.types import ByPath, Executor, Progress
from .._sensitivity.hessian import hessians_of
from .._sweep.batches import Batch, Outcomes
from .._sweep.pieces import evaluated
from .joint import JointDistribution
from .spread import Cause, Indices, Spread, Spreads, indices_of

REFUSED = 1e6  # scaled value of a point that cannot be computed


@dataclasses.dataclass(frozen=True)
class Worst:
    """Both ends of a result within the tolerances, with their parameters by name; `print` it for a table.

    `jumps`: parameters that change the result although its derivatives are zero, because it counts or rounds. Larger
    and smaller values may then exist.
    """

    result: str
    scale: Scale
    low: float
    high: float
    at_low: Mapping[str, float]
    at_high: Mapping[str, float]
    evaluations: int
    units: tuple[str, ...] = ()
    jumps: tuple[str, ...] = ()

    def __str__(self) -> str:
        ends = [f"{self.scale.value(value):.6g}{self.scale.text}" for value in (self.low, self.high)]
        scales = map(Scale.of, self.units or ("",) * len(self.at_low))
        rows = [
            [name, *(f"{scale.value(place[name]):.6g}" for place in (self.at_low, self.at_high)), scale.shown]
            for name, scale in zip(self.at_low, scales, strict=True)
        ]
        table = aligned([[f"worst case of {self.result}", *ends, ""], *rows])
        names = ", ".join(self.jumps)
        note = f"\n{self.result} jumps with {names}, where its derivatives are zero: other values may be worse"
        return table + (note if names else "")


def worst(
    evaluator: Evaluator, row: int, box: np.ndarray, gradient: np.ndarray, scale: Scale, starts: int, seed: int,
) -> Worst:  # fmt: skip
    """Both ends, each the best of several searches."""
    before = evaluator.evaluations
    ends = [_end(evaluator, row, box, sign, gradient, starts, seed) for sign in (1.0, -1.0)]
    (low, at_low, below), (high, at_high, above) = ends
    free = evaluator.free
    places = [dict(zip(free.names, x.tolist(), strict=True)) for x in (at_low, at_high)]
    effort = evaluator.evaluations - before
    jumps = tuple(name for i, name in enumerate(free.names) if i in below | above)
    return Worst(evaluator.names[row], scale, low, high, places[0], places[1], effort, free.units, jumps)


def _end(
    evaluator: Evaluator, row: int, box: np.ndarray, sign: float, gradient: np.ndarray, starts: int, seed: int
) -> tuple[float, np.ndarray, set[int]]:
    """The minimum of `sign` times the result, its place, and variables that change it there without a derivative."""
    low, width = box[:, 0], box[:, 1] - box[:, 0]
    size = float(np.sum(np.abs(gradient) * width)) or 1.0
    corner = np.where(sign * gradient > 0.0, 0.0, 1.0)
    # In the corner itself the search would end immediately.
    places = [0.02 + 0.96 * corner, *np.random.default_rng(seed).random((max(starts - 1, 0), len(low)))]

    def function(z: np.ndarray) -> tuple[float, np.ndarray]:
        found = evaluator(low + width * z)
        if not found.is_good:
            return REFUSED, np.zeros(len(low))
        return sign * found.values[row] / size, sign * found.jacobian[row] * width / size

    options: Any = dict(ftol=1e-14, gtol=1e-10)
    ends = [
        minimize(function, z, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(low), options=options)
        for z in places
    ]
    best = min(ends, key=lambda end: float(end.fun))
    if best.fun >= REFUSED:
        raise SimulationError("No design within the tolerances could be computed.")
    value, z, jumps = float(best.fun), np.array(best.x), set[int]()
    for i in np.flatnonzero(function(z)[1] == 0.0).tolist():
        for end in (0.0, 1.0):
            other = np.where(np.arange(len(z)) == i, end, z)
            lower, slopes = function(other)
            if lower < REFUSED and slopes[i] == 0.0 and abs(lower - value) > CHANGED * max(abs(lower), abs(value)):
                value, z = (lower, other) if lower < value else (value, z)
                jumps.add(i)
    return sign * size * value, low + width * z, jumps


M = TypeVar("M", bound=Component)
SURROGATE = 2**16  # samples of the second-order polynomial


class Members(NamedTuple):
    """Sampled parameters in the order of `Tolerance.names`, with their results and codes."""

    parameters: Float[np.ndarray, "n k"]
    outcomes: Outcomes


class Tolerance(Generic[M]):
    """Scatter of results of a model caused by scatter of its parameters.

        study = Tolerance(
            drive,
            {"motor.resistor.R": Normal(std="5 %"), "gear.ratio": Uniform("-1 %", "+1 %")},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
        )
        print(study.first_order(), study.monte_carlo(2000), study.indices(512), study.worst_case("time"), sep="\\n")

    - `distributions`: by path, or by a tuple of paths that share a value: `Normal`, `Uniform`, `Triangular` or
      `Samples`.
    - `results`: a function of the run, with its display unit, or a dictionary of these by name.
    - `run`: a function of the model that returns the argument of the other functions; by default the model.
    - `correlation`: of pairs of parameters, `{("a", "b"): 0.5}`. It applies to normal scores (a Gaussian copula), and
      so to the values of normal parameters.
    - `executor`: an object with `submit` as in `sweep`; by default threads on all cores.

    Source: GUM (JCGM 100) for the first- and second-order methods, JCGM 101 for Monte Carlo.

    Raises `ModelError` or `ParameterError` for invalid names, numbers and units.
    """

    def __init__(
        self,
        model: M,
        distributions: ByPath[Distribution],
        results: object,
        *,
        run: Callable[[M], Any] | None = None,
        correlation: Mapping[tuple[str, str], float] | None = None,
        executor: Executor | None = None,
    ) -> None:
        self.model = model
        self._joint = JointDistribution.of(model, distributions, correlation)
        self.free, self.distributions = self._joint.free, self._joint.marginals
        objectives = {objective.name: objective for objective in objectives_of(results, "result")}
        self._scales = {name: objective.scale for name, objective in objectives.items()}
        functions = {name: objective.function for name, objective in objectives.items()}
        self._evaluator = Evaluator(model, self.free, functions, run)
        self._batch = Batch(model, self.free, functions, run)
        self._executor = executor

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that scatter."""
        return self.free.names

    @property
    def means(self) -> Float[np.ndarray, " k"]:
        """The means of the parameters in the declared units."""
        return self._joint.means

    @property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """From standard deviations and the correlation of the scores; exact if all parameters are normal."""
        return self._joint.covariance

    def parameters_at(self, scores: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Parameters from independent standard normal scores."""
        return self._joint.parameters_at(scores)

    def first_order(self) -> Spreads:
        """Mean f(E x) and variance g^T S g from the gradient g at the means and the covariance S of the parameters.

        Each parameter causes the share g_i (S g)_i / g^T S g of the variance.
        """
        values, gradient = self._derivatives
        found = Spreads()
        for i, (name, owner) in enumerate(zip(*self._batch.columns, strict=True)):
            g = gradient[i]
            variance = float(g @ self.covariance @ g)
            shares = g * (self.covariance @ g) / (variance or 1.0)
            std = self._joint.std
            rows = zip(self.free.variables, std.tolist(), (g * std).tolist(), shares.tolist(), strict=True)
            causes = tuple(Cause(variable.name, variable.scale, *row) for variable, *row in rows)
            found[name] = Spread(
                name, self._scales[owner], "first order", float(values[i]), variance**0.5, np.zeros(0), causes=causes,
                unexplained=self._unexplained(i),
            )  # fmt: skip
        return found

    def second_order(self) -> Spreads:
        """Distribution of the second-order polynomial about the means, with exact second derivatives H.

        The mean is f + tr(H S)/2. Standard deviation and percentiles come from many samples of the polynomial. Raises
        `SimulationError` if there are no second derivatives, as `hessian` does.
        """
        values, gradient = self._derivatives
        hessian = self._hessian
        steps = self.parameters_at(sobol_scores(len(self.names), SURROGATE, 0)) - self.means
        found = Spreads()
        for i, (name, owner) in enumerate(zip(*self._batch.columns, strict=True)):
            mean = float(values[i] + 0.5 * np.trace(hessian[i] @ self.covariance))
            samples = values[i] + steps @ gradient[i] + 0.5 * np.einsum("ni,ij,nj->n", steps, hessian[i], steps)
            std = float(np.std(samples))
            found[name] = Spread(
                name, self._scales[owner], "second order", mean, std, samples, unexplained=self._unexplained(i)
            )
        return found

    def monte_carlo(
        self, n: int = 1000, *, seed: int = 0, progress: Progress | bool | None = None, scores: np.ndarray | None = None
    ) -> Spreads:
        """Distribution of `n` independent members, drawn by `numpy.random.default_rng(seed)`, or of given `scores`.

        Failed members are excluded and counted by reason. `progress` is as in `sweep`, or a function of the numbers of
        finished and of all members. After a keyboard interrupt, unfinished members are excluded and counted.
        """
        if scores is None:
            scores = np.random.default_rng(seed).standard_normal((member_count(n), len(self.names)))
        return self._sampled("Monte Carlo", np.asarray(scores, float), progress)

    def sobol_sequence(self, n: int = 1024, *, seed: int = 0, progress: Progress | bool | None = None) -> Spreads:
        """Distribution of `n` members of a scrambled Sobol sequence; a power of two is best."""
        return self._sampled("Sobol sequence", sobol_scores(len(self.names), member_count(n), seed), progress)

    def members(
        self, scores: Float[np.ndarray, "n k"], progress: Progress | bool | None = None, what: str = "members"
    ) -> Members:
        """Runs of members given by independent standard normal scores; `what` labels the bar."""
        x = self.parameters_at(scores)
        return Members(x, evaluated(self._batch, x, what, executor=self._executor, progress=progress))

    def indices(self, n: int = 512, *, seed: int = 0, progress: Progress | bool | None = None) -> Indices:
        """First-order and total Sobol' indices by n (k + 2) runs for k independent parameters.

        Estimators: Saltelli and others (2010), Computer Physics Communications 181, 259-270, table 2 (b) and (f).
        """
        if not np.allclose(self._joint.root, np.eye(len(self.names))):
            raise ModelError("Sobol' indices are defined for independent parameters: leave out `correlation`.")
        k = len(self.names)
        both = sobol_scores(2 * k, member_count(n), seed)
        first, second = both[:, :k], both[:, k:]
        mixed = [np.where(np.arange(k) == i, second, first) for i in range(k)]
        # Sample by sample, so that an interrupt leaves complete samples.
        scores = np.stack([first, second, *mixed], axis=1).reshape(n * (k + 2), k)
        found = self.members(scores, progress, "Sobol indices")
        return indices_of(self.names, self._batch.columns[0], found.outcomes, n, k, seed)

    def worst_case(self, result: str = "", *, sigmas: float = 3.0, starts: int = 4, seed: int = 0) -> Worst:
        """The smallest and the largest value of a result within the tolerances, and their parameters.

        The box extends to the bounds of distributions, and to `sigmas` standard deviations of `Normal` ones; it ignores
        correlations. The search uses L-BFGS-B of scipy with exact gradients, from the corner in the direction of the
        gradient at the means and from further starts.

        Raises `ParameterError` if the box leaves the range of a parameter.
        """
        _, gradient = self._derivatives
        row, box = self._row(result), self._joint.box(self.model, sigmas)
        owner = self._batch.columns[1][row]
        return worst(self._evaluator, row, box, gradient[row], self._scales[owner], starts, seed)

    def _row(self, result: str) -> int:
        names = self._batch.columns[0]
        if not result and len(names) == 1:
            return 0
        if result not in names:
            raise UnknownNameError(f"There is no result {result!r}.{suggestion(result, names)}")
        return names.index(result)

    def _sampled(self, method: str, scores: np.ndarray, progress: Progress | bool | None) -> Spreads:
        if scores.ndim != 2 or scores.shape[1] != len(self.names):
            raise ModelError(f"scores must have a column for each of {len(self.names)} parameters, got {scores.shape}.")
        outcomes = self.members(scores, progress, method).outcomes
        good = outcomes.values[outcomes.are_good]
        unfinished = int(np.sum(~outcomes.are_finished))
        if len(good) < 2:
            reasons = ", ".join(f"{reason} ({number})" for reason, number in outcomes.failed.items())
            raise SimulationError(f"Fewer than two of {len(scores)} members could be computed: {reasons}.")
        found = Spreads()
        for i, (name, owner) in enumerate(zip(*self._batch.columns, strict=True)):
            mean, std = float(np.mean(good[:, i])), float(np.std(good[:, i], ddof=1))
            error = std / np.sqrt(len(good)) if method == "Monte Carlo" else 0.0
            found[name] = Spread(
                name, self._scales[owner], method, mean, std, good[:, i], outcomes.failed, float(error),
                unfinished=unfinished,
            )  # fmt: skip
        return found

    @ft.cached_property
    def _derivatives(self) -> tuple[np.ndarray, np.ndarray]:
        """Results and derivatives at the means."""
        found = self._evaluator(self.means)
        if not found.is_good:
            raise SimulationError(f"The model cannot be computed with the means of its parameters: {found.why}.")
        return found.values, found.jacobian

    def _unexplained(self, row: int) -> tuple[str, ...]:
        """Parameters that change a result within their standard deviation otherwise than its derivatives explain.

        Results that count or round jump, and their derivatives lack the jumps. Single parameters are examined only if
        a change of all of them, or of those with a zero derivative, reveals such a difference.
        """
        is_blind = self._evaluator(self.means).jacobian[row] == 0.0
        std, scale = self._joint.std, self._scales[self._batch.columns[1][row]]
        together = [std, *([std * is_blind] if np.any(is_blind) else [])]
        if not any(self._difference(row, step) for step in together):
            return ()
        single = {name: self._difference(row, step) for name, step in zip(self.names, np.diag(std), strict=True)}
        found = {name: one for name, one in single.items() if one}
        sentences = []
        for name, (change, explained) in found.items():
            part = f"explain {scale.difference(explained):.6g}{scale.text} of this" if explained else "are zero"
            sentences.append(
                f"{self._batch.columns[0][row]} changes by {scale.difference(change):.6g}{scale.text} within a "
                f"standard deviation of {name}, but its derivatives {part}: use monte_carlo"
            )
        return tuple(sentences)

    def _difference(self, row: int, step: np.ndarray) -> tuple[float, float] | None:
        """The change of a result by a step from the means in either direction, and the part of it that derivatives
        explain, by the trapezoidal rule; None if they explain it.
        """
        here = self._evaluator(self.means)
        for whole in (step, -step):
            points = [here, *(self._evaluator(self.means + share * whole) for share in (0.5, 1.0))]
            if not all(point.is_good for point in points):
                continue
            first, middle, last = (float(point.jacobian[row] @ whole) for point in points)
            explained, values = 0.25 * (first + 2.0 * middle + last), [point.values[row] for point in points]
            change = float(values[-1] - values[0])
            if abs(change) > CHANGED * np.max(np.abs(values)) and abs(change - explained) > EXPLAINED * abs(change):
                return change, explained
        return None

    @ft.cached_property
    def _hessian(self) -> np.ndarray:
        """Second derivatives of the results at the means."""
        return hessians_of(self._evaluator, self.means)
