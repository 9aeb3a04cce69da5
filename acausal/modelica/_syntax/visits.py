"""Visits of the parts of expressions and statements."""

import dataclasses
import functools as ft
from collections.abc import Callable, Iterator
from typing import Any

from .expressions import Assign, Body, For, IfStatement, Statement, Target, WhenClause, While


def parts_of(x: Any) -> list[Any]:
    """The expressions and statements directly inside one, or those of a tuple."""
    found: list[Any] = []
    for value in x if isinstance(x, tuple) else (getattr(x, name) for name in _fields(type(x))):
        if isinstance(value, tuple):
            found += parts_of(value)
        elif dataclasses.is_dataclass(value):
            found.append(value)
    return found


def nodes(x: Any) -> Iterator[Any]:
    """All expressions and statements in one, itself first, or in a tuple of them."""
    if not isinstance(x, tuple):
        yield x
    for part in parts_of(x):
        yield from nodes(part)


def bodies_of(s: Statement) -> tuple[Body, ...]:
    """The bodies directly inside a statement."""
    match s:
        case IfStatement():
            return (*(body for _, body in s.blocks), s.otherwise)
        case WhenClause():
            return tuple(body for _, body in s.blocks)
        case For() | While():
            return (s.body,)
    return ()


def with_bodies(s: Statement, change: Callable[[Body], Body]) -> Statement:
    """A statement with the bodies directly inside changed."""
    match s:
        case IfStatement(blocks, otherwise):
            return IfStatement(tuple((condition, change(body)) for condition, body in blocks), change(otherwise))
        case WhenClause(blocks):
            return WhenClause(tuple((condition, change(body)) for condition, body in blocks))
        case For() | While():
            return dataclasses.replace(s, body=change(s.body))
    return s


def statements(body: Body) -> Iterator[Statement]:
    """All statements in a body, each before those inside it."""
    for s in body:
        yield s
        for inner in bodies_of(s):
            yield from statements(inner)


def targets(body: Body) -> Iterator[Target]:
    """The variables that statements assign."""
    for s in statements(body):
        if isinstance(s, Assign):
            yield from (target for target in s.targets if target is not None)


def mapped(x: Any, change: Callable[[Any], Any]) -> Any:
    """An expression, a statement or a tuple of them, with the parts directly inside changed."""
    if isinstance(x, tuple):
        new = tuple(_changed(item, change) for item in x)
        return x if all(a is b for a, b in zip(new, x, strict=True)) else new
    old = {name: getattr(x, name) for name in _fields(type(x))}
    changes = {name: new for name, value in old.items() if (new := _changed(value, change)) is not value}
    return dataclasses.replace(x, **changes) if changes else x


def _changed(value: Any, change: Callable[[Any], Any]) -> Any:
    if isinstance(value, tuple):
        return mapped(value, change)
    return change(value) if dataclasses.is_dataclass(value) else value


@ft.cache
def _fields(cls: type) -> tuple[str, ...]:
    """The fields with parts. A field that does not take part in comparisons, such as a table, has none."""
    return tuple(field.name for field in dataclasses.fields(cls) if field.compare)
