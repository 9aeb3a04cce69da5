"""Calls of C functions on the numbers of a model."""

import dataclasses

import numpy as np

from .functions import CFunction, Implicit
from .layout import Places
from .values import Index
from .writer import Writer


@dataclasses.dataclass(frozen=True)
class GroupEvaluation:
    """An evaluation of each member of a group of similar blocks: where its results go, and what they are."""

    results: tuple[Places, ...]
    comments: tuple[str, ...]

    @property
    def count(self) -> int:
        """The number of members."""
        return len(self.results[0].firsts)

    def comment(self, writer: Writer) -> None:
        """Write the comments."""
        for comment in self.comments:
            writer.comment(comment)


@dataclasses.dataclass(frozen=True)
class Call(GroupEvaluation):
    """A function evaluated for each member."""

    function: CFunction
    arguments: tuple[Places, ...]

    def write(self, writer: Writer) -> None:
        self.comment(writer)
        with writer.loops(self.count) as index:
            inputs = [
                operand(places, index, is_array=p.is_array)
                for places, p in zip(self.arguments, self.function.inputs, strict=True)
            ]
            if self.function.returns:
                result = operand(self.results[0], index, is_array=False)
                writer.line(f"{result} = {self.function.name}({', '.join(inputs)});")
                return
            outputs = [operand(places, index, is_array=True) for places in self.results]
            writer.line(f"{self.function.name}({', '.join(inputs + outputs)});")


@dataclasses.dataclass(frozen=True)
class Solve(GroupEvaluation):
    """Equations that an iteration solves for each member.

    `inputs` fill the vector `in`: the place of the first element of each member, and the number of elements.
    """

    block: Implicit
    inputs: tuple[tuple[Places, int], ...]
    guesses: tuple[Places, ...]  # of its tearing variables, which are adjacent; empty for linear equations

    def write(self, writer: Writer) -> None:
        self.comment(writer)
        block, n = self.block, len(self.block.sizes)
        with writer.block(""), writer.loops(self.count) as index:
            writer.line(f"double in[{max(block.n_inputs, 1)}], x[{n}];")
            self.gather(writer, index)
            name = block.equations.name
            if block.is_linear:
                writer.line(f"solve_linear({name}, in, x, {n});")
            else:
                sizes = writer.tables.of(block.sizes, "f")
                place = index.through(self.guesses[0].firsts).text
                guess = f"m->guess + {place}, start_guess + {place}"
                writer.line(f"m->failures += !solve({name}, in, x, {n}, {sizes}, {guess});")
            outputs = [operand(places, index, is_array=True) for places in self.results]
            writer.line(f"{block.unknowns.name}(in, x, {', '.join(outputs)});")

    def gather(self, writer: Writer, index: Index) -> None:
        """Fill the vector of inputs."""
        start = 0
        for places, size in self.inputs:
            fill(writer, "in", start, places, size, index)
            start += size


def fill(writer: Writer, target: str, start: int, places: Places, size: int, index: Index) -> None:
    """Copy the elements of one operand to a vector, from a start."""
    if size == 1:
        writer.line(f"{target}[{start}] = {operand(places, index, is_array=False)};")
    if size <= 1:
        return
    source = operand(places, index, is_array=True)
    with writer.loops(size) as own:
        name = own.variables[0]
        writer.line(f"{target}[{f'{start} + {name}' if start else name}] = ({source})[{name}];")


def operand(places: Places, index: Index, *, is_array: bool) -> str:
    """The text of an operand of each member, or of a pointer to its first element."""
    sign = "-" if places.sign < 0 else ""
    if places.space in ("", "t", "dt"):
        return sign + places.space if places.space else "0.0"
    where = dataclasses.replace(index, places=np.asarray(places.firsts)[index.places]).text
    return f"{places.space} + {where}" if is_array else f"{sign}{places.space}[{where}]"
