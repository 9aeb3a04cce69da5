"""Jaxprs for evaluation only, without what serves derivatives and batches.

Calls are replaced by what they call, equations that occur twice by one, and those whose results nobody reads are left
out. Only primitives of jax remain.
"""

from collections.abc import Hashable, Sequence
from typing import Any

import jax
import numpy as np

from .._jax_private import PRIMITIVES, Atom, ClosedJaxpr, Jaxpr, JaxprEqn, Literal, Primitive, Var, new_equation
from .._reduce.jaxpr import differentiable_call, inner_jaxprs, plain_call

# Primitives that return their first input outside of transformations
IDENTITIES = {"stop_gradient", "copy", "name", "nonbatchable", "nondifferentiable_backward", "nontraceable"}
# Calls that concern derivatives and batches only, with the parameter that holds what they call
CALLS = {"custom_vmap_call": "call", "remat2": "jaxpr", "checkpoint": "jaxpr"}


class NotPlainError(Exception):
    """A jaxpr has effects, such as printing, or values that NumPy does not have, such as keys of random numbers."""


def simplified(closed: ClosedJaxpr) -> ClosedJaxpr:
    """An equal jaxpr for evaluation. Raises `NotPlainError`."""
    return _Simplifier().closed(closed)


class _Simplifier:
    def __init__(self) -> None:
        self._made: dict[int, tuple[Any, ClosedJaxpr]] = {}

    def closed(self, closed: ClosedJaxpr) -> ClosedJaxpr:
        key = id(closed)
        if key not in self._made:
            self._made[key] = closed, _Builder(self).made(closed)
        return self._made[key][1]


class _Builder:
    """A jaxpr in the making."""

    def __init__(self, owner: _Simplifier) -> None:
        self._owner = owner
        self.constants: list[tuple[Var, Any]] = []
        self.eqns: list[JaxprEqn] = []
        self._seen: dict[Hashable, list[Atom]] = {}

    def made(self, closed: ClosedJaxpr) -> ClosedJaxpr:
        if closed.jaxpr.effects:
            raise NotPlainError
        takes = [_new(var) for var in closed.jaxpr.invars]
        gives = self.call(closed.jaxpr, closed.consts, takes)
        needed = {atom for atom in gives if isinstance(atom, Var)}
        kept: list[JaxprEqn] = []
        for eqn in reversed(self.eqns):
            if any(var in needed for var in eqn.outvars):
                kept.append(eqn)
                needed.update(atom for atom in eqn.invars if isinstance(atom, Var))
        constants = [(var, value) for var, value in self.constants if var in needed]
        jaxpr = Jaxpr([var for var, _ in constants], takes, gives, kept[::-1], debug_info=closed.jaxpr.debug_info)
        return ClosedJaxpr(jaxpr, [value for _, value in constants])

    def call(self, jaxpr: Jaxpr, constants: Sequence[Any], inputs: Sequence[Atom]) -> list[Atom]:
        """Appends the equations of a jaxpr; returns its outputs."""
        env: dict[Var, Atom] = dict(zip(jaxpr.invars, inputs, strict=True))
        for var, value in zip(jaxpr.constvars, constants, strict=True):
            env[var] = self._constant(var, value)

        def here(atom: Atom) -> Atom:
            return Literal(_own(atom.val), atom.aval) if isinstance(atom, Literal) else env[atom]

        for eqn in jaxpr.eqns:
            env.update(zip(eqn.outvars, self._results(eqn, list(map(here, eqn.invars))), strict=True))
        return list(map(here, jaxpr.outvars))

    def _constant(self, var: Var, value: Any) -> Var:
        new = _new(var)
        self.constants.append((new, np.asarray(_own(value))))
        return new

    def _results(self, eqn: JaxprEqn, takes: list[Atom]) -> list[Atom]:
        name, params = eqn.primitive.name, eqn.params
        if name in IDENTITIES:
            return takes[: len(eqn.outvars)]
        if name == "select_if_vmap":
            return [takes[1]]
        if (inner := plain_call(eqn) or differentiable_call(eqn) or params.get(CALLS.get(name, ""))) is not None:
            return self._call_of(inner, takes)
        if name == "custom_linear_solve":
            counts = params["const_lengths"]
            first = counts.matvec + counts.vecmat
            own = takes[first : first + counts.solve]
            return self._call_of(params["jaxprs"].solve, [*own, *takes[sum(counts) :]])
        if name == "platform_index":
            return [_literal(_cpu(params["platforms"]), eqn)]
        if name == "cond" and isinstance(takes[0], Literal):
            return self._call_of(branch_of(params["branches"], takes[0].val), takes[1:])
        if name in ("unvmap_any", "unvmap_all", "unvmap_max") and not eqn.invars[0].aval.shape:  # pyright: ignore
            return [takes[0]]
        if eqn.primitive not in PRIMITIVES and (traced := _traced(eqn)) is not None:
            return self._call_of(traced, takes)
        if name == "convert_element_type" and eqn.invars[0].aval.dtype == eqn.outvars[0].aval.dtype:  # pyright: ignore
            return [takes[0]]
        if name in ("reshape", "squeeze", "broadcast_in_dim") and _is_same_shape(eqn):
            return [takes[0]]
        return self._appended(eqn, takes, self._inner(name, params))

    def _call_of(self, inner: Any, takes: list[Atom]) -> list[Atom]:
        if isinstance(inner, ClosedJaxpr):
            return self.call(inner.jaxpr, inner.consts, takes)
        return self.call(inner, (), takes)

    def _inner(self, name: str, params: dict[str, Any]) -> dict[str, Any]:
        """The parameters, with simplified jaxprs."""
        closed = self._owner.closed
        if name == "while":
            return {**params, "cond_jaxpr": closed(params["cond_jaxpr"]), "body_jaxpr": closed(params["body_jaxpr"])}
        if name == "scan":
            return {**params, "jaxpr": closed(params["jaxpr"])}
        if name == "cond":
            return {**params, "branches": tuple(map(closed, params["branches"]))}
        return params

    def _appended(self, eqn: JaxprEqn, takes: list[Atom], params: dict[str, Any]) -> list[Atom]:
        key = (eqn.primitive, tuple(map(_identity, takes)), _identity_of(params))
        found: list[Atom] | None = None
        try:
            found = self._seen.get(key)
        except TypeError:  # parameters without a hash
            key = None
        if found is None:
            gives = [_new(var) for var in eqn.outvars]
            self.eqns.append(new_equation(takes, gives, eqn.primitive, params))
            found = [*gives]
            if key is not None:
                self._seen[key] = found
        return found


