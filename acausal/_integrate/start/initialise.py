"""`initialise`: start values from conditions on any variable and its derivative, or from rest."""

from collections.abc import Sequence
from typing import Any, TypeVar

import jax.numpy as jnp
import numpy as np

from ..._declare.component import Component
from ..._declare.layout import complete_leaves, with_leaves
from ..._declare.past import past_of, with_past
from ..._evaluate.building import check_structure, system_of
from ..._progress import compiling
from ..._tracing import is_traced
from ..setup.options import check_begun_late, flag, instant, names_of
from .no_start import report_no_start
from .problem import Conditions, problem_of
from .start_search import search_start
from .trim import trimmed_leaves

M = TypeVar("M", bound=Component)


def initialise(
    model: M,
    conditions: Conditions | None = None,
    *,
    steady: bool = False,
    free: Sequence[str] | str | None = None,
    moving: Sequence[str] | str = (),
    easier: M | None = None,
    t0: Any = 0.0,
    solve_for: Sequence[str] | str = (),
    strict: bool = False,
    throw: bool = True,
) -> M:
    """The model with start values that satisfy conditions; `simulate` it, or linearise it there.

    - `conditions(s, d)`: a dictionary of named equations, as in `dict(held=eq(s.rod.f, 300.0), rest=eq(d.pump.w))`,
      between any variables (`s`) and their time derivatives (`d`), both in the shape of the model.
    - `steady`: all states are at rest, their derivatives zero.
    - `free`: names of start values in the model that are only guesses, or "all". By default all of them where `steady`,
      else none: start values that are given are kept.
    - `moving`: names of states whose derivatives need not vanish where `steady`, as the angle of a shaft that turns.
    - `easier`: the same model with other parameters, for which the search is easier: its solution is followed while the
      parameters change to those of `model` (a homotopy), should the direct search fail. Without it, what the conditions
      lack at the first guess is taken away bit by bit.
    - `solve_for`: names of parameters that are searched for, too, as in `solve_for=["supply.V"]` with a condition on a
      speed. They start from the values in the model and move before states do, and the model returned has the values
      found. Past events happen with the values in the model.
    - `strict`: raise where the conditions leave a state or such a parameter undetermined. Otherwise what they leave
      open stays near its start value.

    Switches, diodes, friction and whatever else changes by events is in the mode that the start values imply, past
    events have happened, and the model returned holds the discrete variables that were found. It knows what has
    happened by `t0`: that happens once, however often it is started again.

    The nearest solution to the start values is found by Levenberg and Marquardt's method, in nominal sizes. It is
    differentiable to any order in both modes, as an implicit function, and works under `jit` and `vmap`.

    Raises `ModelError` for names that do not exist and `SimulationError` where no start is found, naming the conditions
    that contradict each other, the events that come to no end, or a parameter found that is outside its range; with
    `throw=False` the start values and these parameters are then NaN.
    """
    system, t0 = system_of(model), instant(t0, "t0")
    leaves, _ = complete_leaves(model)
    trimmed = trimmed_leaves(model, names_of(solve_for, "solve_for"))
    problem, constants = problem_of(
        system,
        leaves,
        conditions,
        steady=flag(steady, "steady"),
        moving=moving,
        free=free,
        strict=flag(strict, "strict"),
        trimmed=trimmed,
    )
    check_begun_late(system, past_of(model), t0)
    if easier is not None:
        check_structure(easier, system, "The easier model")
    system.intake.check(leaves)
    params = system.intake.enforced(system.intake.parameters(leaves))
    easy = None if easier is None else system.intake.enforced(system.intake.parameters(complete_leaves(easier)[0]))
    starts = system.intake.starts.pack(leaves)
    with compiling("the start", model, search_start):
        outcome, new = search_start(problem, params, easy, starts, jnp.asarray(t0), constants, past_of(model))
    if flag(throw, "throw") and not is_traced(outcome.is_bad) and not np.ndim(outcome.is_bad):
        report_no_start(problem, outcome, leaves, new, t0)
    else:  # a factor, of which the derivatives are not a number either
        factor = jnp.where(outcome.is_bad, jnp.nan, 1.0)
        new = {i: factor * value for i, value in new.items()}
    started = with_leaves(model, [new.get(i, leaf) for i, leaf in enumerate(leaves)])
    return with_past(started, outcome.past)
