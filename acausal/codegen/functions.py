"""A jaxpr as a C function, and the program of a block: its unknowns directly, or equations that an iteration solves."""

import dataclasses
import functools as ft
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree

from .._evaluate.affine import computed
from .._evaluate.blocks import Known, evaluate_block, residuals_at, with_tears
from .._evaluate.elimination import WRITTEN_OUT
from .._evaluate.program import Program
from .._jax_private import ClosedJaxpr
from .._reduce.incidence import within
from .._reduce.jaxpr import slice_outputs, structs
from .expressions import Names
from .values import CValue, Tables, stored
from .writer import Writer, inlined, wrapped


class Parameter(NamedTuple):
    """An input or output of a C function: a number, or a pointer to the first element of an array."""

    name: str
    shape: tuple[int, ...]
    is_array: bool

    def value(self, *, is_output: bool = False) -> CValue:
        """The input, or the target of an output."""
        if is_output and self.shape == ():
            return stored(f"*{self.name}", (), "f")
        return stored(self.name, self.shape, "f", is_array=self.is_array)


@dataclasses.dataclass(frozen=True)
class CFunction:
    """A C function. A single scalar output is returned; other outputs are written through pointers."""

    name: str
    inputs: tuple[Parameter, ...]
    outputs: tuple[Parameter, ...]
    body: tuple[str, ...]
    comment: str = ""
    takes: tuple[int, ...] = ()  # the positions of its inputs among those of a larger jaxpr

    @property
    def returns(self) -> bool:
        return len(self.outputs) == 1 and not self.outputs[0].is_array

    @property
    def head(self) -> str:
        takes = [f"const double *{p.name}" if p.is_array else f"double {p.name}" for p in self.inputs]
        gives = [] if self.returns else [f"double *{p.name}" for p in self.outputs]
        head = f"static {'double' if self.returns else 'void'} {self.name}({', '.join(takes + gives) or 'void'})"
        return "\n".join(wrapped(head, "    "))

    @property
    def text(self) -> str:
        note = wrapped(f"/* {self.comment} */", "   ") if self.comment else []
        return "\n".join([*note, self.head, "{", *self.body, "}"])


def function_of(
    name: str, closed: ClosedJaxpr, inputs: Sequence[str], outputs: Sequence[str], tables: Tables, where: str,
    comment: str = "", *, vectors: bool = False,
) -> CFunction:  # fmt: skip
    """A jaxpr of floating-point numbers as a C function. With `vectors`, all its inputs and outputs are arrays, also
    those with one element.
    """
    names = Names()

    def declared(words: Sequence[str], avals: Sequence[Any], *, only_arrays: bool) -> tuple[Parameter, ...]:
        shapes = [tuple(aval.shape) for aval in avals]
        return tuple(
            Parameter(names.new(word), shape, only_arrays or int(np.prod(shape)) != 1)
            for word, shape in zip(words, shapes, strict=True)
        )

    takes = declared(inputs, closed.in_avals, only_arrays=vectors)
    gives = declared(outputs, closed.out_avals, only_arrays=vectors or len(outputs) > 1)
    writer = Writer(tables, where, names)
    results = writer.run(inlined(closed), [parameter.value() for parameter in takes])
    function = CFunction(name, takes, gives, (), comment)
    if function.returns:
        with writer.loops(1) as index:
            writer.line(f"return {results[0].at(index).text};")
    else:
        for parameter, value in zip(gives, results, strict=True):
            writer.assign(parameter.value(is_output=True), value)
    # The compiler warns of arguments without use.
    lines = without_unused(writer.lines)
    text = "\n".join(lines)
    every = takes if function.returns else (*takes, *gives)
    unread = [f"    (void){p.name};" for p in every if not re.search(rf"\b{p.name}\b", text)]
    return dataclasses.replace(function, body=tuple(unread + lines))


