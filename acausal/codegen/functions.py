"""A jaxpr as a C function."""

import dataclasses
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._jax_private import ClosedJaxpr
from .expressions import Names
from .unused import without_unused
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
