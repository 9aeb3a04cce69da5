"""New values of variables at events, and the states that constraints tie to them."""

import dataclasses
import functools as ft
import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._evaluate.blocks import Known, residuals
from .._evaluate.constraints import GIVEN, STATE, TOLERANCE
from .._evaluate.groups import Group
from .._evaluate.observe import constrained_places
from .._reduce.jaxpr import structs
from .calls import fill
from .functions import CFunction, function_of, unpacked
from .layout import Places
from .model import CModel
from .values import Index
from .write import array, function, part
from .writer import Writer


@dataclasses.dataclass(frozen=True, eq=False)
class Resets:
    """The variables that events set, other than discrete ones.

    All variables below their highest derivatives form the vector z. If events set only states, these are changed
    directly. Otherwise z moves to the nearest point at which the constraints hold with the new values.
    """

    model: CModel
    leaves: tuple[int, ...]

    @ft.cached_property
    def is_tied(self) -> bool:
        """Whether events set variables that are no states."""
        is_state = self.model.system.constraints.is_state
        return not all(is_state[self.places(leaf)[0]].all() for leaf in self.leaves)

    def places(self, leaf: int) -> tuple[np.ndarray, np.ndarray]:
        """The positions of the elements of a leaf in z, and their signs."""
        return constrained_places(self.model.system, leaf)

    def state_places(self, places: np.ndarray) -> np.ndarray:
        """The positions of elements of z in the state vector."""
        constraints = self.model.system.constraints
        found = dict(zip(constraints.states.tolist(), constraints.in_state_vector.tolist(), strict=True))
        return np.array([found[place] for place in places.tolist()])

    @ft.cached_property
    def _groups(self) -> list[Group]:
        """The sets of constraints that contain variables which events set."""
        touched = np.concatenate([np.zeros(0, int), *(self.places(leaf)[0] for leaf in self.leaves)])
        groups = self.model.system.constraints.groups
        return [group for group in groups if any(np.isin(read.elements, touched).any() for read in group.reads)]

    def functions(self) -> list[str]:
        """The functions that move z and the states, if constraints tie them."""
        if not self.is_tied:
            return []
        model, constraints = self.model, self.model.system.constraints
        pairs = [model.layout.place(pair) + np.arange(model.system.plan.size(pair[0])) for pair in constraints.pairs]
        most = max(self._count(group)[0] for group in self._groups)
        own = [self._set(group, number) for number, group in enumerate(self._groups)]
        return [
            f"#define N_TIED {len(constraints.sizes)}\n#define MAX_TIED {most} /* in one set of constraints */",
            f"#define TOLERANCE {TOLERANCE!r} /* accepted error of a new value, relative to its nominal size */",
            array("tied", np.concatenate(pairs), "i"),
            array("size_of_tied", constraints.sizes),
            array("is_state", constraints.is_state.astype(int), "i"),
            array("tied_state", constraints.states, "i"),
            array("state_of_tied", constraints.in_state_vector, "i"),
            part("project"),
            *(item.text for item in own),
            self._onto_constraints(own),
            part("follow").replace("MODEL", model.name),
        ]

    def _count(self, group: Group) -> tuple[int, int]:
        """The numbers of variables and of equations of a set of constraints."""
        shapes = [step.template.shape for step in group.program.residuals]
        return sum(read.elements.shape[1] for read in group.reads), sum(map(math.prod, shapes))

    def _set(self, group: Group, number: int) -> CFunction:
        """The constraints of a set and their derivatives, as functions of its variables."""
        holders, program = self.model.system.flat.holders, group.program
        shapes = [holders[kind].kind.sizes[slot] for kind, slot in program.params]
        of_values = [read.shape for read in group.reads]

        def both(inputs: Array, y: Array) -> tuple[Array, Array]:
            params = unpacked(inputs[:-1], shapes)

            def missing(y: Array) -> Array:
                known = Known(params, unpacked(y, of_values), inputs[-1])
                return jnp.concatenate([jnp.ravel(value) for value in residuals(program, known)])

            return missing(y), jnp.ravel(jax.jacfwd(missing)(y))

        n_inputs = 1 + sum(map(math.prod, shapes))
        closed = jax.make_jaxpr(both)(*structs([(n_inputs,), (self._count(group)[0],)]))
        names = self.model.system.constraints.names
        return function_of(
            f"constraints_{number + 1}", closed, ["in", "y"], ["residual", "slopes"], self.model.tables,
            f"The constraint {names[0]}", vectors=True,
        )  # fmt: skip

    def _onto_constraints(self, own: Sequence[CFunction]) -> str:
        model = self.model
        writer = Writer(model.tables, model.name)
        for group, item in zip(self._groups, own, strict=True):
            self._project(writer, group, item)
        writer.line("return 1;")
        head = f"static int onto_constraints(const {model.name} *m, double *z, const int *is_set)"
        return function(head, writer.lines, unread=("m",), is_constant=True)

    def _project(self, writer: Writer, group: Group, item: CFunction) -> None:
        n, m = self._count(group)
        places = np.concatenate([read.elements.reshape(len(group.uses), -1) for read in group.reads], axis=1)
        keys = zip(group.program.params, group.members, strict=True)
        params = [(self.model.layout.members(key, members), self._size(key)) for key, members in keys]
        params.append((Places("t", np.zeros(len(group.uses), int)), 1))
        given, state = math.sqrt(GIVEN), math.sqrt(STATE)
        with writer.block(""), writer.loops(len(group.uses)) as index:
            writer.line(f"double in[{item.inputs[0].shape[0]}], y[{n}], size[{n}], root[{n}];")
            start = 0
            for own, size in params:
                fill(writer, "in", start, own, size, index)
                start += size
            with writer.loops(n) as inner:
                where = Index(places, (*index.variables, *inner.variables), writer.tables).text
                k = inner.variables[0] or "0"
                writer.line(f"y[{k}] = z[{where}];")
                writer.line(f"size[{k}] = size_of_tied[{where}];")
                writer.line(f"root[{k}] = is_set[{where}] ? {given!r} : is_state[{where}] ? {state!r} : 1.0;")
            writer.line(f"if (!project({item.name}, in, y, size, root, {n}, {m}))")
            writer.line("    return 0;")
            with writer.loops(n) as inner:
                where = Index(places, (*index.variables, *inner.variables), writer.tables).text
                writer.line(f"z[{where}] = y[{inner.variables[0] or '0'}];")

    def _size(self, key: tuple[int, int]) -> int:
        kind, slot = key
        return math.prod(self.model.system.flat.holders[kind].kind.sizes[slot])
