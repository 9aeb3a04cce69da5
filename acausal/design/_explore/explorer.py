"""A model with free parameters, compiled once, whose results are computed at any values between the bounds."""

import dataclasses
import io
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any, Generic, TypeVar

from ..._declare.component import Component
from ..._errors import AcausalError, ModelError, suggestion
from ..._integrate.results.columns import Item
from ..._integrate.results.solution import Solution
from .._optimise.design import Design
from .._optimise.design_problem import DesignProblem
from .._optimise.optimise import best_design
from .._problem.free import Free
from .._problem.limits import Objective
from .explored import Explored, ExploredResult
from .html import table
from .part_evaluator import PartEvaluator
from .served import App, serve

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
