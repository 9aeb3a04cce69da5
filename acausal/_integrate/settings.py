"""What a run is compiled for, and the numbers that it is called with."""

import dataclasses
from typing import Any

import diffrax
import jax

from .._evaluate.system import System
from .quantity import Quantity


@dataclasses.dataclass(frozen=True)
class Settings:
    """What a run is compiled for."""

    system: System
    stop: Quantity | None
    integrand: Quantity | None
    stored: Quantity | None  # the energy in all components, for the account of what events take
    direction: bool | None
    save: str
    solver: diffrax.AbstractSolver
    adjoint: diffrax.AbstractAdjoint
    max_steps: int
    max_events: int
    given: frozenset[int]  # the leaves whose start values are given
    progress: diffrax.AbstractProgressMeter

    @property
    def n_states(self) -> int:
        """The length of the state vector with the memory and the discrete variables that follow it."""
        return self.system.extended_size

    @property
    def n_switched(self) -> int:
        """What events change besides states: the discrete variables, the energies lost, and a flag."""
        system = self.system
        if system.happenings is None:
            return 0
        return 1 + self.n_losses + system.extended_size - len(system.nominals) - system.memory_size

    @property
    def n_losses(self) -> int:
        """Energies lost at events, one for each."""
        happenings = self.system.happenings
        return 0 if self.stored is None or happenings is None else happenings.total

    @property
    def n_integrals(self) -> int:
        """How many integrals follow the states in the vector that is integrated."""
        return 0 if self.integrand is None else self.integrand.n_outputs

    @property
    def n_extra(self) -> int:
        """What follows the states: the integrals, or a constant where there would be nothing to integrate."""
        return max(self.n_integrals, 0 if len(self.system.nominals) else 1)


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class Numbers:
    """What a compiled run is called with. `params` has the leaves of the model, None where they are variables."""

    params: list[Any]
    packed: Any  # the same by class, for a model of many parts, of which `params` then has only what is read singly
    starts: Any
    t0: Any
    t1: Any
    dt0: Any
    dtmin: Any
    rtol: Any
    times: Any
    stop: list[Any]  # numbers in the stop condition
    rates: list[Any]  # numbers in the integrands
    stored: list[Any]  # and in the energy
