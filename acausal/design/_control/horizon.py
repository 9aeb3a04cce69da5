"""A model with its signals over a horizon, in one piece or in segments.

Multiple shooting: the states at the inner ends of segments are free, and continuity between segments is a constraint.
Errors then grow over one segment only, and all segments share one compiled run. See Bock and Plitt, A multiple shooting
algorithm for direct solution of optimal control problems, Proc. 9th IFAC World Congress (1984) 242-247.
"""

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._analyse.operating_point import operating_point
from ..._declare.annotations import Param, Scalar, Vector, positive
from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, suggestion
from ..._evaluate.building import system_of
from ..._integrate.results.solution import Solution
from .._problem.free import Free
from .._problem.free_parameters import free_parameters

RunBetween = Callable[..., Solution]  # of a model, a start time and an end time
SHOWN = 400  # samples of a trajectory
SMALL = 1e-6  # relative size of a state below which its nominal value is its size
_MEMBER = re.compile(r"\[\d+\]\.")


class Horizon(Component):
    """A model with the free numbers of its horizon."""

    plant: Component
    duration: Param[Scalar, "s", positive]  # of the horizon, if its intervals keep their shares
    intervals: Param[Vector, "s", positive]  # between the samples of signals
    nodes: Param[Vector, "1"]  # deviations of states at the ends of segments, in their sizes


class Nodes(NamedTuple):
    """Guess of the `states` at the inner ends of segments, a row for each."""

    states: Free
    guess: np.ndarray
    sizes: np.ndarray


class Runs(NamedTuple):
    """The runs of all pieces, the duration, and the `gaps` between segments relative to the sizes of the states."""

    solution: Solution
    duration: Array
    gaps: Array


