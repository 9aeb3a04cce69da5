"""Jaxprs evaluated one equation at a time by NumPy, without compilation."""

from collections.abc import Callable
from typing import Any, Protocol

import jax
import numpy as np

from .._jax_private import ClosedJaxpr, JaxprEqn, Literal, scan_counts
from .rules import RULES, Value, aval
from .simplify import branch_of


class JaxprInterpreter:
    """Evaluates the jaxprs of one program, and counts the equations evaluated."""

    def __init__(self) -> None:
        self.spent = 0
        self._blocks: dict[tuple[int, int], InterpretedJaxpr] = {}
        self.loops: dict[int, CompilableLoop] = {}  # by the identity of the equation

    def closed(self, closed: ClosedJaxpr, fixed: int = 0) -> "InterpretedJaxpr":
        """The jaxpr, prepared once; see `InterpretedJaxpr` for `fixed`."""
        key = (id(closed), fixed)
        if key not in self._blocks:
            self._blocks[key] = InterpretedJaxpr(self, closed, fixed)
        return self._blocks[key]


class CompilableLoop(Protocol):
    """A `while` that may be compiled. It is asked before each iteration."""

    def compiled(self) -> Callable[..., list[Value]] | None:
        """The function of all inputs of the equation, once it is compiled."""
        ...

    def spend(self, n: int) -> None:
        """Adds `n` to the equations evaluated so far."""
        ...


class InterpretedJaxpr:
    """A jaxpr, prepared for evaluation: slots for its values, and a function for each equation.

    What depends only on the first `fixed` inputs is evaluated by `bound`, once for all calls.
    """

    def __init__(self, owner: JaxprInterpreter, closed: ClosedJaxpr, fixed: int) -> None:
        self.owner, self._closed = owner, closed  # keeps the jaxpr, whose identity is the key of this block
        jaxpr = closed.jaxpr
        slots: dict[Any, int] = {}
        env: list[Any] = []

        def slot(atom: Any) -> int:
            if isinstance(atom, Literal):
                env.append(np.asarray(atom.val, atom.aval.dtype)[()])  # pyright: ignore
                return len(env) - 1
            if atom not in slots:
                slots[atom] = len(env)
                env.append(None)
            return slots[atom]

        known: set[Any] = set(jaxpr.constvars)
        for var, value in zip(jaxpr.constvars, closed.consts, strict=True):
            env[slot(var)] = as_numpy(value)
        self.takes = [slot(var) for var in jaxpr.invars]
        self.fixed = fixed
        known.update(jaxpr.invars[:fixed])
        self.before: list[tuple[Any, list[int], Any]] = []
        self.program: list[tuple[Any, list[int], Any]] = []
        for eqn in jaxpr.eqns:
            takes = [slot(atom) for atom in eqn.invars]
            gives: Any = [slot(var) for var in eqn.outvars]
            if not eqn.primitive.multiple_results:
                gives = gives[0]
            is_fixed = fixed > 0 and all(isinstance(a, Literal) or a in known for a in eqn.invars)
            if is_fixed:
                known.update(eqn.outvars)
            (self.before if is_fixed else self.program).append((_Lazy(owner, eqn), takes, gives))
        self.gives = [slot(atom) for atom in jaxpr.outvars]
        self.env = env

    def __call__(self, *inputs: Value) -> list[Value]:
        return self.bound(*inputs[: self.fixed])(*inputs[self.fixed :])

    def bound(self, *fixed: Value) -> Callable[..., list[Value]]:
        env, n = list(self.env), len(fixed)
        for i, value in zip(self.takes, fixed, strict=False):
            env[i] = value
        places = self.takes[n:]
        begun = not self.before

        def call(*inputs: Value) -> list[Value]:
            nonlocal begun
            if not begun:
                self._run(self.before, env)
                begun = True
            here = env.copy()
            for i, value in zip(places, inputs, strict=True):
                here[i] = value
            self._run(self.program, here)
            return [here[i] for i in self.gives]

        return call

    def _run(self, program: list[tuple[Any, list[int], Any]], env: list[Any]) -> None:
        self.owner.spent += len(program)
        for k, (function, takes, gives) in enumerate(program):
            if type(function) is _Lazy:
                function = function.made()
                program[k] = function, takes, gives
            found = function(*[env[i] for i in takes])
            if type(gives) is int:
                env[gives] = found
            else:
                for i, value in zip(gives, found, strict=True):
                    env[i] = value


