"""Statements with resolved expressions."""

from collections.abc import Callable
from typing import Any

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
