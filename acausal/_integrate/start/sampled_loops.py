"""Loops through sampled variables: a start at rest of the states alone is no steady state there."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError, listed
from ..._evaluate.dependence import dependence
from ..._evaluate.sampled import Sampler, samplers
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._reduce.element_dependence import element_dependence


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
