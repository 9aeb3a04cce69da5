"""Static settings and numeric arguments of a run."""

import dataclasses
import functools as ft

import diffrax
import jax
from jax import Array

from ..._declare.history import Past
from ..._evaluate.observe import pairs_of
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..solvers._rosenbrock import AbstractRosenbrock
from .state_vector import StateVector
from .user_function import UserFunction

STEPS = 256  # maximum steps per call of the program that advances a run in chunks
MOMENTS = 2  # event instants recorded per step, on average
ROOM = 400_000  # bytes for the record of a chunk: XLA compiles loops over up to a million bytes as one function
AT_ONCE = 16  # recorded moments at one instant


@dataclasses.dataclass(frozen=True)
class Settings:
    """Static settings of a run: a change triggers a new compilation."""

    system: System
    stop: UserFunction | None
    integrand: UserFunction | None
    peaks: UserFunction | None
    stored: UserFunction | None  # total stored energy, for the energy lost at events
    direction: bool | None
    save: str
    solver: diffrax.AbstractSolver
    adjoint: diffrax.AbstractAdjoint | None  # None: both modes of differentiation
    max_steps: int
    max_events: int
    progress: diffrax.AbstractProgressMeter
    is_initialised: bool = False  # past events, and those that set modes at the start, have fired
    is_resumed: bool = False  # events due before the start, or true there, have fired
    is_search: bool = False  # events that set more than discrete variables are left to the run

    @property
    def has_events(self) -> bool:
        """Whether the run can have events."""
        system = self.system
        return system.events is not None or self.stop is not None or bool(system.instants.rows)

    @property
    def in_chunks(self) -> "Settings":
        """The settings of the program that advances a run in chunks, independent of the saved values."""
        layout, none = self.layout, diffrax.NoProgressMeter()
        steps = ROOM // (8 * (3 * layout.size + 8 * layout.n_core))
        steps = min(max(steps, 16), STEPS)
        return dataclasses.replace(
            self, save="chunk", adjoint=None, max_steps=steps, max_events=MOMENTS * steps, progress=none
        )

    @property
    def choices(self) -> tuple[tuple[str, str | int | None], ...]:
        """The non-numeric options as text, and the limits on steps and events."""
        solver = f"{type(self.solver).__module__.partition('.')[0]}.{type(self.solver).__name__}"
        adjoint = None if self.adjoint is None else type(self.adjoint).__name__
        direction = {True: "up", False: "down", None: None}[self.direction]
        said = {"save": self.save, "direction": direction, "solver": solver, "adjoint": adjoint}
        return (*said.items(), ("max_steps", self.max_steps), ("max_events", self.max_events))

    @ft.cached_property
    def layout(self) -> StateVector:
        """The layout of the state vector."""
        system, events = self.system, self.system.events
        n = len(system.nominals)
        return StateVector(
            n_states=n,
            n_memory=system.carried.n_memory,
            n_discrete=system.carried.n_discrete,
            n_losses=0 if self.stored is None or events is None else events.total,
            n_peaks=0 if self.peaks is None else self.peaks.n_outputs,
            n_integrals=self.n_extra,
        )

    @property
    def read_by_indicators(self) -> set[int]:
        """The leaves that the event indicators read."""
        events = self.system.events
        return {leaf for part in (events and events.indicators, self.stop) if part for leaf in part.leaves}

    @ft.cached_property
    def is_corrected(self) -> bool:
        """Whether the dense output is corrected by the equations. This applies to Rosenbrock methods if algebraic
        variables are read within steps: they can amplify the interpolation error of the states.
        """
        system = self.system
        if not isinstance(self.solver, AbstractRosenbrock) or not len(system.nominals):
            return False
        leaves = self.read_by_indicators | set(self.peaks.leaves if self.peaks else ())
        read = pairs_of(system, [leaf for leaf in leaves if system.flat.is_variable(leaf)])
        return self.save == "times" or not set(read) <= set(system.states)

    @property
    def keeps_steps(self) -> bool:
        """Whether the steps are recorded."""
        return self.save in ("steps", "dense", "chunk")

    @property
    def n_integrals(self) -> int:
        """The number of requested integrals."""
        return 0 if self.integrand is None else self.integrand.n_outputs

    @property
    def n_extra(self) -> int:
        """The number of computed integrals. It includes a constant if there is nothing else to integrate."""
        return max(self.n_integrals, 0 if len(self.system.nominals) else 1)


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class RunNumbers:
    """The numeric options of a run, and the constants in its functions."""

    t0: Array
    t1: Array
    dt0: Array | None
    dtmin: Array | None
    rtol: Array
    times: Array | None
    stop: list[Numbers]  # constants in the stop condition
    rates: list[Numbers]  # constants in the integrands
    peaks: list[Numbers]  # constants in the functions of the peaks
    stored: list[Numbers]  # constants in the stored energy
    most: Numbers | None = None  # maximum number of steps, if it differs from that of the program
    start_failed: Numbers | None = None  # 1 if no start values satisfy the initial equations of components, else 0
    past: Past | None = None  # event history before the run
    dtmax: Array | None = None
