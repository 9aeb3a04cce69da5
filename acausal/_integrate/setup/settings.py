"""What a run is compiled for, and the numbers that it is called with."""

import dataclasses
import functools as ft

import diffrax
import jax
from jax import Array

from ..._declare.past import Past
from ..._evaluate.observe import pairs_of
from ..._evaluate.system import System
from ..._numbers import Numbers
from ..solvers._rosenbrock import AbstractRosenbrock
from .state_vector import StateVector
from .user_function import UserFunction

STEPS = 256  # most steps at a time, where a run is a program that is called again and again
MOMENTS = 2  # at which something happens, that it has room for in a step, on average
ROOM = 400_000  # bytes that they take: XLA compiles loops over up to a million bytes as one function
AT_ONCE = 16  # moments of one instant that are recorded


@dataclasses.dataclass(frozen=True)
class Settings:
    """What a run is compiled for."""

    system: System
    stop: UserFunction | None
    integrand: UserFunction | None
    peaks: UserFunction | None
    stored: UserFunction | None  # the energy in all components, for the account of what events take
    direction: bool | None
    save: str
    solver: diffrax.AbstractSolver
    adjoint: diffrax.AbstractAdjoint | None  # None for both modes
    max_steps: int
    max_events: int
    progress: diffrax.AbstractProgressMeter
    is_started: bool = False  # whether past events, and those that set modes at the start, have happened
    is_resumed: bool = False  # whether all that was due before the start, or is true there, has happened
    is_search: bool = False  # whether what sets more than discrete variables waits for the start of a run

    @property
    def has_events(self) -> bool:
        """Whether anything can happen in the run."""
        system = self.system
        return system.events is not None or self.stop is not None or bool(system.instants.rows)

    @property
    def in_chunks(self) -> "Settings":
        """The settings of the program that runs some steps at a time, whatever is read of them afterwards."""
        layout, none = self.layout, diffrax.NoProgressMeter()
        steps = ROOM // (8 * (3 * layout.size + 8 * layout.n_core))
        steps = min(max(steps, 16), STEPS)
        return dataclasses.replace(
            self, save="chunk", adjoint=None, max_steps=steps, max_events=MOMENTS * steps, progress=none
        )

    @property
    def choices(self) -> tuple[tuple[str, str | int | None], ...]:
        """The options that are no numbers, as text, and the limits."""
        solver = f"{type(self.solver).__module__.partition('.')[0]}.{type(self.solver).__name__}"
        adjoint = None if self.adjoint is None else type(self.adjoint).__name__
        direction = {True: "up", False: "down", None: None}[self.direction]
        said = {"save": self.save, "direction": direction, "solver": solver, "adjoint": adjoint}
        return (*said.items(), ("max_steps", self.max_steps), ("max_events", self.max_events))

    @ft.cached_property
    def layout(self) -> StateVector:
        """The vector that is stepped."""
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
    def read_by_margins(self) -> set[int]:
        """The leaves that the margins of events are computed from."""
        events = self.system.events
        return {leaf for part in (events and events.margins, self.stop) if part for leaf in part.leaves}

    @ft.cached_property
    def follows_course(self) -> bool:
        """Whether anything is read within steps that follows from equations, by a method whose dense output can be
        corrected. States are as accurate there as they are integrated, but what follows may multiply their errors.
        """
        system = self.system
        if not isinstance(self.solver, AbstractRosenbrock) or not len(system.nominals):
            return False
        leaves = self.read_by_margins | set(self.peaks.leaves if self.peaks else ())
        read = pairs_of(system, [leaf for leaf in leaves if system.flat.is_variable(leaf)])
        return self.save == "times" or not set(read) <= set(system.states)

    @property
    def keeps_steps(self) -> bool:
        """Whether the steps are recorded."""
        return self.save in ("steps", "dense", "chunk")

    @property
    def n_integrals(self) -> int:
        """How many integrals are asked for."""
        return 0 if self.integrand is None else self.integrand.n_outputs

    @property
    def n_extra(self) -> int:
        """The integrals that are computed: a constant where there would be nothing to integrate."""
        return max(self.n_integrals, 0 if len(self.system.nominals) else 1)


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class RunNumbers:
    """The options of a run that are numbers, and the numbers in its functions."""

    t0: Array
    t1: Array
    dt0: Array | None
    dtmin: Array | None
    rtol: Array
    times: Array | None
    stop: list[Numbers]  # numbers in the stop condition
    rates: list[Numbers]  # numbers in the integrands
    peaks: list[Numbers]  # in the functions whose peaks are wanted
    stored: list[Numbers]  # and in the energy
    most: Numbers | None = None  # most steps, if they are not those that a program has room for
    unmet: Numbers | None = None  # 1 where no start values meet the initial equations of components, else 0
    past: Past | None = None  # what has happened before the run
    dtmax: Array | None = None
