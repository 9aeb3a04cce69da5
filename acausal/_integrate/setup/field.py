"""The vector field of a run: rates of its states and integrals."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from ..._evaluate.groups import Segments
from ..._evaluate.observe import leaf_value, pairs_of
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..._reduce.incidence import Pair
from .schedule import tick
from .settings import RunNumbers, Settings


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class RunArgs:
    """All numbers of a run.

    `carried` is the part of the state vector that is constant during a step. `counted_from` is the time of largest
    magnitude among the start and the origins of periodic events; None if nothing is periodic. `band` is the hysteresis
    of each relation, and `back` the hysteresis of its change back.
    """

    inputs: Inputs
    numbers: RunNumbers
    carried: Any = None
    counted_from: Any = None
    band: Any = None
    back: Any = None

    def carrying(self, carried: Array) -> "RunArgs":
        """A copy with the carried part of the state vector attached."""
        return dataclasses.replace(self, carried=carried)

    @property
    def forward(self) -> Array:
        """1, or -1 for a run backwards in time."""
        return jnp.where(self.numbers.t1 < self.numbers.t0, -1.0, 1.0)

    def tick(self, t: Numbers) -> Numbers:
        """Time resolution: instants closer than this to t are treated as equal."""
        return tick(t, self.numbers.t0 if self.counted_from is None else self.counted_from)


Field = Callable[[Numbers, Array, RunArgs], Array]


def vector_field(settings: Settings) -> Field:
    """The rates of the core of the state vector, as a function of the core and the carried part."""
    system, integrand = settings.system, settings.integrand
    n = len(system.nominals)

    def field(t: Numbers, core: Array, args: RunArgs) -> Array:
        point = jnp.concatenate([core[:n], args.carried])
        if integrand is None or settings.n_integrals == 0:
            rates = system.vector_field_and_store(t, point, args.inputs, [], watch=True)[0]
            return jnp.concatenate([rates, jnp.zeros(settings.n_extra)])
        wanted = wanted_pairs(system, integrand.leaves)
        rates, store = system.vector_field_and_store(t, point, args.inputs, wanted, watch=True)
        values = values_of(system, t, point, args.inputs, store, integrand.leaves)
        integrals = integrand(args.numbers.rates, [values[leaf] for leaf in integrand.leaves])
        return jnp.concatenate([rates, jnp.stack(integrals)])

    return field


def wanted_pairs(system: System, leaves: Iterable[int]) -> list[Pair]:
    """The pairs whose values are needed to evaluate leaves."""
    return pairs_of(system, [leaf for leaf in leaves if system.flat.is_variable(leaf)])


def values_of(
    system: System, t: Numbers, point: Array, inputs: Inputs, store: Segments | None, leaves: Iterable[int]
) -> dict[int, Numbers]:
    """The values of leaves by number: parameters from the inputs, discrete variables from the point, and other
    variables from the store.
    """
    discrete = system.carried.discrete_values(point, inputs)

    def value(leaf: int) -> Numbers:
        if leaf in discrete:
            return discrete[leaf]
        if not system.flat.is_variable(leaf):
            return inputs.params.leaves[leaf]
        assert store is not None
        return leaf_value(system, store, leaf, t)

    return {leaf: value(leaf) for leaf in leaves}
