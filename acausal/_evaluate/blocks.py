"""Running a block program: explicit, linear and non-linear."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree

from .affine import Affine, Minus, computed, evaluate, negated, over, plus, scale, solved_for, times
from .program import Arg, Program, Step

ITERATIONS = 100
HUGE = 1e100
# Both methods converge quadratically: a last step this small leaves an error near rounding. A trust region stalls where
# rounding hides the progress of a step, so its tolerance stays well above.
NEWTON = optx.Newton(rtol=1e-9, atol=1e-9)
# Powell's dogleg: Newton's steps, shortened where they do not help, as where a diode's exponential overshoots.
DOGLEG = optx.Dogleg(rtol=1e-7, atol=1e-7)
UNROLLED = 6  # linear systems up to this size are eliminated in the traced program, larger ones by LAPACK


class Known:
    """What a program reads: parameters, values computed before, and time."""

    def __init__(self, params: Sequence[Any], values: Sequence[Any], time: Any) -> None:
        self.params, self.values, self.time = params, values, time

    def read(self, arg: Arg) -> Affine:
        match arg.source:
            case "param":
                return Affine(self.params[arg.number])
            case "value":
                return scale(Affine(self.values[arg.number]), float(arg.sign))
            case "time":
                return scale(Affine(self.time), float(arg.sign))
            case "one":
                return Affine(float(arg.sign))
            case _:
                return Affine()


def run(program: Program, known: Known, guesses: Sequence[Any]) -> list[Any]:
    """The unknowns of a block, steps first and then tearing variables; `guesses` start a non-linear solve.

    They may be `Minus` arrays, whose sign is left to whoever reads them.
    """
    if program.kind == "explicit":
        return [0.0 if value.base is None else value.base for value in _substitute(program, known, {})]
    if program.kind == "linear" and program.is_elementwise and program.n_tears <= UNROLLED:
        return _linear(program, known)
    tears = _dense(program, known) if program.kind == "linear" else _nonlinear(program, known, guesses)
    return _with_tears(program, known, tears)


def residuals(program: Program, known: Known) -> list[Any]:
    """The residuals of a program without unknowns."""
    return _residuals(program, known, [])


def _residual(step: Step, known: Known, unknowns: dict[int, Affine]) -> Affine:
    args = [
        scale(unknowns[arg.number], float(arg.sign)) if arg.source == "unknown" else known.read(arg)
        for arg in step.args
    ]
    return evaluate(step.template.jaxpr, args)[0]


def _substitute(program: Program, known: Known, tears: dict[int, Affine]) -> list[Affine]:
    """Solve the steps one after the other; the results are affine in whatever symbols the tearing variables hold."""
    unknowns = dict(tears)
    for step in program.steps:
        assert step.solved is not None
        unknowns[step.solved] = Affine(None, {step.solved: 1.0})
        value = solved_for(_residual(step, known, unknowns), step.solved)
        unknowns[step.solved] = _shaped(value, program.shapes[step.solved])
    return [unknowns[i] for i in range(len(program.shapes))]


def _shaped(value: Affine, shape: tuple[int, ...]) -> Affine:
    if value.base is None and (value.terms or not shape):
        return value
    if isinstance(value.base, Minus) and value.base.array.shape == shape:
        return value
    base = jnp.broadcast_to(jnp.asarray(value.value(), float), shape)
    return Affine(base, value.terms)


def _tear_indices(program: Program) -> range:
    return range(len(program.steps), len(program.shapes))


def _linear(program: Program, known: Known) -> list[Any]:
    """Eliminate the steps symbolically; what is left is a small system for the tearing variables, A x + b = 0."""
    indices = list(_tear_indices(program))
    unknowns, rows = _symbolic(program, known)
    solution = _eliminated([[row.terms.get(i) for i in indices] for row in rows], [row.base for row in rows])
    return [_inserted(value, dict(zip(indices, solution, strict=True))) for value in unknowns]


def _symbolic(program: Program, known: Known) -> tuple[list[Affine], list[Affine]]:
    """The unknowns and the residuals as affine functions of the tearing variables."""
    unknowns = _substitute(program, known, {i: Affine(None, {i: 1.0}) for i in _tear_indices(program)})
    return unknowns, [_residual(step, known, dict(enumerate(unknowns))) for step in program.residuals]


def tear_matrix(program: Program, known: Known) -> Any:
    """The square matrices, stacked, of the linear equations that determine the tearing variables."""
    if not program.is_elementwise:
        return _dense_system(program, known)[0][None]
    rows, shape, indices = _symbolic(program, known)[1], program.shapes[0], _tear_indices(program)
    entries = [[jnp.broadcast_to(computed(row.terms.get(i, 0.0)), shape) for i in indices] for row in rows]
    return jnp.moveaxis(jnp.array(entries).reshape(len(rows), len(rows), -1), -1, 0)


def _inserted(value: Affine, tears: dict[int, Any]) -> Any:
    total = value.base
    for symbol, factor in value.terms.items():
        total = plus(total, times(factor, tears[symbol]))
    return 0.0 if total is None else total


def _eliminated(matrix: list[list[Any]], constant: list[Any]) -> list[Any]:
    """Solve A x + b = 0, entry by entry, with partial pivoting; None stands for a structural zero."""
    n = len(matrix)
    if n == 1:
        return [0.0 if constant[0] is None else negated(over(constant[0], matrix[0][0]))]
    rows = [
        [0.0 if value is None else computed(value) for value in (*row, b)]
        for row, b in zip(matrix, constant, strict=True)
    ]
    for k in range(n):
        for other in range(k + 1, n):
            swap = jnp.abs(rows[other][k]) > jnp.abs(rows[k][k])
            above = [jnp.where(swap, b, a) for a, b in zip(rows[k], rows[other], strict=True)]
            rows[other] = [jnp.where(swap, a, b) for a, b in zip(rows[k], rows[other], strict=True)]
            rows[k] = above
        for other in range(k + 1, n):
            factor = rows[other][k] / rows[k][k]
            rows[other] = [b - factor * a for a, b in zip(rows[k], rows[other], strict=True)]
    x: list[Any] = [0.0] * n
    for k in reversed(range(n)):
        x[k] = -(rows[k][n] + sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x


def _with_tears(program: Program, known: Known, tears: Sequence[Any]) -> list[Any]:
    given = {i: Affine(value) for i, value in zip(_tear_indices(program), tears, strict=True)}
    return [value.value() for value in _substitute(program, known, given)]


def _residuals(program: Program, known: Known, tears: Sequence[Any]) -> list[Any]:
    unknowns = {i: Affine(value) for i, value in enumerate(_with_tears(program, known, tears))}
    return [
        jnp.broadcast_to(jnp.asarray(_residual(step, known, unknowns).value(), float), step.template.shape)
        for step in program.residuals
    ]


def _dense(program: Program, known: Known) -> list[Any]:
    """A linear system with array unknowns or many of them: its matrix by differentiation, solved by LAPACK."""
    matrix, rest, unravel = _dense_system(program, known)
    return unravel(-jnp.linalg.solve(matrix, rest))


def _dense_system(program: Program, known: Known) -> tuple[Any, Any, Callable[[Any], list[Any]]]:
    """A and b of A x + b = 0, and x as tearing variables."""
    zeros = [jnp.zeros(program.shapes[i]) for i in _tear_indices(program)]
    flat, unravel = ravel_pytree(zeros)

    def residual(x: Any) -> Any:
        return ravel_pytree(_residuals(program, known, unravel(x)))[0]

    return jax.jacfwd(residual)(flat), residual(flat), unravel


def _nonlinear(program: Program, known: Known, guesses: Sequence[Any]) -> list[Any]:
    """Newton's method from the guesses, or Powell's where it fails, differentiated by the implicit function theorem.

    Unknowns are measured in their nominal sizes, and each residual in the change that such a step makes in it at the
    guess, so that one tolerance fits pascals and cubic millimetres.
    """
    start, unravel = ravel_pytree([jnp.asarray(guess, float) for guess in guesses])
    sizes = np.concatenate([np.full(np.size(g), size) for g, size in zip(guesses, program.sizes, strict=True)])

    def residual(x: Any, args: Any) -> Any:
        params, values, time = args
        return ravel_pytree(_residuals(program, Known(params, values, time), unravel(sizes * x)))[0]

    values = [computed(value) for value in known.values]
    args = jax.tree_util.tree_map(jnp.asarray, (list(known.params), values, known.time))
    slopes = jax.lax.stop_gradient(jax.jacfwd(residual)(start / sizes, args))
    root = scaled_root(residual, start / sizes, args, row_scale(slopes), NEWTON, DOGLEG)
    return unravel(sizes * root)


def row_scale(slopes: Any) -> Any:
    """How much a step of size 1 in the unknowns changes each residual; 1 where that is not known."""
    total = jnp.sum(jnp.abs(slopes), axis=1)
    return jnp.where(jnp.isfinite(total) & (total > 0), total, 1.0)


def scaled_root(residual: Callable[[Any, Any], Any], start: Any, args: Any, scale: Any, *methods: Any) -> Any:
    """A root of a function of unknowns of size 1, with residuals of size `scale`; NaN where none is found.

    The `methods` are tried in turn until one succeeds. Only the root is differentiated: where a method ends that fails,
    the function may have no derivative.
    """

    def scaled(x: Any, args: Any) -> Any:
        scale, args = args
        # A trial step into overflow must count as a bad one, which infinity or NaN do not in a comparison.
        value = residual(x, args) / scale
        return jnp.where(jnp.isfinite(value), value, HUGE)

    return jax.lax.custom_root(
        lambda x: scaled(x, (scale, args)),
        start,
        lambda _, x: _first_root(scaled, x, jax.lax.stop_gradient((scale, args)), methods),
        _solved,
    )


def _solved(slope: Callable[[Any], Any], value: Any) -> Any:
    """The x of a linear function at which it has a value."""
    matrix = jax.jacfwd(slope)(jnp.zeros_like(value))
    if len(value) > UNROLLED:
        return jnp.linalg.solve(matrix, value)
    return jnp.stack([computed(x) for x in _eliminated([list(row) for row in matrix], list(-value))])


def _first_root(residual: Callable[[Any, Any], Any], start: Any, args: Any, methods: Sequence[Any]) -> Any:
    if not methods:
        return jnp.full_like(start, jnp.nan)
    found = optx.root_find(residual, methods[0], start, args, max_steps=ITERATIONS, throw=False)
    succeeded = (found.result == optx.RESULTS.successful) & jnp.all(jnp.isfinite(found.value))
    return jax.lax.cond(succeeded, lambda: found.value, lambda: _first_root(residual, start, args, methods[1:]))