_DECLARATION = re.compile(r"\s*(?:const )?(?:double|int|unsigned) (\w+)(?:\[\d+\])?(?: = .*)?;$")
_ASSIGNMENT = re.compile(r"\s*(\w+)(?:\[[^=]*\])? = (.*);$")
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


def without_unused(lines: Sequence[str]) -> list[str]:
    """The statements without those that only compute values that nothing reads."""
    kept = list(lines)
    while True:
        declared = {found[1] for line in kept if (found := _DECLARATION.match(line))}
        reads: Counter[str] = Counter()
        for line in kept:
            reads.update(_read(line))
        unused = {name for name in declared if not reads[name]}
        remaining = [line for line in kept if _sets(line) not in unused]
        remaining = _without_empty_blocks(remaining)
        if len(remaining) == len(kept):
            return kept
        kept = remaining


def _sets(line: str) -> str | None:
    """The variable that a statement declares or assigns."""
    found = _DECLARATION.match(line) or _ASSIGNMENT.match(line)
    return found[1] if found else None


def _read(line: str) -> list[str]:
    """The names in a statement, except the variable that it sets; a value set from itself is no use of it."""
    target = _sets(line)
    return [word for word in _WORD.findall(line) if word != target]


def _without_empty_blocks(lines: Sequence[str]) -> list[str]:
    found: list[str] = []
    for line in lines:
        if line.strip() == "}" and found and found[-1].lstrip().startswith("for ") and found[-1].endswith("{"):
            found.pop()
        else:
            found.append(line)
    return found


Shape = tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Direct:
    """A function of some inputs of a program, given by number, that returns all its unknowns."""

    function: CFunction
    reads: tuple[int, ...]
    closed: ClosedJaxpr  # from these inputs to the unknowns


@dataclasses.dataclass(frozen=True)
class Implicit:
    """Equations r(in, x) = 0 of the scaled tearing variables x, with their Jacobian, and the unknowns as functions of
    `in` and x. Vectors are flat; `in` holds all inputs of the program, first the `n_fixed` parameters. `residual` and
    `values` are the same functions of the parameters, the other inputs, and x.
    """

    equations: CFunction
    unknowns: CFunction
    is_linear: bool
    sizes: np.ndarray
    residual: Callable[[Array, Array, Array], Array]
    values: Callable[[Array, Array, Array], list[Array]]
    n_fixed: int
    n_inputs: int


def is_direct(program: Program) -> bool:
    """Whether the unknowns are explicit expressions, possibly after elimination of a small linear system."""
    if program.method == "linear":
        return program.is_elementwise and program.n_tears <= WRITTEN_OUT
    return program.method == "explicit"


