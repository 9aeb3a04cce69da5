"""The layout of the state vector."""

import dataclasses
from typing import TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._numbers import Numbers

Vector: TypeAlias = Float[Array, " n"]


@dataclasses.dataclass(frozen=True)
class StateVector:
    """[states, memory, discrete variables, energies lost, peaks, integrals], each part possibly empty.

    `states` are those of the system, and in mass-matrix form also its algebraic unknowns. `memory` holds the unknowns
    of the last iterations, for warm starts, and `peaks` holds values, then times. States and integrals form the *core*,
    which the solver integrates. The parts between them are *carried* and change only between steps.
    """

    n_states: int
    n_memory: int
    n_discrete: int
    n_losses: int
    n_peaks: int
    n_integrals: int

    @property
    def states(self) -> slice:
        return slice(0, self.n_states)

    @property
    def memory(self) -> slice:
        return slice(self.n_states, self.n_states + self.n_memory)

    @property
    def discrete(self) -> slice:
        return slice(self.memory.stop, self.memory.stop + self.n_discrete)

    @property
    def point(self) -> slice:
        """States, memory and discrete variables: the arguments of the equations."""
        return slice(0, self.discrete.stop)

    @property
    def losses(self) -> slice:
        return slice(self.discrete.stop, self.discrete.stop + self.n_losses)

    @property
    def peaks(self) -> slice:
        return slice(self.losses.stop, self.losses.stop + 2 * self.n_peaks)

    @property
    def integrals(self) -> slice:
        return slice(self.peaks.stop, self.peaks.stop + self.n_integrals)

    @property
    def carried(self) -> slice:
        """The parts that the solver does not integrate."""
        return slice(self.memory.start, self.peaks.stop)

    @property
    def size(self) -> int:
        return self.integrals.stop

    def core(self, y: Vector) -> Vector:
        """States and integrals."""
        return jnp.concatenate([y[self.states], y[self.integrals]]) if self.size > self.n_core else y

    @property
    def n_core(self) -> int:
        return self.n_states + self.n_integrals

    def joined(self, core: Vector, carried: Vector) -> Vector:
        """The whole vector, assembled from the core and the carried parts."""
        return jnp.concatenate([core[: self.n_states], carried, core[self.n_states :]])

    def with_part(self, y: Vector, part: slice, value: Numbers) -> Vector:
        """A copy of the vector with a new value of one part."""
        return jnp.concatenate([y[: part.start], value, y[part.stop :]])
