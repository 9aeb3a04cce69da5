"""Private parts of each other library are used in one module only, and behave as expected."""

import re
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import acausal
from acausal import Scalar
from acausal._equinox_private import unvmap_any, while_loop
from acausal._jax_private import (
    INLINE,
    ClosedJaxpr,
    DebugInfo,
    Jaxpr,
    JaxprEqn,
    Literal,
    Tracer,
    Var,
    deserialized,
    jaxpr_as_fun,
    options,
    scan_counts,
    serialized,
)
from acausal._reduce.jaxpr import bind, called, differentiable_call, interpreted

FOLDER = Path(acausal.__file__).parent
PRIVATE = re.compile(
    r"\b(?:jax|equinox|eqx|diffrax|optimistix|lineax|jaxtyping)"
    r"\.(?:_\w+|internal|extend|core|interpreters|api_util|experimental|config\.values)\b"
)
HOMES = {"_jax_private.py", "_equinox_private.py"}


def test_other_modules_use_public_interfaces() -> None:
    """In the library and its components; prose about the modules is allowed to name them."""
    files = [file for folder in (FOLDER, FOLDER.parent / "components") for file in folder.rglob("*.py")]
    found = {
        file.name
        for file in files
        for line in file.read_text().splitlines()
        if PRIVATE.search(line) and (re.match(r"\s*(from|import) ", line) or "config.values" in line)
    }
    assert found == HOMES


def test_a_compiled_program_is_kept() -> None:
    new = float(uuid.uuid4().int % 2**40)  # a program that jax reads from its own cache cannot be serialised
    program = jax.jit(lambda x, y: [x + y, x * y + new]).lower(2.0, 3.0).compile()
    payload, n = serialized(program)
    assert [float(value) for value in deserialized(payload, 2, n)(2.0, 3.0)] == [5.0, 6.0 + new]


def test_settings_by_name() -> None:
    assert options()["jax_enable_x64"] is True


def test_programs_can_be_cut_and_reassembled() -> None:
    closed = jax.make_jaxpr(lambda x, y: 2.0 * x + jnp.sin(y))(1.0, 2.0)
    assert isinstance(closed, ClosedJaxpr)
    jaxpr = closed.jaxpr
    assert isinstance(jaxpr, Jaxpr)
    assert all(isinstance(atom, Var | Literal) for eqn in jaxpr.eqns for atom in eqn.invars)
    debug = DebugInfo("acausal", "equation", None, None)
    again = Jaxpr(jaxpr.constvars, jaxpr.invars, jaxpr.outvars, jaxpr.eqns, debug_info=debug)
    assert jaxpr_as_fun(ClosedJaxpr(again, closed.consts))(1.0, 2.0)[0] == pytest.approx(2.0 + np.sin(2.0))


@jax.custom_jvp
def _forward(x: Scalar) -> Scalar:
    return x


_forward.defjvps(lambda dx, out, x: dx)


@jax.custom_vjp
def _reverse(x: Scalar) -> Scalar:
    return x


_reverse.defvjp(lambda x: (x, None), lambda kept, dx: (dx,))

# A function, the primitive that it becomes, and the parameters by which the passes read that.
PRIMITIVES: list[tuple[Callable[..., Any], str, set[str]]] = [
    (jax.jit(lambda x: x + 1.0), "jit", {"jaxpr"}),
    (_forward, "custom_jvp_call", {"call_jaxpr"}),
    (_reverse, "custom_vjp_call", {"call_jaxpr"}),
    (lambda x: jax.lax.cond(x[0] > 0.0, jnp.sin, jnp.cos, x), "cond", {"branches"}),
    (
        lambda x: jax.lax.while_loop(lambda y: y[0] < 1.0, lambda y: y + 1.0, x),
        "while",
        {"cond_nconsts", "body_nconsts", "cond_jaxpr", "body_jaxpr"},
    ),
    (lambda x: jax.lax.scan(lambda c, y: (c + y, c), 0.0, x), "scan", {"jaxpr"}),
    (lambda x: x**3, "integer_pow", {"y"}),
    (jnp.sum, "reduce_sum", {"axes"}),
    (lambda x: jnp.concatenate([x, x]), "concatenate", {"dimension"}),
    (lambda x: jnp.dot(x, x), "dot_general", {"dimension_numbers"}),
    (lambda x: x[9], "dynamic_slice", {"slice_sizes"}),
    (lambda x: x[np.array([0, 9])], "gather", {"dimension_numbers", "slice_sizes", "mode"}),
]


