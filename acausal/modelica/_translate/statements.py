"""Statements: their targets, the branches of `if`, and assertions."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from .._syntax import expressions as e
from .._syntax.visits import statements, targets, with_bodies


def targets_of(body: e.Body) -> list[str]:
    """The names that statements assign, in order."""
    return list(dict.fromkeys(target.name for target in targets(body)))


def loop_names(body: e.Body) -> set[str]:
    """The names that loops count with."""
    return {name for s in statements(body) if isinstance(s, e.For) for name, _ in s.indices}


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
        with_bodies(s, without_assertions) if isinstance(s, e.IfStatement) else s
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