@dataclasses.dataclass(frozen=True)
class Source:
    """A program with the shapes of its parameters and values, and a name for its C functions."""

    program: Program
    name: str
    where: str  # the equations, in messages
    param_shapes: tuple[Shape, ...]
    value_shapes: tuple[Shape, ...]
    tables: Tables
    names: Names  # of functions
    comment: str = ""

    @property
    def shapes(self) -> list[Shape]:
        """The shapes of all inputs: parameters, values, and the time."""
        return [*self.param_shapes, *self.value_shapes, ()]

    def named(self, what: str) -> str:
        """The name of another function of the program."""
        return self.names.new(f"{self.name}_{what}")

    def known(self, inputs: Sequence[Array]) -> Known:
        """The inputs as the program reads them; the values of a sum of many flows are one array."""
        n = len(self.param_shapes)
        values = list(inputs[n:-1])
        return Known(list(inputs[:n]), values if self.program.weights is None else [jnp.stack(values)], inputs[-1])

    @ft.cached_property
    def input_names(self) -> list[str]:
        """The name of each input in the equations that read it."""
        n = len(self.param_shapes)
        names = [""] * len(self.shapes)
        names[-1] = "time"
        for step in self.program.steps + self.program.residuals:
            for item, arg in zip(step.template.inputs, step.args, strict=True):
                if arg.source in ("param", "value"):
                    place = arg.number + (n if arg.source == "value" else 0)
                    names[place] = names[place] or _name(step, item)
        return names

    @ft.cached_property
    def output_names(self) -> list[str]:
        names = [""] * len(self.program.shapes)
        for step in self.program.steps + self.program.residuals:
            for item, arg in zip(step.template.inputs, step.args, strict=True):
                if arg.source == "unknown":
                    names[arg.number] = names[arg.number] or _name(step, item)
        return [name or "unknown" for name in names]

    def direct(self) -> Direct:
        def unknowns(*inputs: Array) -> list[Array]:
            found = evaluate_block(self.program, self.known(inputs), [])
            return _shaped(found, self.program.shapes)

        closed, reads = slice_outputs(jax.make_jaxpr(unknowns)(*structs(self.shapes)), slice(None))
        names = [self.input_names[i] for i in reads]
        function = function_of(self.name, closed, names, self.output_names, self.tables, self.where, self.comment)
        return Direct(function, reads, closed)

    def implicit(self) -> Implicit:
        """The equations of a simultaneous block, and its unknowns."""
        program = self.program
        tears = program.shapes[len(program.steps) :]
        nominal = program.sizes if program.method == "nonlinear" else (1.0,) * len(tears)
        sizes = np.repeat(nominal, [math.prod(shape) for shape in tears])
        n_fixed = sum(math.prod(shape) for shape in self.param_shapes)
        n_inputs = sum(math.prod(shape) for shape in self.shapes)
        scaled = (lambda x: x * sizes) if np.any(sizes != 1.0) else (lambda x: x)

        def known(fixed: Array, moving: Array) -> Known:
            n = len(self.param_shapes)
            return self.known([*unpacked(fixed, self.shapes[:n]), *unpacked(moving, self.shapes[n:])])

        def residual(fixed: Array, moving: Array, x: Array) -> Array:
            return ravel_pytree(residuals_at(program, known(fixed, moving), unpacked(scaled(x), tears)))[0]

        def unknowns(fixed: Array, moving: Array, x: Array) -> list[Array]:
            found = with_tears(program, known(fixed, moving), unpacked(scaled(x), tears))
            pairs = zip(_shaped(found, program.shapes), program.ranges, strict=True)
            return [within(value, ranges) if ranges else value for value, ranges in pairs]

        def both(inputs: Array, x: Array) -> tuple[Array, Array]:
            own = inputs[:n_fixed], inputs[n_fixed:]
            return residual(*own, x), jnp.ravel(jax.jacfwd(lambda x: residual(*own, x))(x))

        def values(inputs: Array, x: Array) -> list[Array]:
            return unknowns(inputs[:n_fixed], inputs[n_fixed:], x)

        flat = structs([(n_inputs,), (len(sizes),)])
        equations = function_of(
            self.named("equations"), jax.make_jaxpr(both)(*flat), ["in", "x"], ["residual", "slopes"], self.tables,
            self.where, self.comment, vectors=True,
        )  # fmt: skip
        from_root = function_of(
            self.named("unknowns"), jax.make_jaxpr(values)(*flat), ["in", "x"], self.output_names, self.tables,
            self.where, vectors=True,
        )  # fmt: skip
        is_linear = program.method == "linear"
        return Implicit(equations, from_root, is_linear, sizes, residual, unknowns, n_fixed, n_inputs)


def _name(step, item) -> str:
    owner = step.template.owner
    own = "flow" if owner is None else owner.names[item.slot]
    prefix = "" if not item.order else "der_" if item.order == 1 else f"der{item.order}_"
    return prefix + own


def _shaped(values: Sequence, shapes: Sequence[Shape]) -> list[Array]:
    return [jnp.broadcast_to(jnp.asarray(computed(v), float), shape) for v, shape in zip(values, shapes, strict=True)]


def unpacked(flat: Array, shapes: Sequence[Shape]) -> list[Array]:
    """A flat vector as arrays of these shapes."""
    ends = np.cumsum([0, *(math.prod(shape) for shape in shapes)]).tolist()
    return [flat[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)]