@pytest.mark.parametrize(("function", "name", "read"), PRIMITIVES, ids=[name for _, name, _ in PRIMITIVES])
def test_primitives_are_called_as_the_passes_read_them(function: Callable[..., Any], name: str, read: set[str]) -> None:
    eqns = {eqn.primitive.name: eqn for eqn in jax.make_jaxpr(function)(jnp.ones(3)).jaxpr.eqns}
    assert read <= eqns[name].params.keys()


# Functions that some versions of jax make one primitive of, which stands for others.
SHORT: dict[str, Callable[[Any], Any]] = {
    "polynomial": lambda x: jnp.polyval(x, 3.0 * x[0]),
    "unstack": lambda x: jnp.unstack(x)[1],
    "unstacked columns": lambda x: jnp.unstack(x[:, None] * x, axis=1)[2],
    "place in a table": lambda x: jnp.searchsorted(x, 1.2, side="right"),
    "place in several tables": lambda x: jax.vmap(jnp.searchsorted)(jnp.stack([x, 2.0 * x]), x[1:]),
}
OPAQUE = {"polynomial", "unstack", "call_hi_primitive"}


def _spelled_out(closed: ClosedJaxpr, inputs: list[Any], met: set[str]) -> list[Any]:
    def outputs(eqn: JaxprEqn, values: list[Any]) -> list[Any]:
        inner = called(eqn) or differentiable_call(eqn)
        if inner is not None:
            return _spelled_out(inner, values, met)
        met.add(eqn.primitive.name)
        return list(bind(eqn, values))

    return interpreted(closed, inputs, outputs, jnp.asarray)


@pytest.mark.parametrize("name", SHORT)
def test_what_is_short_for_several_primitives_is_spelled_out(name: str) -> None:
    x, met = jnp.array([1.0, 1.2, 1.5]), set[str]()
    (found,) = _spelled_out(jax.make_jaxpr(SHORT[name])(x), [x], met)
    np.testing.assert_array_equal(found, SHORT[name](x))
    assert met
    assert not met & OPAQUE


def test_functions_can_be_traced_in_line() -> None:
    half = jax.jit(lambda x: jnp.sin(0.5 * x), inline=INLINE)
    assert [eqn.primitive.name for eqn in jax.make_jaxpr(half)(1.0).jaxpr.eqns] == ["mul", "sin"]


def test_counts_of_a_scan() -> None:
    """Two numbers that it reads in each turn, one that it carries, and an array that it goes along."""

    def scanned(a: Any, b: Any, x: Any) -> Any:
        return jax.lax.scan(lambda c, y: (a * c + b * y, c), 0.0, x)

    (eqn,) = [
        item for item in jax.make_jaxpr(scanned)(1.0, 2.0, jnp.ones(3)).jaxpr.eqns if item.primitive.name == "scan"
    ]
    assert scan_counts(eqn) == (2, 1)


def test_what_is_traced_is_a_tracer() -> None:
    seen: list[Any] = []
    jax.make_jaxpr(seen.append)(1.0)
    assert isinstance(seen[0], Tracer)


def test_bounded_loops_are_differentiable_in_both_modes() -> None:
    def halved(x: Scalar) -> Scalar:
        return while_loop(lambda y: y > 1.0, lambda y: y / 2.0, x, max_steps=16, kind="bounded", base=16)

    assert halved(12.0) == jnp.float64(0.75)
    assert jax.grad(halved)(12.0) == jax.jacfwd(halved)(12.0) == 1 / 16


def test_a_condition_of_a_whole_batch_is_one_number() -> None:
    condition = jnp.array([False, True])
    found = jax.vmap(lambda one: jnp.shape(unvmap_any(one)) == () and unvmap_any(one), out_axes=None)(condition)
    assert found
