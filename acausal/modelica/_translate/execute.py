"""Execution of algorithms and of the bodies of functions."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.visits import bodies_of, statements, with_bodies
from .branches import Failed, choose
from .evaluate import evaluate, index_of
from .scope import NotKnown, Scope
from .statements import targets_of
from .values import Value, by_axes, is_known, items_of, select


def may_break(body: e.Body) -> bool:
    """Whether statements leave the loop that they are in."""
    inner = (body for s in body if isinstance(s, e.IfStatement) for body in bodies_of(s))
    return any(isinstance(s, e.BreakStatement) for s in body) or any(map(may_break, inner))


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
        if isinstance(s, e.IfStatement) and may_break((s,)):
            changed = with_bodies(s, lambda inner: _without(inner, flag))
            return (*before, changed, _unless(flag, _without(rest, flag))) if rest else (*before, changed)
    return body


Status = Literal["on", "return"]  # no `break`, which `guarded` replaces
Names = dict[str, Value]


def execute(body: Sequence[e.Statement], names: Names, at: Scope, *, is_whole: bool = False) -> Status:
    """Executes statements, which change `names`. `is_whole`: their end is the end of the function or algorithm."""
    for position, statement in enumerate(body):
        match statement:
            case e.Assign():
                _assign(statement, names, at)
            case e.IfStatement():
                status = _if(statement, body[position + 1 :], names, at, is_whole)
                if status is not None:
                    return status
            case e.For() if (
                not may_break(statement.body)
                and _leaves(statement.body)
                and not _leaves(statement.body, e.BreakStatement)
            ):
                turns = _unrolled(statement, names, at)
                return execute((*turns, *body[position + 1 :]), names, at, is_whole=is_whole)
            case e.For() | e.While():
                if may_break(statement.body):
                    status = _breakable(statement, names, at)
                elif isinstance(statement, e.For):
                    status = _for(statement.indices, statement.body, names, at)
                else:
                    status = _while(statement, names, at)
                if status == "return":
                    return status
            case e.Return():
                return "return"
            case e.Assert():
                check(statement, _here(names, at))
            case _:
                raise ModelError(f"a {type(statement).__name__.lower()} statement is not supported here.")
    return "on"


def _here(names: Names, at: Scope) -> Scope:
    return at.knowing(**names)


def check(statement: e.Assert, at: Scope) -> None:
    """Raises `Failed` for an assertion that is known to be violated."""
    try:
        truth = evaluate(statement.condition, at)
    except NotKnown:
        return
    if is_known(truth) and not truth and not statement.is_warning:
        raise Failed(f"assertion failed: {evaluate(statement.message, at)}")


def _assign(statement: e.Assign, names: Names, at: Scope) -> None:
    here = _here(names, at)
    value = evaluate(statement.value, here)
    if len(statement.targets) == 1 and not (isinstance(value, tuple) and statement.targets[0] is not None):
        values = (value,)
    else:
        values = value if isinstance(value, tuple) else (value,)
    for target, item in zip(statement.targets, values, strict=False):
        if target is not None:
            store(target, item, names, here)


def store(target: e.Target, value: Value, names: Names, at: Scope) -> None:
    """Assigns a value to a name, to a field of a record, or to elements of an array."""
    head, *fields = target.name.split(".")
    if target.name in names or head not in names:  # a variable of size 0 has no value before
        names[target.name] = _replaced(names.get(target.name), target.subs, value, at)
        return
    names[head] = _in_record(names[head], fields, target.subs, value, at)


def _in_record(record: Value, fields: list[str], subs: tuple[Any, ...], value: Value, at: Scope) -> Value:
    if not fields:
        return _replaced(record, subs, value, at)
    inner = _in_record(record[fields[0]], fields[1:], subs, value, at)
    return {**record, fields[0]: inner}


def _replaced(old: Value, subs: Sequence[Any], value: Value, at: Scope) -> Value:
    if not subs:
        return value
    if isinstance(old, dict):
        return {name: _replaced(item, subs, value[name], at) for name, item in old.items()}
    index = by_axes(index_of(old, subs, at), np.shape(old))
    known = is_known(old) and is_known(value) and all(not isinstance(i, jax.Array) for i in index)
    if known:
        copy = np.array(old, dtype=np.result_type(old, value) if np.asarray(value).dtype.kind in "bif" else object)
        copy[index] = value
        return copy
    return jnp.asarray(old, jnp.result_type(old, value)).at[index].set(value)


def _leaves(body: e.Body, kind: type = e.Return) -> bool:
    """Whether a body contains a statement of this kind."""
    return any(isinstance(s, kind) for s in statements(body))


def _if(
    statement: e.IfStatement, rest: Sequence[e.Statement], names: Names, at: Scope, is_whole: bool
) -> Status | None:
    """Executes an if-statement. If a branch of an unknown condition leaves the body, executes the rest in each branch,
    and returns the status at its end.
    """
    (condition, body), *others = statement.blocks or ((e.Const(True), statement.otherwise),)
    truth = evaluate(condition, _here(names, at))
    otherwise: tuple[e.Statement, ...] = statement.otherwise
    if others:
        otherwise = (e.IfStatement(tuple(others), statement.otherwise),)
    if is_known(truth):
        chosen = body if truth else otherwise
        if _leaves(chosen):
            return execute((*chosen, *rest), names, at, is_whole=is_whole)
        execute(chosen, names, at)
        return None
    takes_rest = _leaves(body) or _leaves(otherwise)

    def side(branch: Sequence[e.Statement]) -> tuple[Names, Status]:
        own = dict(names)
        return own, execute((*branch, *rest) if takes_rest else branch, own, at, is_whole=is_whole)

    if at.holds:
        (first, one), (second, other) = side(body), side(otherwise)
        merge(truth, first, second, names)
        ends = (one, other)
    else:
        found: list[Status] = []

        def values(branch: Sequence[e.Statement]) -> Names:
            own, status = side(branch)
            found.append(status)
            return own

        names.update(choose(truth, lambda: values(body), lambda: values(otherwise)))
        ends = tuple(found)
    if not takes_rest:
        return None
    if len(set(ends)) > 1 and not is_whole:
        raise ModelError(
            "a `return` under a condition that is unknown before a run is not supported in this loop. Remedy: a for "
            "loop without `break`."
        )
    return "return" if "return" in ends else ends[0]


def merge(truth: Value, first: Mapping[str, Value], second: Mapping[str, Value], names: Names) -> None:
    """The names after an if-statement with an unknown condition."""
    for name in {**first, **second}:
        a, b = first.get(name), second.get(name)
        names[name] = a if a is b else b if a is None else a if b is None else select(truth, a, b)


def _unrolled(statement: e.For, names: Names, at: Scope) -> e.Body:
    """The turns of a loop as statements one after the other."""
    (name, over), *rest = statement.indices
    body = (e.For(tuple(rest), statement.body),) if rest else statement.body
    items = items_of(evaluate(over, _here(names, at)))
    return tuple(s for item in items for s in (e.Assign((e.Target(name),), e.Const(item)), *body))


def _breakable(statement: e.For | e.While, names: Names, at: Scope) -> Status:
    """Executes a loop that `break` leaves."""
    flag = next(name for number in itertools.count() if (name := f"break {number}") not in names)
    names[flag] = False
    if isinstance(statement, e.For):
        status = _for(statement.indices, guarded(statement.body, flag), names, at)
    else:
        condition = e.Binary("And", goes_on(flag), statement.condition)
        status = _while(e.While(condition, guarded(statement.body, flag)), names, at)
    del names[flag]
    return status


def _for(indices: Sequence[tuple[str, Any]], body: e.Body, names: Names, at: Scope) -> Status:
    (name, over), *rest = indices
    outer = names.get(name)
    for item in items_of(evaluate(over, _here(names, at))):
        names[name] = item
        status = _for(rest, body, names, at) if rest else execute(body, names, at)
        if status == "return":
            return status
    if outer is None:
        names.pop(name, None)
    else:
        names[name] = outer
    return "on"


def _while(statement: e.While, names: Names, at: Scope) -> Status:
    for _ in range(100_000):
        truth = evaluate(statement.condition, _here(names, at))
        if not is_known(truth):
            return _traced_while(statement, names, at)
        if not truth:
            return "on"
        status = execute(statement.body, names, at)
        if status != "on":
            return status
    raise ModelError("a while loop does not end.")


def _traced_while(statement: e.While, names: Names, at: Scope) -> Status:
    """A loop whose condition is unknown before a run. Its names keep their types."""
    assigned = {name.partition(".")[0] for name in targets_of(statement.body)}

    def step(state: Names) -> Names:
        inner = {**names, **state}
        if execute(statement.body, inner, at) != "on":
            raise ModelError("a `return` in a while loop of unknown length is not supported.")
        return {name: value for name, value in inner.items() if name in assigned or name in state}

    def goes_on(state: Names) -> Any:
        return jnp.asarray(evaluate(statement.condition, _here({**names, **state}, at)))

    start: Names = {}
    while True:
        shapes = jax.eval_shape(lambda state: jax.tree.map(jnp.asarray, step(state)), start)
        if start.keys() == shapes.keys():
            break
        start = _carried(names, shapes)

    def turn(state: Names) -> Names:
        return jax.tree.map(lambda old, new: jnp.asarray(new, old.dtype), state, step(state))

    most = _most_turns(statement, names, at)
    if most is None:
        names.update(_while_loop(goes_on, turn, start))
        return "on"

    def perhaps(state: Names, _: None) -> tuple[Names, None]:
        return jax.lax.cond(goes_on(state), turn, lambda old: old, state), None

    # A loop of known length can be differentiated in reverse mode.
    names.update(jax.lax.scan(perhaps, start, None, length=most)[0])
    return "on"


def _while_loop(goes_on: Callable[[PyTree], Any], turn: Callable[[PyTree], PyTree], start: PyTree) -> PyTree:
    """Repeats `turn` while `goes_on`, with derivatives in both modes. The two may close over differentiated numbers.

    The tangent is the Jacobian, from forward mode, times the tangents of the inputs. JAX can transpose this product,
    but not the tangent of a loop.
    """

    def loop(first: jax.Array) -> jax.Array:
        return ravel_pytree(jax.lax.while_loop(goes_on, turn, state_of(first)))[0]

    first, state_of = ravel_pytree(start)
    explicit, closed_over = jax.closure_convert(loop, first)
    inputs, arguments_of = ravel_pytree((first, closed_over))

    def once(inputs: jax.Array) -> jax.Array:
        first, closed_over = arguments_of(inputs)
        return explicit(first, *closed_over)

    end = jax.custom_jvp(once)

    @end.defjvp
    def _tangent(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        return end(*primals), jax.jacfwd(once)(*primals) @ tangents[0]

    return state_of(end(inputs))


def _carried(names: Names, shapes: Names) -> Names:
    """The names that a loop changes, as arrays."""

    def array(value: Value, like: Any) -> jax.Array:
        return jnp.broadcast_to(jnp.asarray(value, bool if like.dtype == bool else float), like.shape)

    return {name: jax.tree.map(array, names[name], like) for name, like in shapes.items()}


def _most_turns(statement: e.While, names: Names, at: Scope) -> int | None:
    """The largest number of turns of a loop that counts: `while i < n and ...` with `i := i + 1`."""
    for relation in _conjuncts(statement.condition):
        if isinstance(relation, e.Binary) and relation.op in ("Lt", "Le") and isinstance(relation.left, e.Ref):
            counter, first = relation.left, names.get(relation.left.name)
            counts = e.Assign((e.Target(counter.name),), e.Binary("Add", counter, e.Const(1)))
            last = evaluate(relation.right, _here(names, at))
            if counts in statement.body and isinstance(first, int) and isinstance(last, int):
                return max(last - first + (relation.op == "Le"), 0)
    return None


def _conjuncts(condition: e.Expression) -> list[e.Expression]:
    if isinstance(condition, e.Binary) and condition.op == "And":
        return _conjuncts(condition.left) + _conjuncts(condition.right)
    return [condition]
