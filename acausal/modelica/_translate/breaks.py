"""Loops without `break`: a flag says whether the loop was left, and what follows happens only if it was not."""

import dataclasses

from .._syntax import expressions as e


def may_break(body: e.Body) -> bool:
    """Whether statements leave the loop that they are in."""
    return any(isinstance(s, e.BreakStatement) or (isinstance(s, e.IfStatement) and _branches(s)) for s in body)


def _branches(s: e.IfStatement) -> bool:
    return may_break(s.otherwise) or any(may_break(body) for _, body in s.blocks)


def guarded(body: e.Body, flag: str) -> e.Body:
    """The body of a loop in which `break` sets a flag, and the flag ends this turn and all others."""
    return (_unless(flag, _without(body, flag)),)


def goes_on(flag: str) -> e.Expression:
    """The condition that the loop was not left."""
    return e.Unary("Not", e.Ref(flag))


def _unless(flag: str, body: e.Body) -> e.IfStatement:
    return e.IfStatement(((goes_on(flag), body),), ())


def _without(body: e.Body, flag: str) -> e.Body:
    for position, s in enumerate(body):
        before, rest = body[:position], body[position + 1 :]
        if isinstance(s, e.BreakStatement):
            return (*before, e.Assign((e.Target(flag),), e.Const(True)))
        if isinstance(s, e.IfStatement) and _branches(s):
            blocks = tuple((condition, _without(inner, flag)) for condition, inner in s.blocks)
            changed = dataclasses.replace(s, blocks=blocks, otherwise=_without(s.otherwise, flag))
            return (*before, changed, _unless(flag, _without(rest, flag))) if rest else (*before, changed)
    return body
