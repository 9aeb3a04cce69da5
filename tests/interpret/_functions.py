"""Functions whose jaxprs hold all kinds of equations, with their arguments."""

import functools as ft
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from equinox import internal as eqxi
from jax import lax
from jax.ad_checkpoint import checkpoint_name

MATRIX = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
SIDE = np.array([1.0, -2.0, 0.5])


@jax.custom_jvp
def safe_root(x: Any) -> Any:
    return jnp.sqrt(jnp.maximum(x, 0.0))


safe_root.defjvp(lambda x, dx: (safe_root(*x), dx[0] * jnp.where(x[0] > 0.0, 0.5 / safe_root(*x), 0.0)))


@jax.custom_vjp
def clipped(x: Any, most: Any) -> Any:
    return jnp.minimum(x, most)


clipped.defvjp(lambda x, most: (clipped(x, most), (x, most)), lambda kept, g: (g * 0.5, kept[1] * g))


def several_jits(x: Any) -> Any:
    double = jax.jit(lambda y: 2.0 * y + jnp.sin(1.0))
    return jax.jit(lambda y: double(double(y)) + double(y))(x), double(x), double(x)


def custom_solve(a: Any, b: Any) -> Any:
    def solve(matvec: Any, b: Any) -> Any:
        return b / matvec(jnp.ones_like(b)) * 2.0

    return lax.custom_linear_solve(lambda x: a * x / 2.0, b, solve, transpose_solve=solve)


def twice(x: Any, y: Any) -> Any:
    """The same equations twice, also with literals, and some that nobody reads."""
    _ = jnp.exp(x) + lax.while_loop(lambda s: s < 10.0, lambda s: s + 1.0, y)
    return jnp.sin(x * y) + 1.0, jnp.sin(x * y) - 1.0, jnp.sin(y * x), x + 0.0, x - 0.0, x, 3.0, x


def lineax_solve(a: Any, b: Any, throw: bool = False) -> Any:
    def solved(solver: Any, operator: Any) -> Any:
        return lx.linear_solve(operator, b, solver, throw=throw).value

    symmetric = lx.MatrixLinearOperator(a, lx.positive_semidefinite_tag)
    return [solved(lx.LU(), lx.MatrixLinearOperator(a)), solved(lx.Cholesky(), symmetric), solved(lx.QR(), symmetric)]


def checkpointed(x: Any) -> Any:
    return eqxi.while_loop(
        lambda s: s[1] < 5, lambda s: (jnp.sin(s[0]) + 1.0, s[1] + 1), (x, 0), max_steps=16, kind="checkpointed"
    )


def root(x: Any) -> Any:
    found = optx.root_find(lambda y, a: y**3 + y - a, optx.Newton(1e-10, 1e-10), x, args=x, throw=False)
    return found.value, found.stats["num_steps"]


def nest(x: Any, n: Any) -> Any:
    def outer(i: Any, s: Any) -> Any:
        inner = lax.fori_loop(0, i, lambda j, y: y + jnp.sin(y) / (j + 1), s)
        rows = lax.scan(lambda c, k: (c * k, c + 1.0), inner, jnp.arange(3.0), reverse=True)[1]
        return lax.switch(i % 4, [jnp.sin, lambda y: y / 2, lambda y: rows[2] + y, lambda y: y * SIDE[1]], inner)

    return lax.fori_loop(0, n, outer, x)


def partly_read(x: Any) -> Any:
    """Inner jaxprs of which only some results are read."""

    def step(c: Any, _: Any) -> Any:
        halved = lax.cond(c[0] > 0.2, lambda c: (c[0] * 0.5, c[1] + 1.0, c[2]), lambda c: (c[0], c[1], c[2] * c[0]), c)
        return halved, c[1]

    return lax.scan(step, (x, x, x), None, length=3)[0][0]


def for_transformations(x: Any, which: Any, n: Any) -> Any:
    """Primitives that do nothing outside of transformations."""
    same = checkpoint_name(jnp.copy(lax.stop_gradient(x)), "x"), eqxi.nontraceable(x, name="x"), eqxi.nonbatchable(x)
    unbatched = eqxi.unvmap_any(which), eqxi.unvmap_all(which), eqxi.unvmap_max(n), eqxi.unvmap_any(which[0])
    return same, eqxi.nondifferentiable_backward((x, n)), unbatched


def equal_branches(x: Any) -> Any:
    """Jaxprs that occur in several places."""
    step = jax.jit(lambda y: lax.cond(y > 1.0, jnp.sin, jnp.cos, y) + SIDE)
    return step(x), step(x), step(step(x)[0])


def known_choice(x: Any) -> Any:
    return lax.platform_dependent(x, cpu=jnp.sin, default=jnp.cos), lax.cond(True, jnp.exp, jnp.log, x)


FUNCTIONS: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "calls": (several_jits, (0.3,)),
    "custom jvp": (lambda x: (safe_root(x), jax.grad(safe_root)(x)), (2.0,)),
    "custom vjp": (lambda x: (clipped(x, 1.0), jax.grad(clipped)(x, 2.0)), (1.5,)),
    "custom linear solve": (custom_solve, (SIDE + 3.0, SIDE)),
    "solve": (lambda a, b: (jnp.linalg.solve(a, b), jnp.linalg.inv(a)), (MATRIX, SIDE)),
    "factors": (lambda a, b: jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(a), b), (MATRIX, SIDE)),
    "checkpoint": (lambda x: jax.grad(jax.checkpoint(lambda y: jnp.sin(jnp.exp(y))))(x), (0.3,)),
    "lineax": (lineax_solve, (MATRIX, SIDE)),
    "derivative of lineax": (lambda a, b: jax.jvp(lineax_solve, (a, b), (a, b))[1], (MATRIX, SIDE)),
    "equinox": (lambda x: (checkpointed(x), eqxi.nondifferentiable_backward(eqxi.nonbatchable(x))), (0.3,)),
    "derivative of equinox": (lambda x: jax.grad(lambda y: checkpointed(y)[0])(x), (0.3,)),
    "equinox calls": (lambda x: eqx.filter_checkpoint(eqxi.noinline(jnp.sin))(x), (0.3,)),
    "optimistix": (root, (2.0,)),
    "nest": (nest, (0.7, 6)),
    "partly read": (partly_read, (0.3,)),
    "batch of nests": (jax.vmap(nest), (np.array([0.7, -1.0]), np.array([6, 3]))),
    "equal branches": (equal_branches, (SIDE[0],)),
    "constants": (lambda x: (x @ MATRIX, x + SIDE, jnp.asarray(SIDE)[1], MATRIX.astype(np.float32)), (SIDE,)),
    "twice": (twice, (0.3, 2.0)),
    "known choice": (known_choice, (0.3,)),
    "indices": (lambda x, i: (x.at[i].add(1.0), x.at[i].set(2.0), jnp.take(x, i)), (SIDE, np.array([0, 2, 5, -1]))),
    "types": (lambda x: (x.astype(np.float32), x.astype(int), x > 0.0, jnp.sum(x > 0.0), x * 1j), (SIDE,)),
    "for transformations": (for_transformations, (0.3, np.array([False, True]), np.array([3, 1]))),
    "nothing": (lambda x: (), (1.0,)),
}
CALLING = {  # Python, which no other process can
    "errors": (ft.partial(lineax_solve, throw=True), (MATRIX, SIDE)),
    "derivative of lineax": FUNCTIONS.pop("derivative of lineax"),
    "equinox calls": FUNCTIONS.pop("equinox calls"),
}
