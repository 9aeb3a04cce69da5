"""The instants at which the equations of a model change their law, computed from time and parameters."""

import dataclasses
from collections.abc import Callable, Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.aliases import TIME, ZERO, Family, Merged
from .._reduce.flat_model import FlatModel
from .._reduce.jaxpr_instants import Instants, Knowledge, instants
from .._reduce.template import Input
from .groups import ModelParameters

_UNKNOWN = -9  # a node without a value known in advance


@dataclasses.dataclass(frozen=True, eq=False)
class _Rows:
    """Equations of one family with equally known inputs.

    `name` is their component kind and name, and `total` the number of components of the kind. `reads` are the
    parameters that they read, by kind and slot, and `members` those of each row; other known inputs are zero.
    """

    found: Instants
    name: tuple[int, str]
    total: int
    reads: tuple[tuple[int, int] | None, ...]  # None: a variable that vanishes
    members: np.ndarray
    shapes: tuple[tuple[int, ...], ...]

    def mapped(self, function: Callable[[list[Array]], Array], params: ModelParameters) -> Numbers:
        """`function(known)` for each row."""

        def one(own: list[Array]) -> Array:
            remaining = iter(own)
            known = [
                jnp.zeros(shape) if key is None else next(remaining)
                for key, shape in zip(self.reads, self.shapes, strict=True)
            ]
            return function(known)

        own = [params.slots[key].picked(self.members) for key in self.reads if key is not None]
        return jax.vmap(one, axis_size=len(self.members))(own)


@dataclasses.dataclass(frozen=True, eq=False)
class EquationInstants:
    """The next instants of all equations, one for each of `total`, and the event indicators without a prediction."""

    rows: tuple[_Rows, ...]

    @property
    def total(self) -> int:
        return sum(len(rows.members) for rows in self.rows if rows.found.n_scheduled)

    @property
    def n_nonlinear(self) -> int:
        """The number of zeros without a prediction."""
        return sum(len(rows.members) * rows.found.n_nonlinear for rows in self.rows)

    def following(self, t: Numbers, params: ModelParameters, forward: Array) -> Array:
        """The next instant of each equation; infinite if there is none."""
        parts = [
            rows.mapped(lambda known, rows=rows: rows.found.following(t, known, forward), params)
            for rows in self.rows
            if rows.found.n_scheduled
        ]
        return jnp.concatenate([jnp.zeros(0), *parts])

    def nonlinear(self, t: Numbers, params: ModelParameters) -> Array:
        """Event indicators whose zeros cannot be predicted."""
        parts = [
            jnp.ravel(rows.mapped(lambda known, rows=rows: rows.found.nonlinear(t, known), params))
            for rows in self.rows
        ]
        return jnp.concatenate([jnp.zeros(0), *parts])

    def ahead(self, scheduled: Array, nonlinear: Array, time: Numbers) -> dict[tuple[int, str], Array]:
        """The time by which equations are ahead: by `time` after one of their instants, by 0 before. The instants that
        have happened are `scheduled`, in the order of `following`, and `nonlinear`.
        """
        ahead: dict[tuple[int, str], Array] = {}
        for rows in self.rows:
            n = len(rows.members)
            m = n * rows.found.n_nonlinear
            own = jnp.any(nonlinear[:m].reshape(n, -1), axis=1)
            if rows.found.n_scheduled:
                own |= scheduled[:n]
                scheduled = scheduled[n:]
            nonlinear = nonlinear[m:]
            others = ahead.get(rows.name, jnp.zeros(rows.total))
            ahead[rows.name] = others.at[rows.members].set(jnp.where(own, time, 0.0))
        return ahead

    @property
    def keys(self) -> set[tuple[int, int]]:
        """The parameters that the instants depend on, by kind and slot."""
        return {key for rows in self.rows for key in rows.reads if key is not None}


def equation_instants(flat: FlatModel, merged: Merged) -> EquationInstants:
    """The instants of the equations of a model."""
    kinds = {id(item): index for index, item in enumerate(flat.instances)}
    return EquationInstants(tuple(rows for family in merged.families for rows in _rows_of(family, kinds)))


def _rows_of(family: Family, kinds: dict[int, int]) -> Iterator[_Rows]:
    inputs = family.template.inputs
    if family.instances is None or not len(family.members):
        return
    placed = np.where((family.nodes == TIME) & (family.signs != 1), _UNKNOWN, family.nodes)
    patterns = np.array([[_word(item, node) for item, node in zip(inputs, row, strict=True)] for row in placed])
    for pattern in np.unique(patterns, axis=0):
        if "time" not in pattern:
            continue
        shapes = [aval.shape for aval in family.template.jaxpr.in_avals]
        found = instants(family.template.jaxpr, [_knowledge(word) for word in pattern], shapes)
        if found is None:
            continue
        known = [i for i, word in enumerate(pattern) if _knowledge(word) == "known"]
        kind, total = kinds[id(family.instances)], family.instances.total
        reads = tuple((kind, inputs[i].slot) if pattern[i] == "known" else None for i in known)
        members = family.members[np.all(patterns == pattern, axis=1)]
        name = (kind, family.template.name)
        yield _Rows(found, name, total, reads, members, tuple(shapes[i] for i in known))


def _word(item: Input, node: int) -> str:
    """Advance knowledge about an input; "zero" is a variable that vanishes."""
    if item.source in ("param", "discrete"):
        return "known"
    if item.source == "time" or (node == TIME and item.order == 0):
        return "time"
    return "zero" if node == ZERO else "unknown"


def _knowledge(word: str) -> Knowledge:
    return "known" if word in ("known", "zero") else "time" if word == "time" else "unknown"
