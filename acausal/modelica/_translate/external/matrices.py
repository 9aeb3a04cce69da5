"""Linear algebra: functions of LAPACK that Modelica.Math.Matrices calls, by their Modelica names."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..values import is_known, plain

_DONE = 0  # the value of `info` for success


def _library(*values: Any) -> Any:
    return np if all(is_known(value) for value in values) else jnp


def _floats(a: Any) -> Any:
    return _library(a).asarray(a, float)


def _solve(a: Any, b: Any) -> tuple[Any, int]:
    return _library(a, b).linalg.solve(_floats(a), _floats(b)), _DONE


def _transposed_solve(a: Any, b: Any, transposed: bool = True) -> tuple[Any, int, Any]:
    a = _floats(a).T if transposed else _floats(a)
    return _library(a, b).linalg.solve(a, _floats(b)), _DONE, 1.0 / _library(a).linalg.cond(a, 1)


def _least_squares(a: Any, b: Any, rcond: Any = 0.0) -> tuple[Any, int, Any]:
    found = _library(a, b).linalg.lstsq(_floats(a), _floats(b), rcond=rcond or None)
    return found[0], _DONE, plain(found[2])


def _eigenvalues(a: Any) -> tuple[Any, Any, Any, int]:
    values, vectors = _library(a).linalg.eig(_floats(a))
    return values.real, values.imag, _packed(values, vectors), _DONE


def _packed(values: Any, vectors: Any) -> Any:
    """The vectors of LAPACK: for a conjugate pair a column with the real and one with the imaginary part."""
    xp = _library(values)
    is_second = values.imag < 0.0
    before = xp.concatenate([vectors[:, :1], vectors[:, :-1]], axis=1)
    return xp.where(is_second, before.imag, vectors.real)


def _singular_values(a: Any) -> tuple[Any, Any, Any, int]:
    u, sigma, vt = _library(a).linalg.svd(_floats(a))
    return sigma, u, vt, _DONE


def _norm(a: Any, kind: str = "1") -> Any:
    order = {"M": None, "1": 1, "O": 1, "I": np.inf, "F": "fro", "E": "fro"}[kind.upper()]
    xp = _library(a)
    return plain(xp.max(xp.abs(a)) if order is None else xp.linalg.norm(_floats(a), order))


def _cholesky(a: Any, upper: bool = True) -> tuple[Any, int]:
    lower = _library(a).linalg.cholesky(_floats(a))
    return (lower.T if upper else lower), _DONE


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "dgesv": _solve,
    "dgesv_vec": _solve,
    "dgesvx": _transposed_solve,
    "dgels_vec": lambda a, b: _least_squares(a, b)[:2],
    "dgelsy": _least_squares,
    "dgelsy_vec": _least_squares,
    "dgeev": _eigenvalues,
    "dgeev_eigenValues": lambda a: (*_eigenvalues(a)[:2], _DONE),
    "dgesvd": _singular_values,
    "dgesdd": _singular_values,
    "dgesvd_sigma": lambda a: (_singular_values(a)[0], _DONE),
    "dlange": _norm,
    "dpotrf": _cholesky,
}
BY_NAME: dict[str, Callable[..., Any]] = {
    "Modelica.Math.Matrices.inv": lambda a: _library(a).linalg.inv(_floats(a)),
    "Modelica.Math.Matrices.det": lambda a: plain(_library(a).linalg.det(_floats(a))),
}