class _Lazy:
    """The function of an equation, made when it is first needed."""

    def __init__(self, owner: JaxprInterpreter, eqn: JaxprEqn) -> None:
        self.owner, self.eqn = owner, eqn

    def made(self) -> Callable[..., Any]:
        eqn = self.eqn
        name = eqn.primitive.name
        if name in CONTROL:
            return CONTROL[name](self.owner, eqn)
        try:
            return RULES[name](eqn)
        except (KeyError, NotImplementedError):
            return _by_xla(eqn)


def as_numpy(value: Any) -> Value:
    return np.asarray(value)[()]


def _by_xla(eqn: JaxprEqn) -> Callable[..., Any]:
    """The function of an equation without a rule."""
    primitive, several = eqn.primitive, eqn.primitive.multiple_results
    call = jax.jit(lambda *values: primitive.bind(*values, **eqn.params))
    if several:
        return lambda *values: [as_numpy(x) for x in call(*values)]
    return lambda *values: as_numpy(call(*values))


def _cond(owner: JaxprInterpreter, eqn: JaxprEqn) -> Callable[..., Any]:
    branches = eqn.params["branches"]

    def chosen(index: Value, *values: Value) -> list[Value]:
        return owner.closed(branch_of(branches, index))(*values)

    return chosen


def _while(owner: JaxprInterpreter, eqn: JaxprEqn) -> Callable[..., Any]:
    p = eqn.params
    n, m = p["cond_nconsts"], p["body_nconsts"]
    own = owner.loops.get(id(eqn))

    def loop(*values: Value) -> list[Value]:
        goes_on = owner.closed(p["cond_jaxpr"], n).bound(*values[:n])
        body = owner.closed(p["body_jaxpr"], m).bound(*values[n : n + m])
        carry = values[n + m :]
        while True:
            if own is not None and (call := own.compiled()) is not None:  # goes on from here
                return list(map(as_numpy, call(*values[: n + m], *carry)))
            spent = owner.spent
            members = goes_on(*carry)[0]
            if not np.any(members):
                return list(carry)
            new = body(*carry)
            carry = new if np.ndim(members) == 0 else [_kept(members, *pair) for pair in zip(new, carry, strict=True)]
            if own is not None:
                own.spend(owner.spent - spent)

    return loop


def _kept(members: Value, new: Value, old: Value) -> Value:
    """New values where the members of a batched loop go on."""
    return np.where(members.reshape(members.shape + (1,) * (np.ndim(new) - np.ndim(members))), new, old)


def _scan(owner: JaxprInterpreter, eqn: JaxprEqn) -> Callable[..., Any]:
    p = eqn.params
    n, m = scan_counts(eqn)
    length, block = p["length"], owner.closed(p["jaxpr"], n)
    order = range(length)[::-1] if p["reverse"] else range(length)
    shapes = [(aval(var).shape, aval(var).dtype) for var in eqn.outvars[m:]]

    def scan(*values: Value) -> list[Value]:
        body, carry, xs = block.bound(*values[:n]), list(values[n : n + m]), values[n + m :]
        rows = [np.empty(*kind) for kind in shapes]
        for i in order:
            found = body(*carry, *(x[i] for x in xs))
            carry = found[:m]
            for row, value in zip(rows, found[m:], strict=True):
                row[i] = value
        return [*carry, *rows]

    return scan


CONTROL: dict[str, Any] = {"cond": _cond, "while": _while, "scan": _scan}
