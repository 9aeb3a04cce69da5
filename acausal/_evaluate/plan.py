"""The sorted system as a sequence of groups: the blocks of a level with a common program are computed together."""

import functools as ft
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._jax_private import INLINE
from .._numbers import Numbers
from .._reduce.incidence import Pair, Ranges, within
from .affine import Value
from .common_subexpressions import once
from .groups import UNROLLED, Group, Guess, ModelParameters, Read, Segments, guesses_of, outputs
from .program import Program, Use

MANY_RUNS = 64  # number of contiguous pieces above which values are gathered by index
FUSED = 8  # largest number of pieces that XLA concatenates together with the operations that compute them


class Slot(NamedTuple):
    """The position of a value: `start` within a flat segment."""

    segment: int
    start: int


class Plan:
    """Positions of all states and unknowns, and the groups in order of computation.

    `shapes` gives the shape of each variable, `ranges` the declared ranges of states. States come first, in the flat
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
        self.places: dict[Pair, Slot] = {}
        self.starts = np.concatenate([[0], np.cumsum([self.size(v) for v, _ in states])]).astype(int)
        for pair, start in zip(states, self.starts.tolist(), strict=False):
            self.places[pair] = Slot(0, start)
        self._bounded: dict[Ranges, np.ndarray] = {}  # the elements of states with these ranges
        for pair, own in ranges.items() if ranges else ():
            mask = self._bounded.setdefault(own, np.zeros(int(self.starts[-1]), bool))
            mask[self.elements(pair)] = True
        self.groups: list[Group] = []
        self._sizes = [int(self.starts[-1])]  # of each segment
        collected: dict[tuple[int, int], list[Use]] = {}
        programs: dict[Program, int] = {}
        for level, use in uses:
            number = programs.setdefault(use.program, len(programs))
            collected.setdefault((level, number), []).append(use)
        for _, members in sorted(collected.items(), key=lambda item: item[0]):
            self._add(members)

    def residual_groups(self, uses: Iterable[Use]) -> list[Group]:
        """Programs without unknowns, similar ones together."""
        collected: dict[Program, list[Use]] = {}
        for use in uses:
            collected.setdefault(use.program, []).append(use)
        return [self._group(members) for members in collected.values()]

    def size(self, variable: int) -> int:
        return math.prod(self.shapes[variable])

    def elements(self, pair: Pair) -> np.ndarray:
        """The positions of the elements of a pair within its segment."""
        return self.places[pair].start + np.arange(self.size(pair[0]))

    def _add(self, uses: list[Use]) -> None:
        if len(uses) > UNROLLED:
            self._add_group(uses)
        else:
            for use in uses:
                self._add_group([use])

    def _group(self, uses: list[Use]) -> Group:
        program = uses[0].program
        if program.weights is None:
            reads = [self.read([use.values[i] for use in uses]) for i in range(len(uses[0].values))]
        else:
            reads = [self.read([pair for use in uses for pair in use.values], len(program.weights))]
        members = [np.array([use.members[i] for use in uses]) for i in range(len(program.params))]
        timed = [np.array([use.timed[i] for use in uses]) for i in range(len(program.timed))]
        depends = frozenset(segment for read in reads for segment in read.segments)
        return Group(program, uses, reads, members, timed, len(self._sizes), depends)

    def _add_group(self, uses: list[Use]) -> None:
        self.groups.append(self._group(uses))
        for i, shape in enumerate(uses[0].program.shapes):
            size = math.prod(shape)
            for member, use in enumerate(uses):
                self.places[use.gives[i]] = Slot(len(self._sizes), member * size)
            self._sizes.append(size * len(uses))

    def read(self, pairs: Sequence[Pair], several: int | None = None) -> Read:
        """The gather of the values of pairs of one shape; or of `several` pairs for each member, stacked."""
        segments, elements = self.positions(pairs)
        shape = self.shapes[pairs[0][0]]
        members = len(pairs) // (several or 1)
        return Read(tuple(segments), elements.reshape(members, -1), shape if several is None else (several, *shape))

    def positions(self, pairs: Sequence[Pair]) -> tuple[list[int], np.ndarray]:
        """The segments of pairs, and the positions of the elements of pairs in the concatenation of these segments."""
        segment, start = np.array([self.places[pair] for pair in pairs], int).reshape(-1, 2).T
        segments, own = np.unique(segment, return_inverse=True)
        first = start + np.cumsum([0, *(self._sizes[number] for number in segments)])[own]
        sizes = np.array([self.size(variable) for variable, _ in pairs], int)
        inside = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        return segments.tolist(), np.repeat(first, sizes) + inside

    def needed(self, segments: Iterable[int]) -> list[Group]:
        """The groups that produce these segments, and all their predecessors."""
        wanted, picked = set(segments), []
        for group in reversed(self.groups):
            own = range(group.first_segment, group.first_segment + len(group.program.shapes))
            if wanted.intersection(own):
                picked.append(group)
                wanted |= group.depends
        return picked[::-1]

    def read_for(self, segments: Iterable[int]) -> set[int]:
        """These segments and those that their computation is sure to read."""
        groups = self.needed(segments)
        # Of similar blocks in a group, some may be read and others not.
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
    ) -> Segments:
        """Compute the wanted pairs, and further segments, from states `y`, time and parameters.

        `guess(pairs)` gives initial guesses of the tearing variables of nonlinear blocks: for each of them one or
        more, tried in sequence until one leads to a solution.
        """
        groups = self.needed([*also, *(self.places[pair].segment for pair in wanted)])
        guesses = [guesses_of(group, guess) for group in groups]
        chosen = tuple(group.first_segment for group in groups)
        return Segments(time, _segments(self, chosen, y, time, params, guesses))

    def within_ranges(self, y: Array) -> Array:
        """The states, NaN outside their ranges."""
        for ranges, is_own in self._bounded.items():
            y = jnp.where(is_own, within(y, ranges), y)
        return y

    def collect(self, store: Segments, pairs: Sequence[Pair]) -> Array:
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
            segments, positions = self.positions(pairs)
            return jnp.concatenate([store.flat(segment) for segment in segments])[positions]
        parts = [store.flat(segment)[start:stop] for segment, start, stop in runs]
        return joined(parts)


def joined(parts: Sequence[Array]) -> Array:
    """The concatenation of flat arrays.

    A few numbers are put in their places one by one: as parts of a concatenation, XLA would compute all that they
    depend on for each of them anew.
    """
    if not 1 < len(parts) <= FUSED or any(part.size != 1 for part in parts):
        return jnp.concatenate(parts) if parts else jnp.zeros(0)
    place = np.arange(len(parts))
    return ft.reduce(lambda total, part: jnp.where(place == part[0], part[1], total), enumerate(parts[1:], 1), parts[0])


@ft.partial(jax.jit, static_argnums=(0, 1), inline=INLINE)
def _segments(
    plan: Plan, chosen: tuple[int, ...], y: Array, time: Numbers, params: ModelParameters, guesses: list[list[Array]]
) -> dict[int, Value]:
    """The outputs of some groups, named by their first segments. Traced once for all calls in a run.

    The operations are inlined, so that XLA need not merge separate calls.
    """
    groups = {group.first_segment: group for group in plan.groups}

    def segments() -> dict[int, Value]:
        store = Segments(time, {0: plan.within_ranges(y)})
        for first, starts in zip(chosen, guesses, strict=True):
            group = groups[first]
            for i, value in enumerate(outputs(group, store, params, starts)):
                store.add(group.first_segment + i, value)
        return store.segments

    return once(segments)
