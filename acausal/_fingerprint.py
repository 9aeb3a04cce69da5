"""What an object is made of, as a short text that is the same in every process."""

import dataclasses
import enum
import hashlib
import re
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np

from ._jax_private import ClosedJaxpr, Jaxpr, Literal, jaxpr_as_fun
from ._tracing import is_traced

# Whose classes are known by their name, as long as the versions are the same.
LIBRARIES = ("acausal", "diffrax", "equinox", "lineax", "optimistix")
OWN = ("builtins", "jax", "jaxlib", "numpy")  # whose objects are parameters of primitives
DERIVATIVES = 4  # up to which order functions with derivatives of their own are told apart
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


class NoFingerprintError(TypeError):
    """What an object is made of cannot be told, as that of a function."""


def fingerprint(value: Any) -> str:
    """A digest of plain data, data classes of the libraries, arrays and jaxprs; equal for equal contents only.

    Of classes only the names count. Raises `NoFingerprintError` for what holds anything else.
    """
    digest = hashlib.sha256()
    for piece in _pieces(value):
        digest.update(piece)
        digest.update(b"\0")
    return digest.hexdigest()


def _pieces(value: Any) -> Iterator[bytes]:
    """The contents one by one; where something holds others, their number comes first."""
    match value:
        case None | bool() | int() | float() | str() | enum.Enum():
            yield repr(value).encode()
        case type():
            yield f"{value.__module__}.{value.__qualname__}".encode()
        case np.ndarray() | np.generic() | jax.Array() if not is_traced(value):
            array = np.asarray(value)
            yield f"array {array.dtype} {array.shape}".encode()
            yield array.tobytes()
        case tuple() | list():
            yield f"{len(value)}".encode()
            for item in value:
                yield from _pieces(item)
        case dict():
            yield from _pieces(list(value.items()))
        case frozenset():
            yield from _pieces(sorted(fingerprint(item) for item in value))
        case ClosedJaxpr():
            yield from _program(value)
        case _ if dataclasses.is_dataclass(value) and type(value).__module__.partition(".")[0] in LIBRARIES:
            yield from _pieces(type(value))
            for field in dataclasses.fields(value):
                yield from _pieces(getattr(value, field.name))
        case _:
            raise NoFingerprintError(f"{type(value).__name__} {value!r}")


def _program(closed: ClosedJaxpr, order: int = DERIVATIVES) -> Iterator[bytes]:
    """A jaxpr; where functions in it have derivatives of their own, also its derivatives, which show these."""
    yield from _equations(closed.jaxpr)
    yield from _pieces(closed.consts)
    if order and _has_own_derivatives(closed.jaxpr):
        values = [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in closed.in_avals]
        derivative = jax.make_jaxpr(lambda *x: jax.jvp(jaxpr_as_fun(closed), x, x))(*values)
        yield from _program(derivative, order - 1)


def _equations(jaxpr: Jaxpr) -> Iterator[bytes]:
    number: dict[Any, int] = {}

    def atoms(found: Any) -> Iterator[bytes]:
        yield f"{len(found)}".encode()
        for atom in found:
            if isinstance(atom, Literal):
                yield from _pieces(np.asarray(atom.val))
                yield str(atom.aval).encode()
            else:
                yield f"{number.setdefault(atom, len(number))}: {atom.aval}".encode()

    yield from atoms([*jaxpr.constvars, *jaxpr.invars])
    for eqn in jaxpr.eqns:
        if "callback" in eqn.primitive.name or eqn.primitive.name.startswith("custom_vjp"):
            raise NoFingerprintError(str(eqn.primitive))
        yield eqn.primitive.name.encode()
        yield from atoms(eqn.invars)
        yield from atoms(eqn.outvars)
        for name, value in sorted(eqn.params.items()):
            yield name.encode()
            if not (eqn.primitive.name.startswith("custom_") and (callable(value) and not hasattr(value, "jaxpr"))):
                yield from _parameter(value)
    yield from atoms(jaxpr.outvars)


def _parameter(value: Any) -> Iterator[bytes]:
    """A parameter of a primitive; jax's own objects are what they print."""
    match value:
        case ClosedJaxpr():
            yield from _equations(value.jaxpr)
            yield from _pieces(value.consts)
        case Jaxpr():
            yield from _equations(value)
        case tuple() | list():
            yield f"{type(value).__name__} {len(value)}".encode()
            for item in value:
                yield from _parameter(item)
        case np.ndarray() | np.generic() | jax.Array():
            yield from _pieces(value)
        case _:
            text = repr(value)
            if _ADDRESS.search(text) or type(value).__module__.partition(".")[0] not in OWN:
                raise NoFingerprintError(text)
            yield f"{type(value).__qualname__} {text}".encode()


def _has_own_derivatives(jaxpr: Jaxpr) -> bool:
    def inner(value: Any) -> bool:
        if isinstance(value, tuple | list):
            return any(map(inner, value))
        value = value.jaxpr if isinstance(value, ClosedJaxpr) else value
        return isinstance(value, Jaxpr) and _has_own_derivatives(value)

    return any(eqn.primitive.name.startswith("custom_") or any(map(inner, eqn.params.values())) for eqn in jaxpr.eqns)
