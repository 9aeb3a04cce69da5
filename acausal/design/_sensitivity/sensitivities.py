"""`sensitivities`: sensitivities of results to all parameters."""

from collections.abc import Mapping
from typing import overload

import numpy as np

from ..._declare.by_name import parameters
from ..._declare.component import Component
from ..._errors import SimulationError
from .._compute.evaluator import Evaluator
from .._problem.free_parameters import free_parameters
from .._problem.limits import objectives_of
from .._problem.types import Function, One
from .table import SensitivityTable, sensitivity_table


@overload
def sensitivities(model: Component, results: One, *, run: Function | None = None) -> SensitivityTable: ...
@overload
def sensitivities(
    model: Component, results: Mapping[str, One], *, run: Function | None = None
) -> dict[str, SensitivityTable]: ...
def sensitivities(
    model: Component, results: One | Mapping[str, One], *, run: Function | None = None
) -> SensitivityTable | dict[str, SensitivityTable]:
    """Sensitivities of results to all parameters of a model: a `SensitivityTable`, or one by name for several results.

        table = sensitivities(drive, (lambda s: s.t1, "ms"), run=lambda m: simulate(m, 0.5, until=...))
        print(table); table.plot()

    `results` is a function of the run, with its display unit unless it is a pure number, or a dictionary of these.
    `run` is a function of the model that returns their argument, by default the model. Derivatives are exact, from one
    compiled program.

    Raises `SimulationError` if a result cannot be computed.
    """
    objectives = {objective.name: objective for objective in objectives_of(results, "result")}
    free = free_parameters(model, {path: None for path, value in parameters(model).items() if np.size(value)})
    evaluator = Evaluator(model, free, {name: objective.function for name, objective in objectives.items()}, run)
    x = free.values(model)
    found, tables = evaluator(x), {}
    if not found.is_good:
        raise SimulationError(f"There are no sensitivities: {found.why}.")
    columns = (evaluator.owners, evaluator.names, found.values.tolist(), found.jacobian)
    for owner, name, value, slopes in zip(*columns, strict=True):
        rows = list(zip(free.names, free.units, x.tolist(), slopes.tolist(), strict=True))
        tables[name] = sensitivity_table(name, objectives[owner].scale, value, rows)
    return tables if isinstance(results, Mapping) else next(iter(tables.values()))