@dataclasses.dataclass(frozen=True)
class Shooting:
    """Multiple shooting by `run(model, t0, t1)`; `signals` are the paths of the signals.

    The horizon has `segments`, which start from free states. A segment has `pieces`, each of which starts from the end
    of the piece before. Without `nodes`, the horizon is one run.
    """

    signals: Sequence[str]
    segments: int
    pieces: int
    switching: bool  # whether each interval is free
    run: RunBetween
    nodes: Nodes | None = None

    def times(self, horizon: Horizon) -> Array:
        """Times of the samples, starting at zero."""
        shares = horizon.intervals / (1.0 if self.switching else jnp.sum(horizon.intervals) / horizon.duration)
        return jnp.concatenate([jnp.zeros(1), jnp.cumsum(shares)])

    def model(self, horizon: Horizon) -> Component:
        """The model with the times of its signals."""
        times = self.times(horizon)
        return replace(horizon.plant, {f"{signal}.times": times for signal in self.signals})

    def __call__(self, horizon: Horizon) -> Runs:
        """The runs of all pieces."""
        times, model = self.times(horizon), self.model(horizon)
        if self.nodes is None:
            return Runs(self.run(model, times[0], times[-1]), times[-1], jnp.zeros(0))
        piece, starts = self._piece(model), self._starts(model, horizon)

        def segment(start: Array, tables: PyTree) -> tuple[Array, Solution]:
            def go_on(state: Array, table: PyTree) -> tuple[Array, Solution]:
                solution = piece(state, *table)
                return ends(solution), solution

            return jax.lax.scan(go_on, start, tables)

        # One by one: vectorised segments would wait for the slowest one.
        ended, solution = jax.lax.map(lambda each: segment(*each), (starts, self._tables(model, times)))
        solution = jax.tree_util.tree_map(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]), solution)
        return Runs(solution, times[-1], (ended[:-1] - starts[1:]) / self.nodes.sizes)

    def solutions(self, horizon: Horizon) -> Iterator[Solution]:
        """The runs of the pieces one by one."""
        times, model = self.times(horizon), self.model(horizon)
        if self.nodes is None:
            yield self.run(model, times[0], times[-1], save=jnp.linspace(times[0], times[-1], SHOWN))
            return
        shown = max(SHOWN // (self.segments * self.pieces), 2)
        piece = self._piece(model)
        tables = self._tables(model, times)
        for i, start in enumerate(self._starts(model, horizon)):
            for j in range(self.pieces):
                table = jax.tree_util.tree_map(lambda x, i=i, j=j: x[i, j], tables)
                found = piece(start, *table, save=jnp.linspace(table[0][0], table[0][-1], shown))
                start = ends(found)
                yield found

    def _starts(self, model: Component, horizon: Horizon) -> Array:
        """The initial states of the segments."""
        assert self.nodes is not None
        first = operating_point(model, system_of(model), None, 0.0).y
        inner = self.nodes.guess + self.nodes.sizes * horizon.nodes.reshape(self.nodes.guess.shape)
        return jnp.concatenate([first[None], inner])

    def _piece(self, model: Component) -> RunBetween:
        """The run of a piece as a function of its initial state, and of the times and values of its samples."""
        assert self.nodes is not None
        blank, states = without_starts(model, self.nodes.states), self.nodes.states

        def piece(start: Array, times: Array, samples: PyTree, **options: Any) -> Solution:
            tables = {f"{signal}.times": times for signal in self.signals}
            tables |= {f"{signal}.values": values for signal, values in zip(self.signals, samples, strict=True)}
            return self.run(replace(states.with_values(blank, start), tables), times[0], times[-1], **options)

        return piece

    def _tables(self, model: Component, times: Array) -> tuple[Array, list[Array]]:
        """Times and samples of all signals, by segments and pieces."""
        values = {leaf.path: leaf.value for leaf in leaves_of(model)}
        samples = [values[f"{signal}.values"] for signal in self.signals]
        return self._cut(times, len(times) - 1), [self._cut(each, len(times) - 1) for each in samples]

    def _cut(self, samples: Array, intervals: int) -> Array:
        """Samples by segments and pieces. Neighbouring pieces share a sample at a time, but not one of an interval."""
        n, more = intervals // (self.segments * self.pieces), len(samples) - intervals
        places = np.arange(0, intervals, n)[:, None] + np.arange(n + more)
        return samples[places.reshape(self.segments, self.pieces, -1)]


def ends(solution: Solution) -> Array:
    """Final state vectors of runs."""
    return solution._end[1][..., solution._layout.states]


def without_starts(model: Any, states: Free) -> Any:
    """A copy of the model without start values, except those of its states."""
    mine = {place.path for variable in states.variables for place in variable.places}
    return replace(
        model, {leaf.path: None for leaf in leaves_of(model) if leaf.declaration.is_variable and leaf.path not in mine}
    )


def nodes_of(model: Component, run: RunBetween, times: np.ndarray, given: Mapping[str, object]) -> Nodes:
    """States at the inner times, from a run or interpolated from given values."""
    system = system_of(model)
    if system.initial_equations is not None:
        raise ModelError("A model with initial equations cannot start in between. Give start values instead.")
    if hidden := [name for name in system.state_names if name.startswith("der(")]:
        raise ModelError(f"States without start values cannot be free between segments: {', '.join(hidden)}.")
    for name in given:
        if name not in system.state_names:
            raise ModelError(f"guess names {name!r}, which is not a state.{suggestion(name, system.state_names)}")
    found = run(model, times[0], times[-1], save=times, throw=False)
    # Only a given start value can be free.
    known = {leaf.path: leaf.value for leaf in leaves_of(found.final)}
    wanted = {_MEMBER.sub(".item.", name) for name in system.state_names}
    states = free_parameters(replace(model, {path: known[path] for path in wanted}), dict.fromkeys(system.state_names))
    reached = np.asarray(found.ys)
    # The last state continues a failed run.
    guess = np.concatenate([reached, np.repeat(reached[-1:], len(times) - len(reached), axis=0)])
    for i, name in enumerate(states.names):
        if name in given:
            values = np.asarray(given[name], float)
            guess[:, i] = np.interp(times, np.linspace(times[0], times[-1], len(values)), values)
    sizes = np.max(np.abs(guess), axis=0)
    nominals = np.asarray(system.nominals)
    return Nodes(states, guess[1:-1], np.where(sizes > SMALL * nominals, sizes, nominals))
