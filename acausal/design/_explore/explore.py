"""`explore`: a model with sliders."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

from ..._declare.component import Component
from ..._errors import ModelError, ParameterError, suggestion
from ..._integrate.results.columns import Item
from .._optimise.design_problem import DesignProblem
from .._problem.limits import objectives_of
from .._problem.types import ByPath, One
from .explorer import Explorer, Run

M = TypeVar("M", bound=Component)


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
