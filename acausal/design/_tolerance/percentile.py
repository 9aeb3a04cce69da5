"""A percentile of a result as a function of the design, for designs that most specimens keep up with."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ParameterError
from ..._integrate.result import is_success
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
    """The p-th percentile of a result among `n` members about any design, as a function of that design.

        slow = percentile_of(drive, {"motor.resistor.R": Normal(std="5 %")}, lambda s: s.t1, 95.0, run=...)
        optimise(drive, {"gear.ratio": (2.0, 20.0)}, (slow, "ms"))

    The members are the same for all designs, from a Sobol sequence, so that the percentile is a smooth function with an
    exact gradient, but for kinks where members change places. A parameter with a relative tolerance scatters by that
    share of its value in the design, any other by the same differences as about `model`. The other arguments are those
    of `Tolerance`.
    """
    if not 0.0 <= p <= 100.0:
        raise ParameterError(f"A percentile is between 0 and 100, got {p}.")
    joint = JointDistribution.of(model, distributions, correlation)
    free, x0 = joint.free, joint.free.values(model)
    members = joint.parameters_at(sobol_scores(len(x0), member_count(n), seed))
    is_share = np.array([distribution.is_relative for distribution in distributions.values()])
    factors = np.where(is_share, members / np.where(is_share & (x0 != 0.0), x0, 1.0), 1.0)
    offsets = np.where(is_share, 0.0, members - x0)
    evaluator = Evaluator(model, free, {"result": result}, run)

    def percentile(design: PyTree) -> Array:
        leaves = {leaf.path: leaf.value for leaf in leaves_of(design)}
        places = [variable.places[0] for variable in free.variables]
        base = jnp.stack([leaves[path] if at is None else leaves[path][at] for path, at in places])

        def one(pair: PyTree) -> Array:
            values, outcomes = evaluator.results(free.with_values(design, base * pair[0] + pair[1]))
            is_good = jnp.all(jnp.stack([jnp.ones((), bool), *map(is_success, outcomes)]))
            return jnp.where(is_good, values, jnp.nan)

        values = jax.lax.map(one, (jnp.asarray(factors), jnp.asarray(offsets)))
        return jnp.percentile(values, p)

    return percentile
