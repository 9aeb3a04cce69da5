"""Statements (Modelica 3.6, chapter 11)."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from .._syntax import expressions as e
from .._syntax.visits import nodes
from . import references
from . import tree as t
from .builtins import arguments
from .calls import as_type
from .classes import join
from .expressions import Expressions
from .source import TextError
from .typed import (
    CONSTANT,
    DISCRETE,
    NONE,
    PARAMETER,
    STRING,
    Typed,
    accepts,
    element,
    indices,
    same_dims,
    written_dims,
)


class NeedsUnrolling(Exception):
    """A statement assigns a component whose index varies in a loop."""

    def __init__(self, error: TextError) -> None:
        super().__init__(str(error))
        self.error = error


@dataclasses.dataclass
class Statements:
    """Makes statements in a class instance."""

    here: Expressions
    is_initial: bool = False
    in_clause: bool = False  # of `if`, `for` or `while`
    in_loop: bool = False

    @property
    def is_function(self) -> bool:
        return self.here.scope.whole.is_function

    def whole(self, clauses: Sequence[t.Clause]) -> e.Body:
        """The statements of a section."""
        try:
            return self.body(clauses)
        except NeedsUnrolling as needed:
            raise needed.error from None

    def body(self, clauses: Sequence[t.Clause]) -> e.Body:
        return tuple(statement for clause in clauses for statement in self.statement(clause))

    def statement(self, x: t.Clause) -> tuple[e.Statement, ...]:
        """The statements that one in the text means. Raises `TextError`."""
        match x:
            case t.Assignment():
                return self._assignment(x)
            case t.CallEquation():
                return (self.call(x.call),)
            case t.IfClause():
                return self._if(x)
            case t.ForClause():
                return self._for(x.iterators, x.body)
            case t.WhileClause():
                condition = self.here.boolean(x.condition, "the condition of `while`").x
                return (e.While(condition, self._inside(in_loop=True).body(x.body)),)
            case t.WhenClause():
                return (self._when(x),)
            case t.Return():
                if not self.is_function:
                    raise self.here.error(x.at, "`return` is allowed in functions only.")
                return (e.Return(),)
            case t.Break():
                if not self.in_loop:
                    raise self.here.error(x.at, "`break` is allowed in `for` and `while` only.")
                return (e.BreakStatement(),)
        raise self.here.error(x.at, "an equation is not allowed in an algorithm.")

    def _assignment(self, x: t.Assignment) -> tuple[e.Statement, ...]:
        value = self.here.typed(x.right)
        if isinstance(x.left, t.Tuple):
            if len(x.left.elements) > max(len(value.results), 1):
                raise self.here.error(
                    x.at, f"the left side has {len(x.left.elements)} variables for {len(value.results)} results."
                )
            if not isinstance(x.right, t.Call):
                raise self.here.error(x.right.at, "several variables can be assigned by the call of a function only.")
            targets = [
                None if left is None else self._target(left, *self._checked(left, result))
                for left, result in zip(x.left.elements, value.results, strict=False)
            ]
            return (e.Assign(tuple(targets), value.x),)
        value = self.here.single(x.right)
        found, wanted = self._checked(x.left, value, is_converted=True)
        value = as_type(self.here, wanted.type, value) or value
        check_discrete(self.here, x.left, wanted, value, is_when=self.here.in_when or self.is_function)
        if isinstance(wanted.x, e.ArrayOf) and not found.components[0].is_local:
            return self._elements(x, wanted.x, value.x)
        return (e.Assign((self._target(x.left, found, wanted),), value.x),)

    def _elements(self, x: t.Assignment, left: e.ArrayOf, right: e.Expression) -> tuple[e.Statement, ...]:
        """The assignments of a part of an array of components, one for each variable."""
        found = list(_assigned(left, right))
        names = {one.targets[0].name for one in found if one.targets[0] is not None}
        if any(isinstance(x, e.Ref) and x.name in names for x in nodes(right)):
            raise self.here.error(x.at, f"{x.left} names several variables, and its value cannot read them.")
        return tuple(found)

    def _checked(
        self, left: t.Expression, value: Typed, *, is_converted: bool = False
    ) -> tuple[references.Chain, Typed]:
        """The variable that gets a value. Raises `TextError` if type or size do not fit."""
        here = self.here
        if not isinstance(left, t.Reference):
            raise here.error(left.at, "only variables can be assigned.")
        if left.parts[0].name in here.names:
            raise here.error(left.at, f"{left} is the iterator of a loop, and cannot be assigned.")
        found = references.find(here, left)
        if not isinstance(found, references.Chain):
            raise here.error(left.at, f"{left} is no variable, and cannot be assigned.")
        first = found.components[0]
        if first.is_local and first.causality == "input":
            raise here.error(left.at, f"{left} is an input of the function, and cannot be assigned.")
        if not first.is_local and first.holder.component is None and first.causality == "input":
            raise here.error(left.at, f"{left} is an input of the model, and cannot be assigned.")
        fixed = ("constant",) if first.is_local or self.is_initial else ("constant", "parameter")
        if found.last.variability in fixed:
            raise here.error(left.at, f"{left} is a {found.last.variability}, and cannot be assigned.")
        wanted = here.typed(left)
        if wanted.type.name in ("component", "function", "object"):
            raise here.error(left.at, f"{left} is a {wanted.type}, and cannot be assigned.")
        fits = as_type(here, wanted.type, value) if is_converted else accepts(wanted.type, value.type)
        if not fits:
            raise here.error(left.at, f"{left} is of type {wanted.type}, and cannot get a value of type {value.type}.")
        if not same_dims(wanted.dims, value.dims):
            raise here.error(
                left.at, f"{left} has size {written_dims(wanted.dims)}, and cannot get {written_dims(value.dims)}."
            )
        return found, wanted

    def _target(self, left: t.Expression, found: references.Chain, wanted: Typed) -> e.Target:
        if found.components[0].is_local:
            # An array of records is a record of arrays where functions are executed.
            subs: list[e.Expression] = []
            for component, part in zip(found.components, found.parts, strict=True):
                own = self.here.context.sizes(component)
                subs += self.here.subscripts(part, own, e.Ref(component.name))[0]
            return e.Target(".".join(one.name for one in found.components), tuple(subs))
        if isinstance(wanted.x, e.Ref):
            return e.Target(wanted.x.name, wanted.x.subs)
        raise NeedsUnrolling(
            self.here.error(left.at, f"{left} names several variables, which a statement cannot assign here.")
        )

    def call(self, call: t.Call) -> e.Statement:
        """A call as a statement."""
        name = str(call.function)
        if name == "assert":
            return assertion(self.here, call)
        if name == "terminate":
            if self.is_function:
                raise self.here.error(call.at, "`terminate` is not allowed in functions.")
            message = self.here.single(*arguments(self.here, name, call, 1, 1))
            if message.type != STRING or message.dims:
                raise self.here.error(
                    call.at, f"the message of `terminate` must be a String, not of type {message.type}."
                )
            # A run cannot end early as if it were complete: it ends with this reason.
            return e.Assert(e.Const(False), message.x, False, _named(self.here, call))
        if name == "reinit":
            raise self.here.error(call.at, "`reinit` is allowed in equations of when-clauses only.")
        found = self.here.typed(call)
        return e.Assign((), found.x) if found.type == NONE else e.Assign((None,) * max(len(found.results), 1), found.x)

    def reinit(self, call: t.Call) -> tuple[e.Reinit, ...]:
        """The new value of a state, or of elements of it."""
        state, value = map(self.here.single, arguments(self.here, "reinit", call, 2, 2))
        if state.type.name != "Real" or state.variability < 3:
            raise self.here.error(call.at, "`reinit` needs a continuous Real variable.")
        if not value.type.is_numeric or not same_dims(state.dims, value.dims):
            raise self.here.error(call.at, "the value of `reinit` has another type or size than the variable.")
        if isinstance(state.x, e.Ref) and not state.x.subs:
            return (e.Reinit(state.x.name, value.x),)
        found: list[e.Reinit] = []
        for index in indices(state.dims):
            place = [e.Const(i) for i in index]
            x = element(state.x, place)
            if not isinstance(x, e.Ref):
                raise self.here.error(call.at, "`reinit` needs a variable, not an expression.")
            subs = [int(i) for sub in x.subs if (i := self.here.context.known(sub)) is not None]
            if len(subs) < len(x.subs):
                raise self.here.error(call.at, "a subscript of the variable of `reinit` must be known.")
            found.append(e.Reinit(x.name, element(value.x, place), tuple(subs)))
        return tuple(found)

    def _if(self, x: t.IfClause) -> tuple[e.Statement, ...]:
        blocks: list[tuple[e.Expression, e.Body]] = []
        otherwise: e.Body | None = None
        inside = self._inside()
        for condition, body in x.branches:
            truth = self.here.boolean(condition, "the condition of `if`")
            if truth.variability == CONSTANT and isinstance(truth.x, e.Const):
                if truth.x.value:
                    otherwise = inside.body(body)
                    break
                continue
            blocks.append((truth.x, inside.body(body)))
        otherwise = inside.body(x.otherwise) if otherwise is None else otherwise
        return (e.IfStatement(tuple(blocks), otherwise),) if blocks else otherwise

    def _for(self, iterators: Sequence[t.Iterator], clauses: Sequence[t.Clause]) -> tuple[e.Statement, ...]:
        first, *rest = iterators
        whole, values = self.here.iterations(first, (tuple(clauses),))
        kind = whole.type
        try:
            within = self._knowing(first.name, Typed(e.Ref(first.name), kind, (), 3 if self.is_function else 2))
            body = within._for(rest, clauses) if rest else within.body(clauses)
            return (e.For(((first.name, whole.x),), body),)
        except NeedsUnrolling as needed:
            if values is None:
                raise needed.error from None
        found: list[e.Statement] = []
        for value in values:
            within = self._knowing(first.name, value)
            found += within._for(rest, clauses) if rest else within.body(clauses)
        return tuple(found)

    def _knowing(self, name: str, value: Typed) -> "Statements":
        return self._inside(self.here.knowing({name: value}), in_loop=True)

    def _inside(self, here: Expressions | None = None, *, in_loop: bool = False) -> "Statements":
        """Statements in a clause."""
        here = dataclasses.replace(here or self.here, in_branch=True)
        return dataclasses.replace(self, here=here, in_clause=True, in_loop=in_loop or self.in_loop)

    def _when(self, x: t.WhenClause) -> e.Statement:
        if self.is_function:
            raise self.here.error(x.at, "`when` is not allowed in functions.")
        if self.here.in_when:
            raise self.here.error(x.at, "`when` is not allowed in `when`.")
        if self.in_clause or self.is_initial:
            raise self.here.error(x.at, "`when` is not allowed in an initial section, nor in `if`, `for` or `while`.")
        inner = Statements(self.here.within_when())
        blocks = tuple((when_condition(self.here, c, ("Boolean",)), inner.body(body)) for c, body in x.branches)
        return e.WhenClause(blocks)


def when_condition(here: Expressions, condition: t.Expression, kinds: Sequence[str]) -> e.Expression:
    """The condition of a when-clause: a discrete truth, a vector of them, or a clock, as far as `kinds` has it."""
    found = here.single(condition)
    if found.type.name not in kinds or len(found.dims) > 1:
        what = " or a clock" * ("Clock" in kinds)
        raise here.error(condition.at, f"the condition of `when` must be Boolean{what}, not of type {found.type}.")
    if found.variability > DISCRETE:
        raise here.error(
            condition.at, "the condition of `when` must be discrete, as relations outside of `noEvent` are."
        )
    return found.x


def _assigned(left: e.Expression, right: e.Expression) -> Iterator[e.Assign]:
    if isinstance(left, e.ArrayOf):
        for i, item in enumerate(left.elements):
            yield from _assigned(item, element(right, [e.Const(i + 1)]))
    elif isinstance(left, e.Ref):
        yield e.Assign((e.Target(left.name, left.subs),), right)


def check_discrete(here: Expressions, left: t.Expression, wanted: Typed, value: Typed, *, is_when: bool) -> None:
    """Raises `TextError` for a discrete variable that gets a continuous value outside of `when` (section 3.8.5)."""
    is_discrete = wanted.variability == DISCRETE or wanted.type.name not in ("Real", "record", "any")
    if is_discrete and value.variability > DISCRETE and not is_when:
        raise here.error(left.at, "this variable is discrete, and outside of `when` its value cannot be continuous.")


def assertion(here: Expressions, call: t.Call) -> e.Assert:
    first, second, *third = arguments(here, "assert", call, 2, 3)
    condition, message = here.boolean(first, "the condition of `assert`"), here.single(second)
    if message.type.name != "String":
        raise here.error(call.at, f"the message of `assert` must be a String, not of type {message.type}.")
    is_warning = False
    if third:
        level = here.single(third[0])
        if level.type.name != "enumeration" or level.variability > PARAMETER:
            raise here.error(call.at, "the level of `assert` must be a literal of AssertionLevel.")
        is_warning = int(here.context.value(level.x)) == 1
    return e.Assert(condition.x, message.x, is_warning, _named(here, call))


def _named(here: Expressions, call: t.Call) -> str:
    """The name of an assertion, with its component, file and line."""
    place = here.scope.source.place(call.at)
    return f"{call.function} ({join(here.scope.path, f'{Path(place.file).name}:{place.line}')})"