def _new(var: Var) -> Var:
    dtype = getattr(var.aval, "dtype", None)
    if not isinstance(dtype, np.dtype) or dtype.kind not in "biufc":
        raise NotPlainError
    return Var(var.aval)


def _own(value: Any) -> Any:
    """A constant that the user cannot change: a part may be compiled later than others are interpreted."""
    return value.copy() if isinstance(value, np.ndarray) else value


def branch_of(branches: Sequence[Any], index: Any) -> Any:
    """The branch that a `cond` takes: the last one if the index is out of range."""
    return branches[index if 0 <= index < len(branches) else -1]


def _identity(atom: Atom) -> Hashable:
    if isinstance(atom, Literal):
        value = np.asarray(atom.val, atom.aval.dtype)  # pyright: ignore[reportAttributeAccessIssue]
        return value.dtype, value.tobytes()
    return atom


def _identity_of(params: dict[str, Any]) -> Hashable:
    return tuple((k, id(v) if isinstance(v, ClosedJaxpr) else v) for k, v in params.items())


def _literal(value: int, eqn: JaxprEqn) -> Literal:
    return Literal(np.asarray(value, np.int32), eqn.outvars[0].aval)


def _cpu(platforms: Sequence[Any]) -> int:
    return next(i for i, names in enumerate(platforms) if names is None or "cpu" in names)


def _is_same_shape(eqn: JaxprEqn) -> bool:
    source, target = eqn.invars[0].aval.shape, eqn.outvars[0].aval.shape  # pyright: ignore
    if source != target or len(eqn.invars) > 1:
        return False
    places = eqn.params.get("broadcast_dimensions", eqn.params.get("dimensions"))
    return places is None or tuple(places) == tuple(range(len(target))) or not places


def _traced(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """What a primitive of another library does; None for jax's own, and for those that only XLA evaluates."""
    shapes = [jax.ShapeDtypeStruct(atom.aval.shape, atom.aval.dtype) for atom in eqn.invars]  # pyright: ignore

    def results(*values: Any) -> Any:
        found = eqn.primitive.impl(*values, **eqn.params)
        return found if eqn.primitive.multiple_results else [found]

    try:
        closed = jax.make_jaxpr(results)(*shapes)
    except Exception:  # such as of `noinline` of equinox, whose function is among its values
        return None
    return None if _calls(closed.jaxpr, eqn.primitive) else closed


def _calls(jaxpr: Jaxpr, primitive: Primitive) -> bool:
    """Whether a primitive is among the equations."""
    return any(
        eqn.primitive is primitive or any(_calls(inner.jaxpr, primitive) for inner in inner_jaxprs(eqn))
        for eqn in jaxpr.eqns
    )
