"""`choose`: the best combination of alternatives from catalogues."""

import functools as ft
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._errors import ModelError, SimulationError, suggestion
from .._problem.limits import Objective, limits_of, objectives_of
from .._problem.types import Executor, Function
from .._sweep.batches import COMPUTED, Batch, Outcomes, code_names, message_of
from .._sweep.pieces import compile_together, evaluated, store_of
from .._sweep.sweep import chunk_of
from .alternatives import DesignSpace, design_space, on_pair, run_of_pair
from .choice import Choice, ChoiceProblem

M = TypeVar("M", bound=Component)
Table = Sequence[Mapping[Any, Any]]
Tables = Mapping[str, Table]


def choose(
    model: M | Mapping[str, M],
    tables: Tables | Mapping[str, Tables],
    minimise: object,
    *,
    run: Function | None = None,
    constraints: Mapping[str, object] | None = None,
    failures: Mapping[str, str] | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool | None = None,
) -> Choice[M]:
    """Computes all combinations of alternatives, ranks the feasible ones, and gives the reasons against the others.

        choose(
            drive,
            {"motor": [{"name": "A", "motor.emf.k": 0.02, "motor.resistor.R": "0.3 ohm"}, {"name": "B", ...}],
             "gear": [{"gear.ratio": 5.0, "figures": {"mass": "0.3 kg"}}, ...]},
            {"time": (lambda s: s.t1, "ms"), "mass": (lambda s, parts: parts["gear"]["mass"], "g")},
            run=lambda m: simulate(m, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end"),
            constraints={"final speed": (lambda s: s.final.load.w, "<= 100 rpm")},
        )

    - `model`: a model, or several by name with different structures, such as one with a cam and one with a pump. Each
      has its own tables by that name, and runs as its own batch.
    - `tables`: tables by title. A table is a list of dictionaries with values by path (or a `pandas.DataFrame`), with
      the same paths in all rows and an optional "name". Values are in declared units, quantities or texts with a unit.
      "figures" are numbers that are not parameters of the model: a mass, a price, a largest speed.
    - `minimise`, `run`, `constraints`: as in `optimise`. The first of several objectives ranks the combinations, and
      all of them define the front. A function of two arguments also receives the figures, by table and name, in SI
      units.
    - `failures`: reasons against combinations whose run fails, by the name of the `Result`:
      `{"never_stopped": "not open within 150 ms"}`.
    - `store`, `executor`, `progress`: as in `sweep`; each of several models has its own store in the folder.

    Raises `ModelError` or `ParameterError` for invalid tables, and `SimulationError` if no combination can be computed.
    """
    objectives, limits = objectives_of(minimise), limits_of(constraints)
    if unknown := [name for name in failures or {} if name not in code_names()]:
        raise ModelError(f"{unknown[0]!r} is not a failure.{suggestion(unknown[0], code_names())}")
    if twice := [o.name for o in objectives if o.name in limits]:
        raise ModelError(f"{twice[0]} is the name of an objective and of a constraint. Rename one.")
    structures = _structures(model, tables)
    functions = {o.name: on_pair(o.function) for o in objectives}
    functions |= {name: on_pair(function) for name, (function, _) in limits.items()}
    of_pair = None if run is None else ft.partial(run_of_pair, run)
    batches = [Batch(one.model, one.variables, functions, of_pair) for one in structures]
    columns = [batch.columns for batch in batches]
    owners = columns[0][1]
    for structure, (_, own) in zip(structures, columns, strict=True):
        _check_owners(structure, own, owners, objectives)
    for batch in batches:
        batch.progress = progress
    if executor is None:
        compile_together(batches, [structure.x for structure in structures])
    found: list[Outcomes] = []
    for structure, batch, (names, _) in zip(structures, batches, columns, strict=True):
        if found and not np.all(found[-1].are_finished):
            found.append(Outcomes.interrupted(len(structure.x), len(names)))
            continue
        size = chunk_of(len(structure.x))
        path = Path(store) / structure.name if store is not None and structure.name else store
        kept = store_of(path, batch, names, structure.x, size)
        what = " of ".join(filter(None, ["combinations", structure.name]))
        found.append(evaluated(batch, structure.x, what, executor=executor, chunk=size, store=kept, progress=progress))
    results, codes = np.concatenate([one.values for one in found]), np.concatenate([one.codes for one in found])
    if not np.any(codes == COMPUTED):
        raise SimulationError(f"None of {len(codes)} combinations could be computed: {message_of(int(codes[0]))}")
    values = np.where((codes == COMPUTED)[:, None], results[:, [owners.index(o.name) for o in objectives]], np.nan)
    stated = [(limits[owner][1], i) for i, owner in enumerate(owners) if owner in limits]
    excess = [np.asarray(limit.excess(results[:, i])) for limit, i in stated]
    table = np.stack(excess, axis=1) if excess else np.zeros((len(codes), 0))
    problem = ChoiceProblem(
        minimise if isinstance(minimise, Mapping) else {"objective": minimise}, constraints or {}, run, failures or {}
    )
    return Choice(structures, objectives, tuple(limit for limit, _ in stated), values, table, codes, problem)


def _structures(model: Any, tables: Any) -> tuple[DesignSpace, ...]:
    if not isinstance(model, Mapping):
        return (design_space("", model, tables),)
    if not model or not isinstance(tables, Mapping) or model.keys() != tables.keys():
        raise ModelError(f"Give the tables of several models by the names of the models: {', '.join(model)}.")
    return tuple(design_space(name, one, tables[name]) for name, one in model.items())


def _check_owners(
    structure: DesignSpace, own: Sequence[str], first: Sequence[str], objectives: Sequence[Objective]
) -> None:
    for name in (objective.name for objective in objectives):
        if own.count(name) != 1:
            raise ModelError(f"{name} must return one number, but returned {own.count(name)}.")
    if other := [name for name in own if own.count(name) != first.count(name)]:
        raise ModelError(
            f"{other[0]} returned {own.count(other[0])} numbers for {structure.name}, but {first.count(other[0])} "
            "for the first model. Return equally many."
        )
