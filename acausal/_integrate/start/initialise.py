"""`initialise`: consistent start values from conditions on variables and their derivatives, or at rest."""

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.component import Component
from ..._declare.history import Past, past_of, with_past
from ..._declare.layout import complete_leaves, with_leaves
from ..._errors import ModelError, listed
from ..._evaluate.building import check_structure, system_of
from ..._evaluate.dependence import dependence
from ..._evaluate.groups import ModelParameters
from ..._evaluate.initial import given_pairs, given_unknowns, has_modes, is_plain, leaves_of_unknowns
from ..._evaluate.sampled import Sampler, samplers
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._progress import compiling
from ..._reduce.element_dependence import element_dependence
from ..._tracing import is_traced, known
from ..setup.options import check_starts_after_past, flag, instant, names_of
from .no_start import report_no_start
from .problem import Conditions, Problem, problem_of
from .start_search import Outcome, search_start
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
    """Return the model with start values that satisfy the conditions, ready to `simulate` or linearise.

    Only states and given variables have start values in it; the fields of all others are None. Their values at the
    start are those of a run of no length, `simulate(start, 0.0).final`.

    - `conditions(s, d)`: a dictionary of named equations, such as `dict(held=eq(s.rod.f, 300.0), rest=eq(d.pump.w))`,
      in any variables (`s`) and their time derivatives (`d`), both in the shape of the model.
    - `steady`: True: the time derivatives of all states are zero.
    - `free`: names of start values in the model that are only initial guesses, or "all". The default is "all" if
      `steady`, otherwise none: given start values are kept.
    - `moving`: names of states exempt from `steady`, such as the angle of a rotating shaft.
    - `easier`: the same model with other parameters, for which the search is easier. If the direct search fails, a
      homotopy follows its solution while the parameters change to those of `model`. Without `easier`, the homotopy
      reduces the residual at the initial guess to zero.
    - `solve_for`: names of additional unknown parameters, as in `solve_for=["supply.V"]` with a condition on a speed.
      Their values in the model are the initial guesses, and they move before states do. The returned model has the
      values found. Past events use the values in the model.
    - `strict`: raise if the conditions leave a state or such a parameter undetermined. Otherwise, undetermined values
      stay near their start values.

    Switches, diodes, friction and all other components with events are in the mode that the start values imply. Past
    events have fired, and the returned model holds the discrete variables found. It stores the event history up to
    `t0`, so these events fire only once, even if you start the model again.

    The Levenberg-Marquardt method, scaled by nominal sizes, finds the solution nearest to the start values. It is
    differentiable to any order in both modes, as an implicit function, and works under `jit` and `vmap`.

    Raises `ModelError` for unknown names, and for `steady` if the states depend on variables that periodic events
    sample, as with a sampled controller. Raises `SimulationError` if no start is found, and names the contradictory
    conditions, the events without end, or the solved parameter outside its range. With `throw=False`, the start values
    and these parameters are then NaN.
    """
    system, t0 = system_of(model), instant(t0, "t0")
    leaves, _ = complete_leaves(model)
    problem, constants = problem_of(
        system,
        leaves,
        conditions,
        steady=flag(steady, "steady"),
        moving=moving,
        free=free,
        strict=flag(strict, "strict"),
        trimmed=trimmed_leaves(model, names_of(solve_for, "solve_for")),
    )
    check_starts_after_past(system, past_of(model), t0)
    if steady:
        refuse_sampled_loops(system, system.intake.inputs_of(leaves))
    easy = None
    if easier is not None:
        check_structure(easier, system, "The easier model")
        easy = system.intake.enforced(system.intake.parameters(complete_leaves(easier)[0]))
    with compiling("the start", model, search_start):
        outcome, new = _searched(problem, constants, leaves, t0, past_of(model), flag(throw, "throw"), easy)
    if not throw or _is_unknown(outcome):  # a factor, so that the derivatives are NaN too
        factor = jnp.where(outcome.is_bad, jnp.nan, 1.0)
        new = {i: factor * value for i, value in new.items()}
    initialised = with_leaves(model, [new.get(i, leaf) for i, leaf in enumerate(leaves)])
    return with_past(initialised, outcome.past)


def needs_search(system: System, leaves: Sequence[Numbers | None]) -> bool:
    """Whether a search determines the start values of states: that of initial equations, or of given start values of
    variables that depend on states in a way that the modes of the model decide.
    """
    if system.initial_equations is not None:
        return True
    if system.events is None:
        return False
    given = system.intake.given(leaves)
    pairs = given_pairs(system, Inputs(ModelParameters(), np.zeros(0), given))
    return bool(given_unknowns(system, given)) or (has_modes(system) and not is_plain(system, pairs))


