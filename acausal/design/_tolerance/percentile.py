"""`percentile_of`: a percentile of a result as a function of the design, for robust optimisation."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, ParameterError
from ..._integrate.setup.result import is_success
from .._compute.evaluator import Evaluator
from .._problem.distributions import Distribution, member_count, sobol_scores
from .._problem.types import ByPath, Function
from .joint import JointDistribution


def percentile_of(
    model: Component,
    distributions: ByPath[Distribution],
    result: Function,
    p: float,
    *,
    run: Function | None = None,
    correlation: Mapping[tuple[str, str], float] | None = None,
    n: int = 64,
    seed: int = 0,
) -> Function:
    """The p-th percentile of a result among `n` members around a design, as a function of the design.

        slow = percentile_of(drive, {"motor.resistor.R": Normal(std="5 %")}, lambda s: s.t1, 95.0, run=...)
        optimise(drive, {"gear.ratio": (2.0, 20.0)}, (slow, "ms"))

    All designs share the members of a Sobol sequence, so the percentile has an exact gradient and is smooth, except for
    kinks where the order of members changes. A relative tolerance scales with the value in the design, an absolute one
    does not. The other arguments are those of `Tolerance`.
    """
    if not 0.0 <= p <= 100.0:
        raise ParameterError(f"A percentile must be between 0 and 100, got {p}.")
    joint = JointDistribution.of(model, distributions, correlation)
    free, x0 = joint.free, joint.free.values(model)
    for place in (variable.places[0] for variable in free.variables):
        if place.built is not None:
            names = ", ".join(sorted(place.determined))
            raise ModelError(f"percentile_of: {place.path} is a constructor argument. Name instead: {names}.")
    members = joint.parameters_at(sobol_scores(len(x0), member_count(n), seed))
    is_share = np.array([distribution.is_relative for distribution in distributions.values()])
    factors = np.where(is_share, members / np.where(is_share & (x0 != 0.0), x0, 1.0), 1.0)
    offsets = np.where(is_share, 0.0, members - x0)
    evaluator = Evaluator(model, free, {"result": result}, run)

    def percentile(design: PyTree) -> Array:
        leaves = {leaf.path: leaf.value for leaf in leaves_of(design)}
        places = [variable.places[0] for variable in free.variables]
        base = jnp.stack([leaves[path] if at is None else leaves[path][at] for path, at, _ in places])

        def one(pair: PyTree) -> Array:
            values, outcomes = evaluator.results(free.with_values(design, base * pair[0] + pair[1]))
            is_good = jnp.all(jnp.stack([jnp.ones((), bool), *map(is_success, outcomes)]))
            return jnp.where(is_good, values, jnp.nan)

        values = jax.lax.map(one, (jnp.asarray(factors), jnp.asarray(offsets)))
        return jnp.percentile(values, p)

    return percentile
