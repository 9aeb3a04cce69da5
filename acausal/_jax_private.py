"""What is used of jax beyond its documented interface: a version that moves it is met here alone.

`jax.extend` and `jax.core` come without a promise of stability. The passes of the engine read programs (jaxprs), cut
and reassemble them, and know the primitives below by their names and parameters:

- calls: `jit` with `jaxpr`; `custom_jvp_call` with `call_jaxpr`; `custom_vjp_call` with `call_jaxpr` or `fun_jaxpr`
- `cond` with `branches`; `while` with `cond_nconsts`, `body_nconsts`, `cond_jaxpr`, `body_jaxpr`; `scan` with `jaxpr`,
  and with what `scan_counts` reads
- arithmetic, by name; `integer_pow` with `y`; `reduce_*` with `axes`; `concatenate` with `dimension`; `dot_general`
  with `dimension_numbers`
- indices: `dynamic_slice` with `slice_sizes`; `gather` with `dimension_numbers`, `slice_sizes` and `mode`
- what stands for several others, with what `spelled_out` and `high_level` read

`trace_context` tells the settings that `jax.jit` traces anew for, those of context managers included;
`backends_are_initialized` whether anything was compiled yet, after which XLA reads no flags.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

import jax
from jax import Array
from jax._src.config import trace_context as trace_context
from jax._src.xla_bridge import backends_are_initialized as backends_are_initialized
from jax.core import Tracer as Tracer
from jax.extend.core import ClosedJaxpr as ClosedJaxpr
from jax.extend.core import DebugInfo as DebugInfo
from jax.extend.core import Jaxpr as Jaxpr
from jax.extend.core import JaxprEqn as JaxprEqn
from jax.extend.core import Literal as Literal
from jax.extend.core import Primitive as Primitive
from jax.extend.core import Var as Var
from jax.extend.core import get_opaque_trace_state as get_opaque_trace_state
from jax.extend.core import jaxpr_as_fun as jaxpr_as_fun
from jax.extend.core import primitives as _primitives

Atom: TypeAlias = Var | Literal  # what an equation of a jaxpr reads
# For `inline` of `jax.jit`: the operations stand in what is traced; True means in what is compiled, since jax 0.12.
INLINE: Any = getattr(getattr(jax, "Inline", None), "JAX_EARLY", True)


def scan_counts(eqn: JaxprEqn) -> tuple[int, int]:
    """How many constants a `scan` reads, and how many values it carries; since jax 0.12 the inputs are in groups."""
    if "ft_in" not in eqn.params:
        return eqn.params["num_consts"], eqn.params["num_carry"]
    constants, carry, _ = eqn.params["ft_in"].unpack()
    return len(constants), len(carry)


def spelled_out(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """What a primitive computes that is short for several others; None for all else."""
    match eqn.primitive.name:
        case "polynomial":  # since jax 0.12
            return _traced(_polynomial, eqn)
        case "unstack":
            places, axis = range(len(eqn.outvars)), eqn.params["axis"]
            return _traced(lambda x: [jax.lax.index_in_dim(x, i, axis, keepdims=False) for i in places], eqn)
    return None


def high_level(eqn: JaxprEqn) -> Any:
    """The operation behind a primitive with rules of its own, such as a search in a sorted list; None for all else.

    Since jax 0.12. What it computes is `high_level_body`, how it is told from others its class with `params`.
    """
    return eqn.params["_prim"] if eqn.primitive.name == "call_hi_primitive" else None


def high_level_body(operation: Any) -> ClosedJaxpr:
    """What an operation computes, without its rules for derivatives."""
    return jax.make_jaxpr(lambda *values: operation.expand(*operation.in_tree.unflatten(values)))(
        *operation.in_avals_flat
    )


def _traced(function: Callable[..., Any], eqn: JaxprEqn) -> ClosedJaxpr:
    return jax.make_jaxpr(function)(*(atom.aval for atom in eqn.invars))


def _polynomial(x: Array, *coefficients: Array) -> Array:
    """By Horner's scheme, of coefficients from the constant one on."""
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


PRIMITIVES = frozenset(  # jax's own
    value
    for module in (_primitives, jax.lax, jax.lax.linalg)
    for value in vars(module).values()
    if isinstance(value, Primitive)
)
