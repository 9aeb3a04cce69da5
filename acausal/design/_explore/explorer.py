"""A model with free parameters, compiled once, whose results are computed at any values between the bounds."""

import dataclasses
import html
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import Any, Generic, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._errors import AcausalError, ModelError, ParameterError, suggestion
from ..._integrate.results.columns import Item
from ..._integrate.results.solution import Solution
from .._compute.evaluator import Evaluator
from .._optimise.design import Design
from .._optimise.design_problem import DesignProblem
from .._optimise.optimise import best_design
from .._problem.free import Free
from .._problem.limits import Objective, objectives_of
from .._problem.types import ByPath, One
from .explored import Explored, ExploredResult
from .served import App, serve


class PartEvaluator(Evaluator):
    """Evaluates the program of another evaluator with some parameters free. The others keep their values in `model`."""

    def __init__(self, whole: Evaluator, model: Component, names: Sequence[str]) -> None:
        self._columns = [whole.free.names.index(name) for name in names]
        variables = (whole.free.variables[i] for i in self._columns)
        at_model = whole.free.values(model)
        variables = tuple(one._replace(start=at_model[i]) for one, i in zip(variables, self._columns, strict=True))
        super().__init__(model, dataclasses.replace(whole.free, variables=variables), whole.functions)
        self._whole, self._x, self.results = whole, at_model, whole.results

    def _run_at(self, x: np.ndarray) -> Any:
        """The results at values of the free parameters, and the columns of their derivatives."""
        whole = self._x.copy()
        whole[self._columns] = x
        values, jacobian, results = self._whole._run_at(whole)
        self.names, self.owners = self._whole.names, self._whole.owners
        return values, jacobian[:, self._columns], results


def table(head: Sequence[str], rows: Iterable[Sequence[str]], marked: Sequence[str] = ()) -> str:
    """A table; rows whose first cell is `marked` are red."""
    lines = [_row("th", head, "")]
    lines += [_row("td", row, "color:#b00020" if row[0] in marked else "") for row in rows]
    return f"<table>{''.join(lines)}</table>"


def _row(kind: str, cells: Sequence[str], style: str) -> str:
    content = (
        f'<{kind} style="text-align:left;padding:0.1rem 0.8rem 0.1rem 0">{html.escape(cell)}</{kind}>' for cell in cells
    )
    return f'<tr style="{style}">{"".join(content)}</tr>'


M = TypeVar("M", bound=Component, covariant=True)
Run = Callable[[Any, str], Any]  # of a model and of `save`


