"""The statements of a C function, from the equations of a jaxpr."""

import contextlib
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._errors import ModelError
from .._evaluate.common_subexpressions import without_repetition
from .._jax_private import ClosedJaxpr, JaxprEqn, Literal
from .._reduce.jaxpr import bind, called, differentiable_call, interpreted, shape_of
from .arrays import ARRAYS, CONTROL
from .expressions import ELEMENTWISE, TYPES, Expression, Names, converted, dtype_of, kind_of
from .values import CValue, Index, Tables, constant, stored

LONGEST = 8  # number of operations in one expression
REMEDY = (
    "Remedy: write the equation with functions of jax.numpy that have a C form (see docs/c_code.md), "
    "or replace this component in the exported model."
)


def wrapped(text: str, indent: str) -> list[str]:
    """A text in lines of at most 110 characters, all but the first of them indented."""
    own = text[: len(text) - len(text.lstrip())]
    return textwrap.wrap(text.lstrip(), 110, initial_indent=own, subsequent_indent=indent, break_long_words=False)


class Writer:
    """The statements of a C function so far. `where` names the equation in messages."""

    def __init__(self, tables: Tables, where: str, names: Names | None = None) -> None:
        self.tables, self.where = tables, where
        self.names = Names() if names is None else names
        self.lines: list[str] = []
        self._depth = 1

    def line(self, text: str) -> None:
        self.lines.append("    " * self._depth + text)

    def comment(self, text: str) -> None:
        indent = "    " * self._depth
        self.lines += wrapped(f"{indent}/* {text} */", f"{indent}   ")

    @contextlib.contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Statements in braces."""
        self.line(f"{head} {{".lstrip())
        self._depth += 1
        yield
        self._depth -= 1
        self.line("}")

    @contextlib.contextmanager
    def loops(self, *counts: int) -> Iterator[Index]:
        """Nested loops, none for a count of 1; the index runs over the elements of an array of this shape."""
        with contextlib.ExitStack() as stack:
            variables = [self._loop(stack, count) if count > 1 else "" for count in counts]
            places = np.arange(int(np.prod(counts))).reshape(counts)
            yield Index(places, tuple(variables), self.tables)

    def _loop(self, stack: contextlib.ExitStack, count: int) -> str:
        name = self.names.loop()
        stack.callback(self.names.release, name)
        stack.enter_context(self.block(f"for (int {name} = 0; {name} < {count}; {name}++)"))
        return name

    def declare(self, shape: tuple[int, ...], kind: str, name: str = "a") -> CValue:
        """A new variable or array."""
        found = self.names.new(name)
        size = int(np.prod(shape))
        self.line(f"{TYPES[kind]} {found}{f'[{size}]' if size != 1 else ''};")
        return stored(found, shape, kind)

    def assign(self, target: CValue, value: CValue, places: np.ndarray | None = None) -> None:
        """Store the elements of a value, at some positions of the target."""
        if not value.size:
            return
        with self.loops(value.size) as index:
            where = index if places is None else index.through(places)
            self.line(f"{target.at(where).text} = {value.at(index).text};")

    def kept(self, value: CValue, name: str = "a") -> CValue:
        """The value in a variable, unless reading it costs nothing."""
        if value.cost == 0:
            return value
        if value.size == 1:
            found = self.names.new(name)
            with self.loops(1) as index:
                self.line(f"const {TYPES[value.kind]} {found} = {value.at(index).text};")
            return stored(found, value.shape, value.kind)
        target = self.declare(value.shape, value.kind, name)
        self.assign(target, value)
        return target

    def array(self, value: CValue) -> str:
        """The name of an array with these elements, from which elements at computed positions can be read."""
        if value.known is not None:
            return self.tables.of(value.known, value.kind)
        if value.name and value.size > 1:
            return value.name
        copy = self.declare((max(value.size, 2),), value.kind)  # a single element is an array, too
        self.assign(copy, value)
        return copy.name

    def run(self, closed: ClosedJaxpr, inputs: Sequence[CValue]) -> list[CValue]:
        """The outputs of a jaxpr. A value that is read more than once is stored."""
        jaxpr = closed.jaxpr
        uses = Counter(atom for atom in jaxpr.outvars if not isinstance(atom, Literal))
        needed: list[JaxprEqn] = []
        for eqn in reversed(jaxpr.eqns):
            if any(uses[var] for var in eqn.outvars):
                needed.insert(0, eqn)
                uses.update(atom for atom in eqn.invars if not isinstance(atom, Literal))
        known: dict[Any, CValue] = {}

        def read(atom: Any) -> CValue:
            return constant(np.asarray(atom.val)) if isinstance(atom, Literal) else known[atom]

        def note(var: Any, value: CValue) -> None:
            known[var] = self.kept(value) if uses[var] > 1 or value.cost > LONGEST else value

        for var, value in zip(jaxpr.invars, inputs, strict=True):
            note(var, value)
        for var, array in zip(jaxpr.constvars, closed.consts, strict=True):
            known[var] = constant(np.asarray(array))
        for eqn in needed:
            for var, value in zip(eqn.outvars, self.equation(eqn, [read(a) for a in eqn.invars]), strict=True):
                note(var, value)
        return [read(atom) for atom in jaxpr.outvars]

    def equation(self, eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
        """The results of one equation of a jaxpr. Arrays without elements are known."""
        pairs = zip(args, eqn.invars, strict=True)
        args = [value if value.size else constant(np.zeros(value.shape, dtype_of(atom))) for value, atom in pairs]
        if (args and all(arg.known is not None for arg in args)) or eqn.primitive.name == "iota":
            with jax.ensure_compile_time_eval():
                return [constant(np.asarray(x)) for x in bind(eqn, [jnp.asarray(arg.known) for arg in args])]
        inner = called(eqn) or differentiable_call(eqn)
        if inner is not None:
            return self.run(inner, args)
        name = eqn.primitive.name
        if name in ELEMENTWISE:
            return [self.elementwise(eqn, args)]
        if name == "convert_element_type":
            return [_converted(eqn, args[0])]
        rule = ARRAYS.get(name) or CONTROL.get(name)
        if rule is None:
            raise ModelError(f"{self.where} uses `{name}`, which has no C form. {REMEDY}")
        return rule(self, eqn, args)

    def elementwise(self, eqn: JaxprEqn, args: Sequence[CValue]) -> CValue:
        """An operation on the elements of arrays, where axes of length 1 are repeated."""
        shape = shape_of(eqn.outvars[0])
        rule, kind = ELEMENTWISE[eqn.primitive.name], args[-1].kind
        spread = [arg if arg.shape == shape else self.repeated(arg, shape) for arg in args]

        def at(index: Index) -> Expression:
            return rule(kind, eqn.params, *(arg.at(index) for arg in spread))

        return CValue(shape, kind_of(eqn.outvars[0]), at, 1 + sum(arg.cost for arg in args))

    def repeated(self, value: CValue, shape: tuple[int, ...]) -> CValue:
        """A value broadcast to a shape; it is computed once."""
        places = np.broadcast_to(np.arange(value.size).reshape(value.shape), shape)
        return self.kept(value).moved(places)


def inlined(closed: ClosedJaxpr) -> ClosedJaxpr:
    """A jaxpr without calls, repeated operations and unused results."""

    def outputs(eqn: JaxprEqn, args: list[Any]) -> Sequence[Any]:
        inner = called(eqn) or differentiable_call(eqn)
        return bind(eqn, args) if inner is None else interpreted(inner, args, outputs, jnp.asarray)

    structs = [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in closed.in_avals]
    flat = jax.make_jaxpr(lambda *inputs: interpreted(closed, inputs, outputs, jnp.asarray))(*structs)
    return without_repetition(flat)


def _converted(eqn: JaxprEqn, value: CValue) -> CValue:
    kind = kind_of(eqn.outvars[0])
    return CValue(value.shape, kind, lambda index: converted(value.at(index), value.kind, kind), value.cost + 1)
