"""Statements: with resolved expressions, their targets, and the branches of `if`."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from ..._errors import ModelError
from .._syntax import expressions as e

Term = Callable[[Any], Any]


def resolved_body(body: e.Body, term: Term) -> e.Body:
    """Statements with each expression replaced by its term."""
    return tuple(_resolved(statement, term) for statement in body)


def _resolved(s: e.Statement, term: Term) -> e.Statement:
    match s:
        case e.Assign():
            targets = tuple(None if t is None else e.Target(t.name, tuple(map(term, t.subs))) for t in s.targets)
            return e.Assign(targets, term(s.value))
        case e.IfStatement():
            return e.IfStatement(_blocks(s.blocks, term), resolved_body(s.otherwise, term))
        case e.For():
            return e.For(tuple((name, term(over)) for name, over in s.indices), resolved_body(s.body, term))
        case e.While():
            return e.While(term(s.condition), resolved_body(s.body, term))
        case e.Assert():
            return e.Assert(term(s.condition), term(s.message), s.is_warning)
        case e.Return() | e.BreakStatement():
            return s
    raise ModelError(f"a {type(s).__name__.lower()} statement is not supported in an algorithm.")


def _blocks(blocks: tuple[tuple[Any, e.Body], ...], term: Term) -> tuple[tuple[Any, e.Body], ...]:
    return tuple((term(condition), resolved_body(body, term)) for condition, body in blocks)


def targets_of(body: e.Body) -> list[str]:
    """The names that statements assign, and the names of loops, in order."""
    found: dict[str, None] = {}
    for s in body:
        if isinstance(s, e.Assign):
            found.update((t.name, None) for t in s.targets if t is not None)
        elif isinstance(s, e.IfStatement | e.WhenClause):
            for _, inner in s.blocks:
                found.update((name, None) for name in targets_of(inner))
            if isinstance(s, e.IfStatement):
                found.update((name, None) for name in targets_of(s.otherwise))
        elif isinstance(s, e.For | e.While):
            found.update((name, None) for name in targets_of(s.body))
    return list(found)


def loop_names(body: e.Body) -> set[str]:
    """The names that loops count with."""
    found: set[str] = set()
    for s in body:
        if isinstance(s, e.For):
            found |= {name for name, _ in s.indices}
        inner = [b for _, b in s.blocks] if isinstance(s, e.IfStatement | e.WhenClause) else []
        inner += [s.otherwise] if isinstance(s, e.IfStatement) else []
        inner += [s.body] if isinstance(s, e.For | e.While) else []
        for body_inside in inner:
            found |= loop_names(body_inside)
    return found


Targets: TypeAlias = tuple[e.Target | None, ...]  # that one equation sets together; None for a result that is dropped
Values: TypeAlias = dict[Targets, Any]


def branches_of(s: e.IfStatement) -> Iterator[tuple[tuple[e.Expression, ...], e.Body]]:
    """The branches, each with the conditions under all of which it is taken."""
    earlier: tuple[e.Expression, ...] = ()
    for condition, body in s.blocks:
        yield (*earlier, condition), body
        earlier = (*earlier, e.Unary("Not", condition))
    yield earlier, s.otherwise


def chosen(s: e.IfStatement, values: Sequence[Mapping[Targets, Any]], kept: Callable[[Targets], Any]) -> Values:
    """The values that an `if` gives to variables, from those of its branches. A branch keeps what it does not set."""
    *inner, other = values

    def value(targets: Targets) -> e.Expression:
        before = kept(targets)
        branches = zip(s.blocks, inner, strict=True)
        return e.If(tuple((c, own.get(targets, before)) for (c, _), own in branches), other.get(targets, before))

    return {targets: value(targets) for targets in dict.fromkeys(targets for own in values for targets in own)}


def assertions(body: e.Body, given: Iterable[e.Expression] = ()) -> Iterator[e.Assert]:
    """The assertions among statements that must hold. One in a branch of an `if` need only hold if it is taken."""
    for s in body:
        if isinstance(s, e.Assert) and not s.is_warning:
            yield dataclasses.replace(s, condition=implied(given, s.condition))
        elif isinstance(s, e.IfStatement):
            for conditions, branch in branches_of(s):
                yield from assertions(branch, (*given, *conditions))


def without_assertions(body: e.Body) -> e.Body:
    """Statements without the assertions that `assertions` finds, and without warnings."""
    return tuple(
        e.IfStatement(tuple((c, without_assertions(b)) for c, b in s.blocks), without_assertions(s.otherwise))
        if isinstance(s, e.IfStatement)
        else s
        for s in body
        if not isinstance(s, e.Assert)
    )


def together(targets: Targets, each: Callable[[e.Ref], e.Expression] = lambda ref: ref) -> e.Expression:
    """The values that one equation sets together, from that of each target."""
    found = tuple(None if target is None else each(e.Ref(target.name, target.subs)) for target in targets)
    return found[0] if len(found) == 1 and found[0] is not None else e.TupleOf(found)


def before(operator: str) -> Callable[[Targets], e.Expression]:
    """The values that `pre` or `previous` gives to targets."""
    return lambda targets: together(targets, lambda ref: e.Builtin(operator, (ref,)))


def implied(given: Iterable[e.Expression], condition: e.Expression) -> e.Expression:
    """Whether a condition holds if all the given ones do."""
    return any_of([*(e.Unary("Not", one) for one in given), condition])


def all_of(parts: Sequence[e.Expression]) -> e.Expression:
    return ft.reduce(ft.partial(e.Binary, "And"), parts) if parts else e.Const(True)


def any_of(parts: Sequence[e.Expression]) -> e.Expression:
    return ft.reduce(ft.partial(e.Binary, "Or"), parts) if parts else e.Const(False)
