"""Packed parameters, and groups of similar blocks that are evaluated together: from and to flat segments."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.flat_model import FlatLeaf, FlatModel
from .._reduce.incidence import Pair
from .._tracing import is_traced
from .affine import Minus, Value, computed
from .blocks import Known, evaluate_block, residuals
from .program import Program, Use

SEPARATE = 8  # number of members of a kind up to which each has its own number; more share an array


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class SlotValues:
    """One parameter of all components of a kind: separate `members` if they are few, otherwise one array."""

    members: Any

    def of(self, member: int) -> Array:
        """The value of one member."""
        return self.members[member]

    @property
    def stacked(self) -> Array:
        """The values of all members as one array."""
        if isinstance(self.members, tuple):
            return jnp.stack([jnp.asarray(value) for value in self.members])
        return self.members

    def picked(self, members: np.ndarray) -> Array:
        """The values of some members as one array."""
        array = self.stacked
        if np.array_equal(members, np.arange(len(array))):
            return array
        if np.all(np.diff(members) == 1):
            return jax.lax.slice_in_dim(array, int(members[0]), int(members[-1]) + 1)
        return array[members]


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class ModelParameters:
    """Parameters and discrete variables of a model: `slots` by component kind and slot, for the equations, and `leaves`
    by number, for functions of the whole model.

    `ahead` is the time by which equations are ahead, by component kind and name, an element for each member. It is
    empty except between the events of one instant.
    """

    slots: dict[tuple[int, int], SlotValues] = dataclasses.field(default_factory=dict)
    leaves: dict[int, Numbers] = dataclasses.field(default_factory=dict)
    ahead: dict[tuple[int, str], Array] = dataclasses.field(default_factory=dict)

    def changed(self, values: Mapping[int, Numbers]) -> "ModelParameters":
        """A copy with other values of some leaves; the slots must be filled again."""
        return ModelParameters(leaves=self.leaves | dict(values))


def discrete_start(leaf: FlatLeaf, value: Numbers | None) -> Any:
    if leaf.declaration.role != "discrete":
        return value
    value = leaf.declaration.guess if value is None else value
    shape = leaf.stack + leaf.sizes
    return jnp.broadcast_to(value, shape) if shape else value


def slot_values(flat: FlatModel, leaves: Mapping[int, Numbers], kind: int, slot: int) -> SlotValues:
    """One parameter of a component kind, from leaves by number."""
    instances = flat.holders[kind]
    sizes = instances.kind.sizes[slot]
    values = [leaves[instances.leaf(entry, slot)] for entry in range(len(instances.paths))]
    if instances.total > SEPARATE:
        # The host collects thousands of separate numbers fastest.
        xp = jnp if any(is_traced(value) for value in values) else np
        return SlotValues(xp.concatenate([xp.reshape(xp.asarray(value), (-1, *sizes)) for value in values]))
    members: list[Numbers] = []
    for value, stack in zip(values, instances.stacks, strict=True):
        members += list(jnp.reshape(value, (-1, *sizes))) if stack else [value]
    return SlotValues(tuple(members))


Guess = Callable[[Sequence[Pair]], Array]
T = TypeVar("T")
UNROLLED = 3  # number of similar blocks up to which they are evaluated one by one, more by a map


class Read(NamedTuple):
    """A gather from segments: `elements[i, j]` is element j of member i in their concatenation."""

    segments: tuple[int, ...]
    elements: np.ndarray
    shape: tuple[int, ...]


@dataclasses.dataclass
class Group:
    """Blocks with one program. `reads`, `members` and `timed` have an entry for each value, parameter and timed
    equation of the program.
    """

    program: Program
    uses: list[Use]
    reads: list[Read]
    members: list[np.ndarray]
    timed: list[np.ndarray]
    first_segment: int
    depends: frozenset[int]  # segments that it reads

    @property
    def is_mapped(self) -> bool:
        return len(self.uses) > UNROLLED

    def ahead(self, params: ModelParameters) -> list[Array]:
        """The time by which each timed equation is ahead, over the members; empty if none can be."""
        if params.ahead.keys().isdisjoint(self.program.timed):
            return []
        own = zip(self.program.timed, self.timed, strict=True)
        return [params.ahead[key][members] if key in params.ahead else jnp.zeros(len(members)) for key, members in own]


class Segments:
    """The segments computed so far; segment 0 is the state vector."""

    def __init__(self, time: Numbers, segments: dict[int, Value]) -> None:
        self.time, self.segments = time, segments

    def add(self, segment: int, value: Value) -> None:
        """Store a segment, possibly as a `Minus` array."""
        self.segments[segment] = value

    def flat(self, segment: int) -> Array:
        """A segment as a flat array."""
        return jnp.ravel(computed(self.segments[segment]))

    def is_finite(self) -> Array:
        """Whether all values computed so far are finite."""
        by_shape: dict[tuple[int, ...], Array] = {}
        for value in self.segments.values():
            bare = jnp.asarray(value.array if isinstance(value, Minus) else value)
            by_shape[bare.shape] = by_shape.get(bare.shape, jnp.asarray(True)) & jnp.isfinite(bare)
        return jnp.all(jnp.stack([jnp.all(are_finite) for are_finite in by_shape.values()]))

    def gather(self, read: Read) -> Array:
        """The values of all members, stacked along the first axis."""
        parts = [self.flat(segment) for segment in read.segments]
        source = parts[0] if len(parts) == 1 else jnp.concatenate(parts)
        index = np.ravel(read.elements)
        if len(index) and np.all(np.diff(index) == 1):
            picked = jax.lax.slice(source, (int(index[0]),), (int(index[-1]) + 1,))
        else:
            picked = source[index]
        return picked.reshape(len(read.elements), *read.shape)

    def single(self, read: Read) -> Value:
        segment = self.segments[read.segments[0]]
        bare = segment.array if isinstance(segment, Minus) else segment
        if np.shape(bare) == read.shape and np.size(read.elements) == np.size(bare):
            return segment
        return self.gather(read)[0]


def guesses_of(group: Group, guess: Guess) -> list[Array]:
    """Initial guesses of the tearing variables, shape [members, tries, ...]. Empty for linear blocks."""
    if group.program.method != "nonlinear":
        return []
    first = len(group.program.steps)
    return [guess([use.gives[i] for use in group.uses]) for i in range(first, len(group.program.shapes))]


def outputs(group: Group, store: Segments, params: ModelParameters, starts: list[Array]) -> Sequence[Value]:
    """The outputs of a group, one segment for each unknown of its program."""
    return (_run_mapped if group.is_mapped else _run_single)(group, store, params, starts)


def _run_single(group: Group, store: Segments, params: ModelParameters, starts: list[Array]) -> Sequence[Value]:
    return evaluate_block(group.program, _known(group, store, params), [stacked[0] for stacked in starts])


def _known(group: Group, store: Segments, params: ModelParameters) -> Known:
    """The inputs of the program of a group with one member."""
    own = [params.slots[key].of(int(m[0])) for key, m in zip(group.program.params, group.members, strict=True)]
    ahead = [each[0] for each in group.ahead(params)]
    return Known(own, [store.single(read) for read in group.reads], store.time, ahead)


def _run_mapped(group: Group, store: Segments, params: ModelParameters, starts: list[Array]) -> Sequence[Value]:
    def one(known: Known, guesses: list[Array]) -> list[Array]:
        return [jnp.asarray(computed(value), float) for value in evaluate_block(group.program, known, guesses)]

    return over_members(group, store, params, one, starts)


def group_residuals(group: Group, store: Segments, params: ModelParameters) -> list[Array]:
    """The residuals of a group without unknowns, stacked over its members."""
    return over_members(group, store, params, lambda known, _: residuals(group.program, known), [])


def over_members(
    group: Group,
    store: Segments,
    params: ModelParameters,
    function: Callable[[Known, list[Array]], T],
    extra: list[Array],
) -> T:
    """Map a function of the inputs of a program, and of extra stacked values, over the members of a group."""
    if len(group.uses) == 1:
        return jax.tree.map(lambda x: x[None], function(_known(group, store, params), [x[0] for x in extra]))
    own = [params.slots[key].picked(m) for key, m in zip(group.program.params, group.members, strict=True)]
    values = [store.gather(read) for read in group.reads]

    def one(params: list[Array], values: list[Array], ahead: list[Array], extra: list[Array]) -> T:
        return function(Known(params, values, store.time, ahead), extra)

    return jax.vmap(one, axis_size=len(group.uses))(own, values, group.ahead(params), extra)
