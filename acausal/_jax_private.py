"""The undocumented parts of jax that the library uses; a new version of jax needs changes only here.

`jax.extend` and `jax.core` promise no stability. The passes of the engine read, cut and reassemble programs (jaxprs).
They identify these primitives by name and parameters:

- calls: `jit` with `jaxpr`; `custom_jvp_call` with `call_jaxpr`; `custom_vjp_call` with `call_jaxpr` or `fun_jaxpr`
- `cond` with `branches`; `while` with `cond_nconsts`, `body_nconsts`, `cond_jaxpr`, `body_jaxpr`; `scan` with `jaxpr`
  and the parameters that `scan_counts` reads
- arithmetic, by name; `integer_pow` with `y`; `reduce_*` with `axes`; `concatenate` with `dimension`; `dot_general`
  with `dimension_numbers`
- indices: `dynamic_slice` with `slice_sizes`; `gather` with `dimension_numbers`, `slice_sizes` and `mode`
- composite primitives, with the parameters that `spelled_out` and `high_level` read

`trace_context` returns the settings, including those of context managers, that make `jax.jit` trace again.
`backends_are_initialized` tells whether jax has compiled anything yet; XLA reads no flags after that. `options` are all
settings of jax. In the context `outside_transformations`, a rule of `jax.custom_jvp` evaluates known numbers as if jax
transformed nothing. `serialized` and `deserialized` keep a compiled program for another process. For none of them is
there anything public.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, TypeAlias

import jax
import numpy as np
from jax import Array
from jax._src.config import trace_context as trace_context
from jax._src.core import eval_context
from jax._src.interpreters.partial_eval import dce_jaxpr
from jax._src.lax.linalg import geqrf_p
from jax._src.xla_bridge import backends_are_initialized as backends_are_initialized
from jax.core import ShapedArray
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
from jax.extend.core import new_jaxpr_eqn as _new_jaxpr_eqn
from jax.extend.core import primitives as _primitives

Atom: TypeAlias = Var | Literal  # an input of an equation of a jaxpr
# For `inline` of `jax.jit`: inline while tracing. Since jax 0.12, True inlines only while compiling.
INLINE: Any = getattr(getattr(jax, "Inline", None), "JAX_EARLY", True)


def outside_transformations() -> AbstractContextManager[Any]:
    """A context for known numbers within a rule of `jax.custom_jvp`."""
    return eval_context()


def options() -> dict[str, Any]:
    """The settings of jax by name, outside of context managers."""
    return dict(jax.config.values)  # pyright: ignore[reportAttributeAccessIssue]


def serialized(program: Any) -> tuple[bytes, int]:
    """A compiled program of flat inputs and outputs, and the number of its outputs."""
    from jax.experimental import serialize_executable

    payload, _, outputs = serialize_executable.serialize(program)
    return payload, outputs.num_leaves


def deserialized(payload: bytes, n_inputs: int, n_outputs: int) -> Any:
    """The program that `serialized` kept; it returns a list."""
    from jax.experimental import serialize_executable

    takes, gives = jax.tree.structure((tuple(range(n_inputs)), {})), jax.tree.structure(list(range(n_outputs)))
    return serialize_executable.deserialize_and_load(payload, takes, gives)


def pruned(jaxpr: Jaxpr, used: Sequence[bool]) -> tuple[Jaxpr, list[bool]]:
    """The part of a jaxpr that computes the used outputs, and which inputs it reads. Inner jaxprs are pruned too."""
    return dce_jaxpr(jaxpr, list(used))


def scan_counts(eqn: JaxprEqn) -> tuple[int, int]:
    """Numbers of the constants and of the carried values of a `scan`. Since jax 0.12, its inputs are in groups."""
    if "ft_in" not in eqn.params:
        return eqn.params["num_consts"], eqn.params["num_carry"]
    constants, carry, _ = eqn.params["ft_in"].unpack()
    return len(constants), len(carry)


def new_equation(inputs: Sequence[Atom], outputs: Sequence[Var], primitive: Primitive, params: Any) -> JaxprEqn:
    """An equation of a jaxpr, without effects."""
    return _new_jaxpr_eqn(inputs, outputs, primitive, params, frozenset())


def spelled_out(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """The jaxpr of a composite primitive; None for others."""
    match eqn.primitive.name:
        case "polynomial":  # since jax 0.12
            return _traced(_polynomial, eqn)
        case "unstack":
            places, axis = range(len(eqn.outvars)), eqn.params["axis"]
            return _traced(lambda x: [jax.lax.index_in_dim(x, i, axis, keepdims=False) for i in places], eqn)
    return None


def high_level(eqn: JaxprEqn) -> Any:
    """The operation of a high-level primitive, such as a search in a sorted list; None for others.

    Since jax 0.12. `high_level_body` is its jaxpr; its class and `params` identify it.
    """
    return eqn.params["_prim"] if eqn.primitive.name == "call_hi_primitive" else None


def high_level_body(operation: Any) -> ClosedJaxpr:
    """The jaxpr of an operation, without its rules for derivatives."""
    return jax.make_jaxpr(lambda *values: operation.expand(*operation.in_tree.unflatten(values)))(
        *operation.in_avals_flat
    )


def _traced(function: Callable[..., Any], eqn: JaxprEqn) -> ClosedJaxpr:
    return jax.make_jaxpr(function)(*(atom.aval for atom in eqn.invars))


def _polynomial(x: Array, *coefficients: Array) -> Array:
    """Horner's scheme; the constant coefficient comes first."""
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
NAMED_PRIMITIVES = {primitive.name: primitive for primitive in (*PRIMITIVES, geqrf_p)}


def shaped(shape: tuple[int, ...], dtype: Any, weak_type: bool) -> Any:
    """The type of a value in a jaxpr."""
    return ShapedArray(shape, np.dtype(dtype), weak_type=weak_type)
