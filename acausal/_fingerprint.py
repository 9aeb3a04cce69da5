"""Digest of the contents of an object, equal in every process."""

import dataclasses
import enum
import functools as ft
import hashlib
import re
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ._jax_private import (
    PRIMITIVES,
    Atom,
    ClosedJaxpr,
    DebugInfo,
    Jaxpr,
    JaxprEqn,
    Literal,
    Var,
    high_level,
    jaxpr_as_fun,
)
from ._tracing import is_traced

# Packages whose classes are identified by name, given equal versions.
LIBRARIES = ("acausal", "diffrax", "equinox", "lineax", "optimistix")
OWN = ("jax", "jaxlib", "numpy")  # packages whose objects may be parameters of primitives
DERIVATIVES = 5  # order up to which functions with derivative rules of their own are compared
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


class NoFingerprintError(TypeError):
    """An object without a fingerprint, such as a function."""


def fingerprint(value: object) -> str:
    """A digest of plain data, data classes of the libraries, arrays and jaxprs; equal only for equal contents.

    Classes count by name. Raises `NoFingerprintError` for any other content.
    """
    digest = hashlib.sha256()
    for piece in _pieces(value):
        digest.update(b"%d " % len(piece))
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: Any) -> Iterator[bytes]:
    """The contents one by one. The contents of a container follow their number."""
    kind = type(value)
    if value is None or kind in (bool, int, float, str):  # subclasses may have another repr
        yield repr(value).encode()
    elif issubclass(kind, enum.Enum) and _is_of(value, LIBRARIES + OWN):
        yield f"{_name(kind)}.{value.name}".encode()
    elif isinstance(value, type):
        yield f"class {_name(value)}".encode()
    elif isinstance(value, np.ndarray | np.generic | jax.Array):
        yield from _array(value)
    elif isinstance(value, tuple | list):
        yield f"{_name(kind)} {len(value)}".encode()
        for item in value:
            yield from _pieces(item)
    elif kind is dict:
        yield b"dict"
        yield from _pieces(list(value.items()))
    elif kind is frozenset:
        yield b"frozenset"
        yield from _pieces(sorted(fingerprint(item) for item in value))
    elif isinstance(value, ClosedJaxpr):
        yield from _closed(value, DERIVATIVES)
    elif dataclasses.is_dataclass(value) and _is_of(value, LIBRARIES):
        yield _name(kind).encode()
        yield from _pieces([getattr(value, field.name) for field in dataclasses.fields(value)])
    else:
        raise NoFingerprintError(f"{kind.__name__} {value!r}")


def _name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _is_of(value: object, packages: tuple[str, ...]) -> bool:
    return type(value).__module__.partition(".")[0] in packages


def _array(value: np.ndarray | np.generic | jax.Array) -> Iterator[bytes]:
    if is_traced(value) or jnp.issubdtype(value.dtype, jax.dtypes.extended) or value.dtype.hasobject:
        raise NoFingerprintError(f"an array of type {value.dtype}")
    array = np.asarray(value)
    yield f"array {array.dtype.str} {array.shape}".encode()
    yield array.tobytes()


def _closed(closed: ClosedJaxpr, order: int) -> Iterator[bytes]:
    yield from _program(closed.jaxpr, order)
    yield from _pieces(list(closed.consts))


def _program(jaxpr: Jaxpr, order: int) -> Iterator[bytes]:
    """A jaxpr, and the derivatives, up to some order, of the functions in it with custom derivatives."""
    number: dict[Var, int] = {}

    def atoms(found: Sequence[Atom]) -> Iterator[bytes]:
        yield f"atoms {len(found)}".encode()
        for atom in found:
            yield _said(atom.aval)
            if isinstance(atom, Literal):
                yield from _pieces(np.asarray(atom.val))
            else:
                yield f"{number.setdefault(atom, len(number))}".encode()

    yield from atoms([*jaxpr.constvars, *jaxpr.invars])
    yield f"equations {len(jaxpr.eqns)}".encode()
    for eqn in jaxpr.eqns:
        operation = high_level(eqn)
        is_own = eqn.primitive in PRIMITIVES if operation is None else _is_of(operation, OWN)
        if not is_own:  # a foreign primitive: its rules define it
            raise NoFingerprintError(str(eqn.primitive))
        yield (eqn.primitive.name if operation is None else _name(type(operation))).encode()
        yield from atoms(eqn.invars)
        yield from atoms(eqn.outvars)
        yield from _parameters(eqn, order)
    yield from atoms(jaxpr.outvars)


@ft.lru_cache(maxsize=4096)
def _said(aval: object) -> bytes:
    return str(aval).encode()


def _parameters(eqn: JaxprEqn, order: int) -> Iterator[bytes]:
    operation = high_level(eqn)
    params = dict(eqn.params if operation is None else operation.params)
    if eqn.primitive.name == "custom_jvp_call":
        del params["jvp_jaxpr_fun"]
        if params["symbolic_zeros"]:
            raise NoFingerprintError("a derivative that may depend on which numbers change")
        yield from _closed(_derivative(eqn), order - 1) if order else (b"",)
    yield from _parameter(sorted(params.items()), order)


def _derivative(eqn: JaxprEqn) -> ClosedJaxpr:
    """The derivative of one equation along all its differentiable inputs."""
    invars: list[Any] = [Var(atom.aval) for atom in eqn.invars]
    jaxpr = Jaxpr((), invars, eqn.outvars, [eqn.replace(invars=invars)], debug_info=DebugInfo("", "", None, None))
    whole = jaxpr_as_fun(ClosedJaxpr(jaxpr, ()))
    values = [jax.ShapeDtypeStruct(var.aval.shape, var.aval.dtype) for var in invars]
    moving = [i for i, value in enumerate(values) if jnp.issubdtype(value.dtype, np.inexact)]

    def derivative(values: list[Array], tangents: list[Array]) -> tuple[list[Array], list[Array]]:
        def of_moving(*moved: Array) -> list[Array]:
            point = list(values)
            for i, value in zip(moving, moved, strict=True):
                point[i] = value
            return whole(*point)

        return jax.jvp(of_moving, tuple(values[i] for i in moving), tuple(tangents))

    try:
        return jax.make_jaxpr(derivative)(values, [values[i] for i in moving])
    except Exception as error:  # of the user's own rule, which raises it again when it is used
        raise NoFingerprintError(f"a failing derivative: {error}") from error


def _parameter(value: object, order: int) -> Iterator[bytes]:
    """A parameter of a primitive. The repr identifies objects of jax."""
    if isinstance(value, ClosedJaxpr):
        yield from _closed(value, order)
    elif isinstance(value, Jaxpr):
        yield from _program(value, order)
    elif isinstance(value, tuple | list):
        yield f"{_name(type(value))} {len(value)}".encode()
        for item in value:
            yield from _parameter(item, order)
    elif _is_of(value, OWN) and not isinstance(value, np.ndarray | np.generic | jax.Array):
        text = repr(value)
        if _ADDRESS.search(text):
            raise NoFingerprintError(text)
        yield f"{_name(type(value))} {text}".encode()
    else:
        yield from _pieces(value)
