"""The sorted system as a sequence of groups: all blocks of a level that share a program are computed together."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.ranges import Ranges, within
from .affine import Minus, computed
from .blocks import Known, residuals, run
from .once import once
from .packing import ModelParameters
from .program import Program, Use

Pair = tuple[int, int]  # a variable and the order of its derivative
Guess = Callable[[Sequence[Pair]], Any]
MANY_RUNS = 64  # values in more pieces than this are gathered by index
UNROLLED = 3  # up to so many alike blocks are written out one by one, more are mapped over


class Place(NamedTuple):
    """Where a value lies: `start` within a flat segment."""

    segment: int
    start: int


class Read(NamedTuple):
    """A gather from segments: `elements[i, j]` is element j of member i in their concatenation."""

    segments: tuple[int, ...]
    elements: np.ndarray
    shape: tuple[int, ...]


@dataclasses.dataclass
class Group:
    """Blocks with one program. `reads` and `members` have an entry for each value and parameter of the program."""

    program: Program
    uses: list[Use]
    reads: list[Read]
    members: list[np.ndarray]
    first_segment: int
    depends: frozenset[int]  # segments it reads

    @property
    def is_mapped(self) -> bool:
        return len(self.uses) > UNROLLED


class Store:
    """Segments computed so far; segment 0 is the state vector."""

    def __init__(self, time: Numbers, segments: dict[int, Any]) -> None:
        self.time, self.segments = time, segments

    def add(self, segment: int, value: Any) -> None:
        """Keep a segment; it may be a `Minus` array."""
        self.segments[segment] = value

    def flat(self, segment: int) -> Array:
        """A segment as a flat array."""
        return jnp.ravel(computed(self.segments[segment]))

    def is_finite(self) -> Array:
        """Whether all that was computed so far is finite."""
        return jnp.all(jnp.isfinite(jnp.concatenate([self.flat(segment) for segment in self.segments])))

    def gather(self, read: Read) -> Array:
        """The values of all members, stacked in front."""
        parts = [self.flat(segment) for segment in read.segments]
        source = parts[0] if len(parts) == 1 else jnp.concatenate(parts)
        index = np.ravel(read.elements)
        if len(index) and np.all(np.diff(index) == 1):
            picked = jax.lax.slice(source, (int(index[0]),), (int(index[-1]) + 1,))
        else:
            picked = source[index]
        return picked.reshape(len(read.elements), *read.shape)

    def single(self, read: Read) -> Any:
        segment = self.segments[read.segments[0]]
        bare = segment.array if isinstance(segment, Minus) else segment
        if np.shape(bare) == read.shape and np.size(read.elements) == np.size(bare):
            return segment
        return self.gather(read)[0]


class Plan:
    """Places of all states and unknowns, and the groups in an order in which each finds its inputs computed.

    `shapes` gives the shape of each variable, `ranges` those of states that have some. States come first, in the flat
    vector y.
    """

    def __init__(
        self,
        uses: Iterable[tuple[int, Use]],
        states: Sequence[Pair],
        shapes: Sequence[tuple[int, ...]],
        ranges: Mapping[Pair, Ranges] | None = None,
    ) -> None:
        self.shapes = shapes
        self.places: dict[Pair, Place] = {}
        self.starts = np.concatenate([[0], np.cumsum([self.size(v) for v, _ in states])]).astype(int)
        for pair, start in zip(states, self.starts.tolist(), strict=False):
            self.places[pair] = Place(0, start)
        self._bounded: dict[Ranges, np.ndarray] = {}  # which elements of the states lie in these ranges
        for pair, own in ranges.items() if ranges else ():
            mask = self._bounded.setdefault(own, np.zeros(int(self.starts[-1]), bool))
            mask[self.places[pair].start + np.arange(self.size(pair[0]))] = True
        self.groups: list[Group] = []
        self._sizes = [int(self.starts[-1])]  # of the segments
        collected: dict[tuple[int, int], list[Use]] = {}
        programs: dict[Program, int] = {}
        for level, use in uses:
            number = programs.setdefault(use.program, len(programs))
            collected.setdefault((level, number), []).append(use)
        for _, members in sorted(collected.items(), key=lambda item: item[0]):
            self._add(members)

    def residual_groups(self, uses: Iterable[Use]) -> list[Group]:
        """Programs without unknowns, alike ones together."""
        collected: dict[Program, list[Use]] = {}
        for use in uses:
            collected.setdefault(use.program, []).append(use)
        return [self._group(members) for members in collected.values()]

    def size(self, variable: int) -> int:
        return math.prod(self.shapes[variable])

    def _add(self, uses: list[Use]) -> None:
        if len(uses) > UNROLLED:
            self._add_group(uses)
        else:
            for use in uses:
                self._add_group([use])

    def _group(self, uses: list[Use]) -> Group:
        program = uses[0].program
        reads = [self.read([use.values[i] for use in uses]) for i in range(len(uses[0].values))]
        members = [np.array([use.members[i] for use in uses]) for i in range(len(program.params))]
        depends = frozenset(segment for read in reads for segment in read.segments)
        return Group(program, uses, reads, members, len(self._sizes), depends)

    def _add_group(self, uses: list[Use]) -> None:
        self.groups.append(self._group(uses))
        for i, shape in enumerate(uses[0].program.shapes):
            size = math.prod(shape)
            for member, use in enumerate(uses):
                self.places[use.gives[i]] = Place(len(self._sizes), member * size)
            self._sizes.append(size * len(uses))

    def read(self, pairs: Sequence[Pair]) -> Read:
        """How to collect the values of pairs that have one shape."""
        places = [self.places[pair] for pair in pairs]
        segments = tuple(sorted({place.segment for place in places}))
        offset, total = {}, 0
        for segment in segments:
            offset[segment] = total
            total += self._sizes[segment]
        starts = np.array([offset[place.segment] + place.start for place in places])
        shape = self.shapes[pairs[0][0]]
        return Read(segments, starts[:, None] + np.arange(math.prod(shape)), shape)

    def needed(self, segments: Iterable[int]) -> list[Group]:
        """The groups that produce these segments, with all that they depend on."""
        wanted, picked = set(segments), []
        for group in reversed(self.groups):
            own = range(group.first_segment, group.first_segment + len(group.program.shapes))
            if wanted.intersection(own):
                picked.append(group)
                wanted |= group.depends
        return picked[::-1]

    def read_for(self, segments: Iterable[int]) -> set[int]:
        """These segments and those that are surely read to compute them."""
        groups = self.needed(segments)
        # Of alike blocks that are computed together, some may be read and others not.
        several = {
            group.first_segment + i
            for group in self.groups
            if len(group.uses) > 1
            for i in range(len(group.program.shapes))
        }
        return set(segments).union(*(group.depends for group in groups)) - several

    def evaluate(
        self,
        y: Array,
        time: Numbers,
        params: ModelParameters,
        guess: Guess,
        wanted: Iterable[Pair],
        also: Iterable[int] = (),
    ) -> Store:
        """Compute the wanted pairs, and further segments, from states `y`, time and parameters.

        `guess(pairs)` gives starting values, stacked, for the tearing variables of non-linear blocks.
        """
        groups = self.needed([*also, *(self.places[pair].segment for pair in wanted)])
        guesses = [_guesses(group, guess) for group in groups]
        chosen = tuple(group.first_segment for group in groups)
        return Store(time, _segments(self, chosen, y, time, params, guesses))

    def within_ranges(self, y: Array) -> Array:
        """The states, NaN where they are outside their ranges."""
        for ranges, is_own in self._bounded.items():
            y = jnp.where(is_own, within(y, ranges), y)
        return y

    def collect(self, store: Store, pairs: Sequence[Pair]) -> Array:
        """The values of pairs as one flat vector, contiguous ones copied together."""
        runs: list[list[int]] = []
        for pair in pairs:
            segment, start = self.places[pair]
            size = self.size(pair[0])
            if runs and runs[-1][0] == segment and runs[-1][2] == start:
                runs[-1][2] += size
            else:
                runs.append([segment, start, start + size])
        if len(runs) > MANY_RUNS:
            return self._gathered(store, pairs)
        parts = [store.flat(segment)[start:stop] for segment, start, stop in runs]
        return jnp.concatenate(parts) if parts else jnp.zeros(0)

    def _gathered(self, store: Store, pairs: Sequence[Pair]) -> Array:
        segments = sorted({self.places[pair].segment for pair in pairs})
        offset = dict(zip(segments, np.cumsum([0, *(self._sizes[s] for s in segments)]).tolist(), strict=False))
        starts = [offset[self.places[pair].segment] + self.places[pair].start for pair in pairs]
        index = np.concatenate(
            [start + np.arange(self.size(pair[0])) for start, pair in zip(starts, pairs, strict=True)]
        )
        return jnp.concatenate([store.flat(segment) for segment in segments])[index]


@ft.partial(jax.jit, static_argnums=(0, 1), inline=True)
def _segments(
    plan: Plan, chosen: tuple[int, ...], y: Array, time: Numbers, params: ModelParameters, guesses: list[list[Any]]
) -> dict[int, Any]:
    """What some groups compute, each named by its first segment; traced once, however often a run asks for it.

    At each place the operations stand among the others there, so that XLA need not put together what calls separate.
    """
    groups = {group.first_segment: group for group in plan.groups}

    def segments() -> dict[int, Any]:
        store = Store(time, {0: plan.within_ranges(y)})
        for first, starts in zip(chosen, guesses, strict=True):
            group = groups[first]
            outputs = (_run_mapped if group.is_mapped else _run_single)(group, store, params, starts)
            for i, value in enumerate(outputs):
                store.add(group.first_segment + i, value)
        return store.segments

    return once(segments)


def _guesses(group: Group, guess: Guess) -> list[Any]:
    """Start values of the tearing variables, stacked over the members; none for blocks that need none."""
    if group.program.kind != "nonlinear":
        return []
    first = len(group.program.steps)
    return [guess([use.gives[i] for use in group.uses]) for i in range(first, len(group.program.shapes))]


def _run_single(group: Group, store: Store, params: ModelParameters, starts: list[Any]) -> list[Any]:
    own = [params.slots[key].of(int(m[0])) for key, m in zip(group.program.params, group.members, strict=True)]
    values = [store.single(read) for read in group.reads]
    return run(group.program, Known(own, values, store.time), [stacked[0] for stacked in starts])


def _run_mapped(group: Group, store: Store, params: ModelParameters, starts: list[Any]) -> list[Any]:
    def one(known: Known, guesses: list[Any]) -> list[Any]:
        return [jnp.asarray(computed(value), float) for value in run(group.program, known, guesses)]

    return over_members(group, store, params, one, starts)


def group_residuals(group: Group, store: Store, params: ModelParameters) -> list[Any]:
    """The residuals of a group without unknowns, stacked over its members."""
    return over_members(group, store, params, lambda known, _: residuals(group.program, known), [])


def over_members(group: Group, store: Store, params: ModelParameters, function: Any, extra: list[Any]) -> list[Any]:
    """Map a function of what a program reads, and of extra stacked values, over the members of a group."""
    own = [params.slots[key].picked(m) for key, m in zip(group.program.params, group.members, strict=True)]
    values = [store.gather(read) for read in group.reads]

    def one(params: list[Array], values: list[Array], extra: list[Any]) -> list[Any]:
        return function(Known(params, values, store.time), extra)

    return jax.vmap(one, axis_size=len(group.uses))(own, values, extra)
