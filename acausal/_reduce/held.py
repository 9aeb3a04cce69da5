"""The conditions of `ifelse` in traced equations, and the equations with their truths as additional inputs."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._declare.annotations import Declaration
from .._declare.ifelse import HELD
from .._errors import ModelError
from .._jax_private import ClosedJaxpr, JaxprEqn, jaxpr_as_fun
from .jaxpr import bind, called, interpreted, slice_outputs, structs

TRUTH = Declaration(role="discrete", unit="1", start=0.0)
_LOOPS = ("cond", "while", "scan")


class Held(NamedTuple):
    """`equations` reads the truths, 0 or 1, after its other inputs. `conditions` computes them from the inputs and the
    truths of other conditions.
    """

    equations: ClosedJaxpr
    conditions: ClosedJaxpr
    shapes: tuple[tuple[int, ...], ...]


def with_truths(closed: ClosedJaxpr, where: str) -> Held:
    """The traced `equations`, split. Raises `ModelError` for an `ifelse` within a loop."""
    shapes = tuple(_shapes(closed, where))
    n, n_truths = len(closed.jaxpr.invars), len(shapes)
    if not n_truths:
        return Held(closed, closed, ())

    def apart(*inputs: Array) -> tuple[list[Array], list[Array]]:
        truths, found = list(inputs[n:]), []

        def outputs(eqn: JaxprEqn, args: list[Array]) -> Sequence[Array]:
            if _is_held(eqn):
                found.append(args[0])
                return [truths[len(found) - 1] > 0.5]
            inner = called(eqn)
            return bind(eqn, args) if inner is None else interpreted(inner, args, outputs, jnp.asarray)

        return interpreted(closed, inputs[:n], outputs, jnp.asarray), found

    both = jax.make_jaxpr(apart)(*structs([var.aval.shape for var in closed.jaxpr.invars]), *structs(shapes))
    m = len(closed.jaxpr.outvars)
    # All inputs stay, so that their positions do.
    return Held(_outputs(both, slice(0, m)), _outputs(both, slice(m, m + n_truths)), shapes)


def _outputs(closed: ClosedJaxpr, outputs: slice) -> ClosedJaxpr:
    piece = slice_outputs(closed, outputs)
    inner = piece.jaxpr

    def function(*inputs: Array) -> list[Array]:
        return list(jaxpr_as_fun(inner)(*(inputs[i] for i in piece.used)))

    return jax.make_jaxpr(function)(
        *(jax.ShapeDtypeStruct(var.aval.shape, var.aval.dtype) for var in closed.jaxpr.invars)
    )


def _is_held(eqn: JaxprEqn) -> bool:
    return eqn.primitive.name in ("jit", "pjit") and eqn.params.get("name") == HELD


def _shapes(closed: ClosedJaxpr, where: str) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []
    for eqn in closed.jaxpr.eqns:
        if _is_held(eqn):
            found.append(tuple(eqn.outvars[0].aval.shape))
        elif eqn.primitive.name in _LOOPS or eqn.primitive.name.startswith("custom_"):
            if HELD in str(eqn):
                raise ModelError(
                    f"{where} uses ifelse within {eqn.primitive.name}, but each ifelse holds only one "
                    "truth value. Remedy: state it outside, or use jnp.where there."
                )
        elif (inner := called(eqn)) is not None:
            found += _shapes(inner, where)
    return found
