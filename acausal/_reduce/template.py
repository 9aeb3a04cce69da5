"""An equation shared by all components of a class: its jaxpr, and its time derivative."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from .._jax_private import ClosedJaxpr
from .._numbers import Numbers
from .flat_model import Kind
from .forms import ANY, Coefficient, Form, constant, interpret, parameter, solved_for, variable
from .jaxpr import as_function, slice_output, structs

Source = Literal["param", "discrete", "time", "var"]


class Input(NamedTuple):
    """An input of an equation: a slot of its component kind and, for a variable, the order of its time derivative.

    In scalarised equations, `element` is the index of the element.
    """

    slot: int
    order: int
    source: Source
    element: int = 0

    @property
    def raised(self) -> "Input":
        """The time derivative of a variable."""
        return self._replace(order=self.order + 1)


@dataclasses.dataclass(frozen=True, eq=False)
class Template:
    """An equation as a residual: `jaxpr` maps `inputs` to it. `level` counts its differentiations in time.

    `check_units`: whether to check its units, which applies to the stated form only. `zeros` are the slots and elements
    of the variables that are identically zero where the equation is used.
    """

    name: str
    owner: Kind | None  # None for the sum of flows at a connection
    jaxpr: ClosedJaxpr
    inputs: tuple[Input, ...]
    signs: tuple[frozenset[int], ...]
    level: int = 0
    check_units: bool = True
    zeros: frozenset[tuple[int, int]] = frozenset()

    @property
    def shape(self) -> tuple[int, ...]:
        return self.jaxpr.out_avals[0].shape

    @property
    def _forms(self) -> list[Form]:
        # Neither time nor discrete variables are constant in a run.
        return [
            parameter(signs)
            if item.source == "param"
            else constant(0.0)
            if (item.slot, item.element) in self.zeros
            else variable(i)
            for i, (item, signs) in enumerate(zip(self.inputs, self.signs, strict=True))
        ]

    @ft.cached_property
    def form(self) -> Form:
        return interpret(self.jaxpr, self._forms)[0]

    @ft.cached_property
    def unknowns(self) -> tuple[int, ...]:
        """Positions among `inputs` of the variables that the residual really depends on."""
        return tuple(i for i in sorted(self.form.inputs) if self.inputs[i].source == "var")

    def coefficient(self, position: int) -> Coefficient | None:
        """The factor of an input that enters linearly; None for other inputs."""
        return self.form.terms.get(position)

    def with_zeros(self, positions: Sequence[int]) -> "Template":
        """The same equation for inputs that are identically zero; itself if they are no factors of other inputs."""
        zeros = frozenset((self.inputs[i].slot, self.inputs[i].element) for i in positions)
        made = dataclasses.replace(self, zeros=zeros)
        return self if made.form.inputs == self.form.inputs - set(positions) else made

    @ft.cached_property
    def explicit(self) -> "dict[int, Template]":
        """The equation solved for an input that enters nonlinearly, by its position, where inverse operations do so."""
        found = {i: solved_for(self.jaxpr, self._forms, i) for i in self.form.nonlinear}
        return {i: dataclasses.replace(self, jaxpr=closed) for i, closed in found.items() if closed is not None}

    @ft.cached_property
    def derivative(self) -> "Template":
        """The equation differentiated with respect to time.

        With residual r(p, t, x, x', ...), its derivative is r_t + r_x x' + r_x' x'' + ...: one `jax.jvp` in the
        direction (0, 1, x', x'', ...).
        """
        raised = [item.raised for item in self.inputs if item.source == "var"]
        inputs = self.inputs + tuple(item for item in raised if item not in self.inputs)
        position = {item: i for i, item in enumerate(inputs)}
        residual = as_function(self.jaxpr)

        def derivative(*values: Array) -> Numbers:
            tangents = []
            for item, value in zip(self.inputs, values, strict=False):
                if item.source == "var":
                    tangents.append(values[position[item.raised]])
                else:
                    tangents.append((jnp.ones_like if item.source == "time" else jnp.zeros_like)(value))
            return _rate(residual, values[: len(self.inputs)], tangents, self._only_nonlinear)

        shapes = {
            (item.slot, item.element): aval.shape for item, aval in zip(self.inputs, self.jaxpr.in_avals, strict=True)
        }
        closed = jax.make_jaxpr(derivative)(*structs([shapes[item.slot, item.element] for item in inputs]))
        known = dict(zip(self.inputs, self.signs, strict=True))
        signs = [known.get(item, ANY) for item in inputs]
        rate = sliced(self.name, self.owner, closed, 0, inputs, signs, self.level + 1)
        return dataclasses.replace(rate, zeros=self.zeros)

    @property
    def _only_nonlinear(self) -> int | None:
        """The position of the only scalar that enters nonlinearly, if no coefficient depends on a variable."""
        if len(self.form.nonlinear) != 1 or any(coefficient.on for coefficient in self.form.terms.values()):
            return None
        (position,) = self.form.nonlinear
        return position if self.jaxpr.in_avals[position].shape == () else None

    def differentiated(self, times: int) -> "Template":
        return self if times == 0 else self.derivative.differentiated(times - 1)


def _rate(residual: Callable[..., Array], point: tuple[Array, ...], tangents: list[Array], alone: int | None) -> Array:
    """The derivative of a residual in the direction of `tangents`.

    The slope with respect to a single nonlinear input, `alone`, is computed separately: it often occurs elsewhere too,
    such as the slope of a cam's lift in its torque, and is then computed once.
    """
    if alone is None:
        return jax.jvp(residual, point, tuple(tangents))[1]
    unit = tuple(jnp.full_like(value, float(i == alone)) for i, value in enumerate(point))
    others = tuple(jnp.zeros_like(t) if i == alone else t for i, t in enumerate(tangents))
    return jax.jvp(residual, point, unit)[1] * tangents[alone] + jax.jvp(residual, point, others)[1]


def sliced(
    name: str,
    owner: Kind | None,
    closed: ClosedJaxpr,
    output: int,
    inputs: Sequence[Input],
    signs: Sequence[frozenset[int]],
    level: int,
) -> Template:
    """One output of a jaxpr as a template, with the inputs that it reads."""
    piece = slice_output(closed, output)
    kept = piece.used
    return Template(
        name, owner, piece.jaxpr, tuple(inputs[i] for i in kept), tuple(signs[i] for i in kept), level
    )  # fmt: skip


@ft.cache
def sum_template(factors: tuple[float, ...], shape: tuple[int, ...]) -> Template:
    """A sum with constant factors is zero, such as the flows at a connection of several ports (Kirchhoff's law)."""

    def residual(*values: Array) -> Numbers:
        terms = [v if f == 1 else -v if f == -1 else f * v for v, f in zip(values, factors, strict=True)]
        # In pairs, since the form of a partial sum is as long as the sum.
        while len(terms) > 1:
            terms = [lax.add(*pair) for pair in zip(terms[::2], terms[1::2], strict=False)] + terms[len(terms) & ~1 :]
        return terms[0] if terms else jnp.zeros(shape)

    closed = jax.make_jaxpr(residual)(*structs([shape] * len(factors)))
    inputs = tuple(Input(slot, 0, "var") for slot in range(len(factors)))
    return Template("flows", None, closed, inputs, (ANY,) * len(factors))