@dataclasses.dataclass(frozen=True, eq=False)
class Explorer(Generic[M]):
    """A model with sliders: `at` computes its results, gradients and curves, `optimum` the best design.

    `app()` opens the sliders in a browser. A notebook shows the results at the start.
    """

    _problem: DesignProblem
    objectives: tuple[Objective, ...]
    run: Run | None
    curves: tuple[Item, ...]
    units: Sequence[str]
    held: tuple[str, ...]

    @property
    def name(self) -> str:
        """The class of the model."""
        return type(self._problem.model).__name__

    @property
    def free(self) -> Free:
        """The free parameters with their bounds and units."""
        return self._problem.free

    def at(self, values: Mapping[str, object] | None = None) -> Explored[M]:
        """The results at some values by name, as numbers in the declared units or texts such as "15 mm".

        Other parameters keep the values of the model. If the run fails or the model refuses the values, the `message`
        of the result holds the error.

        Raises `ModelError` for an unknown name and `ParameterError` for a value outside its bounds.
        """
        problem, free = self._problem, self.free
        x = free.changed(free.values(problem.model), values or {})
        explored = Explored[M](free, x, _curves=self.curves, _units=self.units)
        try:
            solution = self._solution(free.with_values(problem.model, x))
            found = problem.evaluator(x)
        except AcausalError as error:
            return dataclasses.replace(explored, message=str(error))
        explored = dataclasses.replace(explored, solution=solution)
        if not found.is_good:
            return dataclasses.replace(explored, message=f"{found.why}.")
        scales = {one.name: one.scale for one in self.objectives}
        numbers = (problem.evaluator.names, problem.evaluator.owners, found.values.tolist(), found.jacobian)
        results = [
            ExploredResult(name, value, scales[owner], gradient)
            if owner in scales
            else ExploredResult(name, value, problem.limits[owner].scale, gradient, problem.limits[owner])
            for name, owner, value, gradient in zip(*numbers, strict=True)
        ]
        return dataclasses.replace(explored, results=tuple(results))

    def _solution(self, model: Any) -> Solution[Any] | None:
        """The run with its trajectories, for the curves and for the full error of a failed run."""
        if self.run is None:
            return None
        found = self.run(model, "steps")
        if isinstance(found, Solution):
            return found
        if self.curves:
            raise ModelError(f"Curves need a run that returns a solution; it returned a {type(found).__name__}.")
        return None

    def optimum(
        self, values: Mapping[str, object] | None = None, minimise: str = "", varied: Sequence[str] | None = None
    ) -> Design[M]:
        """The design that minimises a result within the limits, with its certificate.

        The search starts from the values and varies the parameters named in `varied`, by default all except those held.
        It minimises the first result, unless `minimise` names another, with the compiled program of `at`.

        Raises `ModelError` for an unknown name, and `SimulationError` if no design can be computed.
        """
        problem, free = self._problem, self.free
        objectives = {one.name: one for one in self.objectives}
        name = minimise or self.objectives[0].name
        if name not in objectives:
            raise ModelError(f"There is no result {name!r} to minimise.{suggestion(name, objectives)}")
        varied = [one for one in free.names if one not in self.held] if varied is None else list(varied)
        if unknown := set(varied) - set(free.names):
            raise ModelError(f"{min(unknown)!r} is not a free parameter.{suggestion(min(unknown), free.names)}")
        if not varied:
            raise ModelError("The search varies no parameter: choose at least one.")
        model = free.with_values(problem.model, free.changed(free.values(problem.model), values or {}))
        part = PartEvaluator(problem.evaluator, model, varied)
        problem = DesignProblem(model, part.free, objectives[name], problem.limits, part)
        return best_design(problem, None, 1, sensitivities=False, progress=False)

    def app(self, *, port: int = 0, browser: bool = True) -> App:
        """Opens the sliders in a browser; needs marimo. A notebook shows them in its page.

        A server in this process, which only this machine reaches, runs until the process ends. `port` 0 is a free one.
        """
        return serve({self.name: lambda: self}, port=port, browser=browser)

    def __repr__(self) -> str:
        return f"<Explorer of {self.name}: {', '.join(self.free.names)}>"

    def _repr_html_(self) -> str:
        explored = self.at()
        first = self.objectives[0]
        parts = [f"<p>{escape(explored.message)}</p>"] if explored.message else []
        if explored.results:
            unit = first.scale.unit
            parts.append(table(("result", "value", "limit", "margin", ""), explored.result_rows()))
            head = ("parameter", "value", f"one unit more: {first.name} [{unit}]", f"1 % more [{unit}]")
            parts.append(table(head, explored.gradient_rows(first.name)))
        if explored._columns:
            picture = io.StringIO()
            explored.figure().savefig(picture, format="svg")
            parts.append(picture.getvalue()[picture.getvalue().index("<svg") :])
        return "\n".join(parts)


def explore(
    model: M,
    free: ByPath[object],
    results: Mapping[str, One],
    *,
    run: Run | None = None,
    constraints: Mapping[str, object] | None = None,
    curves: Sequence[Item] = (),
    units: Sequence[str] = (),
    held: Sequence[str] = (),
) -> Explorer[M]:
    """Explores a model with sliders: results, limits, gradients and curves at any values of its free parameters.

        explorer = explore(
            drive,
            {"gear.ratio": (5.0, 40.0), "supply.V": ("6 V", "14 V")},
            {"time": (lambda s: s.t1, "ms")},
            run=lambda m, save: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save=save),
            curves=["load.b.phi", "motor.inductor.i"],
        )
        explorer.app()

    - `free`: bounds by path, as in `optimise`. A slider needs both bounds.
    - `results`: functions of the run with their display units, by name. The first one is minimised by default.
    - `run`: a function of the model and of `save` that returns the argument of the other functions, by default the
      model. It passes `save` on to `simulate`: "end" for results and gradients, "steps" for the curves.
    - `constraints`: a function and its limit by name, as in `optimise`.
    - `curves` and `units`: items and units of the curves, as in `Solution.plot`.
    - `held`: names of free parameters that the search for an optimum keeps, unless the app or the call frees them.

    Raises `ModelError` for an invalid problem, and `ParameterError` for bounds, units and starts.
    """
    if curves and run is None:
        raise ModelError("Curves need a run, such as run=lambda m, save: simulate(m, 1.0, save=save).")
    objectives = objectives_of(results)
    ended = None if run is None else lambda model: run(model, "end")
    problem = DesignProblem.of(model, free, objectives, ended, constraints, None)
    for variable in problem.free.variables:
        if variable.is_open:
            raise ParameterError(f"{variable.name}: a slider needs a lower and an upper bound, such as (2.0, 20.0).")
    for name in held:
        if name not in problem.free.names:
            raise ModelError(f"held: {name!r} is not a free parameter.{suggestion(name, problem.free.names)}")
    return Explorer(problem, objectives, run, tuple(curves), units, tuple(held))
