"""The vector that is stepped, and where its parts lie."""

import dataclasses
from typing import TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._numbers import Numbers

Vector: TypeAlias = Float[Array, " n"]


@dataclasses.dataclass(frozen=True)
class StateVector:
    """[states, memory, discrete variables, energies lost, peaks, integrals], each part possibly empty.

    `states` are those of the system, in mass-matrix form with its algebraic unknowns. `memory` holds the unknowns of
    the last iterations, and `peaks` values, then times. States and integrals are the *core*, which a solver integrates;
    all between them is *carried* along and changes between steps only.
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
        """States, memory and discrete variables: what the equations are evaluated from."""
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
        """What the solver does not see."""
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
        """The whole vector from the core and what is carried along."""
        return jnp.concatenate([core[: self.n_states], carried, core[self.n_states :]])

    def with_part(self, y: Vector, part: slice, value: Numbers) -> Vector:
        """The vector with another value of one of its parts."""
        return jnp.concatenate([y[: part.start], value, y[part.stop :]])