def initialised_leaves(
    system: System, leaves: Sequence[Numbers | None], t0: Numbers, past: Past | None, *, throw: bool = True
) -> tuple[list[Numbers | None], Array | None]:
    """The leaves of a model with start values that satisfy the initial equations of its components and the given
    values, followed by the truths that `ifelse` holds there; and a number that is 1 if the search failed and 0
    otherwise. Start values of algebraic unknowns are removed.

    Discrete variables are in the modes that the start values imply, and past events have fired. If the search fails and
    the numbers are known, raises `SimulationError`. Traced, or with `throw=False`, the leaves are then unchanged.
    """
    system = system.solved or system
    check_starts_after_past(system, past, t0)
    problem, constants = problem_of(system, list(leaves))
    outcome, new = _searched(problem, constants, leaves, t0, past, throw)
    if _is_unknown(outcome) or outcome.is_bad:
        starts = [leaf.declaration.guess for leaf in system.flat.leaves]
        before = [jnp.asarray(starts[i] if leaf is None else leaf, float) for i, leaf in enumerate(leaves)]
        new = {i: jnp.where(outcome.is_bad, before[i], new[i]) if i < len(leaves) else new[i] for i in new}
        failed = jnp.asarray(outcome.is_bad, float)
    else:
        failed = jnp.asarray(np.zeros(()))  # as NumPy's, it needs no program of XLA
    found = [new.get(i, leaf) for i, leaf in enumerate(leaves)]
    found += [new[i] for i in range(len(leaves), len(system.flat.leaves))]
    for i in leaves_of_unknowns(system, problem.given, problem.given_unknowns):
        found[i] = None
    return found, failed


def _searched(
    problem: Problem,
    constants: list[Numbers],
    leaves: Sequence[Numbers | None],
    t0: Any,
    past: Past | None,
    throw: bool,
    easy: ModelParameters | None = None,
) -> tuple[Outcome, dict[int, Any]]:
    """The outcome of the search and the new values of leaves by number. Raises `SimulationError` for a failed search
    with known numbers if `throw`.
    """
    intake = problem.system.intake
    intake.check(leaves)
    params = intake.enforced(intake.parameters(leaves))
    t0 = jnp.asarray(t0, float)
    outcome, new = search_start(problem, params, easy, intake.starts.pack(leaves), t0, constants, past)
    if throw and not _is_unknown(outcome):
        report_no_start(problem, jax.tree.map(known, outcome), leaves, new, t0)
    return outcome, new


def _is_unknown(outcome: Outcome) -> bool:
    """Whether the outcome is traced or that of a batch."""
    return is_traced(outcome.is_bad) or np.ndim(outcome.is_bad) > 0


def refuse_sampled_loops(system: System, inputs: Inputs) -> None:
    """Raise `ModelError` if periodic events set variables from the states, and the states depend on these variables."""
    found = [sampler for sampler in samplers(system) if _reads_states(system, sampler)]
    if not found:
        return
    active = _active(system, inputs)
    labels = [label for sampler in found if active.intersection(sampler.entry.targets) for label in sampler.labels]
    if labels:
        raise ModelError(
            f"steady=True: the model has loops through sampled variables, which change at each tick of "
            f"{listed(labels)} and not in between, so no start values of the states alone are a steady state. Remedy: "
            "replace the sampled controller by a continuous one, or simulate until the samples have settled and "
            "continue from sol.final."
        )


def _reads_states(system: System, sampler: Sampler) -> bool:
    """Whether a periodic event reads a variable that depends on states."""
    pairs = {system.pair_of_node(node)[0] for leaf in sampler.read for node in system.flat.leaves[leaf].nodes}
    return dependence(system.plan, [pair for pair in pairs if pair is not None]).nnz > 0


def _active(system: System, inputs: Inputs) -> set[int]:
    """The discrete leaves on which rates of states depend, and the leaves of the states."""
    places = system.carried.discrete_places

    def rates(discrete: jax.Array, inputs: Inputs) -> jax.Array:
        return system.vector_field(0.0, jnp.asarray(system.nominals), dataclasses.replace(inputs, discrete=discrete))

    closed = jax.make_jaxpr(rates)(jnp.zeros(system.carried.n_discrete), inputs)
    structure = element_dependence(closed, [i == 0 for i in range(len(closed.in_avals))])[0]
    columns = set(np.asarray(structure.indices).tolist())
    first = min((own[0] for own in places.values()), default=0)
    states = {int(system.flat.leaf_of_node[system.ordered.table.variables[v]]) for v, _ in system.states}
    return states | {leaf for leaf, own in places.items() if columns.intersection((own - first).tolist())}
