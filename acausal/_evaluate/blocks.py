"""Evaluation of a block program: explicit, linear or nonlinear."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from .._numbers import Numbers
from .._reduce.incidence import is_within, within
from .affine import Affine, Minus, Value, computed, evaluate, plus, scale, solved_for, times
from .elimination import SMALL, eliminated, stacked
from .program import Arg, Program, Step
from .roots import scaled_root


class Known:
    """The inputs of a program: parameters, values computed before, and time. `ahead` is the time by which each timed
    equation is ahead, or empty.
    """

    def __init__(
        self, params: Sequence[Array], values: Sequence[Value], time: Numbers, ahead: Sequence[Numbers] = ()
    ) -> None:
        self.params, self.values, self.time, self.ahead = params, values, time, ahead

    def read(self, arg: Arg) -> Affine:
        match arg.source:
            case "param":
                return Affine(self.params[arg.number])
            case "value":
                return scale(Affine(self.values[arg.number]), float(arg.sign))
            case "time":
                time = self.time + self.ahead[arg.number] if self.ahead else self.time
                return scale(Affine(time), float(arg.sign))
            case "one":
                return Affine(float(arg.sign))
            case _:
                return Affine()


def evaluate_block(program: Program, known: Known, guesses: Sequence[Array]) -> Sequence[Value]:
    """The unknowns of a block: steps first, then tearing variables. A nonlinear solve starts from `guesses`, [tries,
    ...].

    They can be `Minus` arrays, whose sign the reader applies. Values outside their range are NaN.
    """
    return [
        within(computed(value), ranges) if ranges else value
        for value, ranges in zip(_unknowns(program, known, guesses), program.ranges, strict=True)
    ]


def _unknowns(program: Program, known: Known, guesses: Sequence[Array]) -> Sequence[Value]:
    if program.weights is not None:
        return [jnp.tensordot(program.weights, jnp.asarray(computed(known.values[0])), 1)]
    if program.method == "explicit":
        return [0.0 if value.base is None else value.base for value in _substitute(program, known, {})]
    if program.method == "linear" and program.is_elementwise and program.n_tears <= SMALL:
        return _linear(program, known)
    tears = _dense(program, known) if program.method == "linear" else _nonlinear(program, known, guesses)
    return with_tears(program, known, tears)


def residuals(program: Program, known: Known) -> list[Array]:
    """The residuals of a program without unknowns."""
    return residuals_at(program, known, [])


def _residual(step: Step, known: Known, unknowns: dict[int, Affine]) -> Affine:
    args = [
        scale(unknowns[arg.number], float(arg.sign)) if arg.source == "unknown" else known.read(arg)
        for arg in step.args
    ]
    return evaluate(step.template.jaxpr, args)[0]


def _substitute(program: Program, known: Known, tears: dict[int, Affine]) -> list[Affine]:
    """Solve the steps one after the other. The results are affine in the symbols of the tearing variables."""
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


def _linear(program: Program, known: Known) -> list[Value]:
    """Eliminate the steps symbolically. A small system for the tearing variables remains, A x + b = 0."""
    indices = list(_tear_indices(program))
    unknowns, rows = _symbolic(program, known)
    solution = eliminated([[row.terms.get(i) for i in indices] for row in rows], [row.base for row in rows])
    return [_inserted(value, dict(zip(indices, solution, strict=True))) for value in unknowns]


def _symbolic(program: Program, known: Known) -> tuple[list[Affine], list[Affine]]:
    """The unknowns and the residuals as affine functions of the tearing variables."""
    unknowns = _substitute(program, known, {i: Affine(None, {i: 1.0}) for i in _tear_indices(program)})
    return unknowns, [_residual(step, known, dict(enumerate(unknowns))) for step in program.residuals]


def tear_matrix(program: Program, known: Known) -> Array:
    """The square matrices, stacked, of the linear equations that determine the tearing variables."""
    if not program.is_elementwise:
        return _dense_system(program, known)[0][None]
    rows = _symbolic(program, known)[1]
    return stacked([[computed(row.terms.get(i)) for i in _tear_indices(program)] for row in rows])


def _inserted(value: Affine, tears: dict[int, Value]) -> Value:
    total = value.base
    for symbol, factor in value.terms.items():
        total = plus(total, times(factor, tears[symbol]))
    return 0.0 if total is None else total


def with_tears(program: Program, known: Known, tears: Sequence[Array]) -> list[Numbers]:
    """All unknowns of a block from its tearing variables."""
    given = {i: Affine(value) for i, value in zip(_tear_indices(program), tears, strict=True)}
    return [value.value() for value in _substitute(program, known, given)]


def residuals_at(program: Program, known: Known, tears: Sequence[Array]) -> list[Array]:
    """The residuals of a block for some values of its tearing variables."""
    return _remaining(program, known, with_tears(program, known, tears))


def _remaining(program: Program, known: Known, unknowns: Sequence[Numbers]) -> list[Array]:
    """The residuals of a block for some values of all its unknowns."""
    at = {i: Affine(value) for i, value in enumerate(unknowns)}
    return [
        jnp.broadcast_to(jnp.asarray(_residual(step, known, at).value(), float), step.template.shape)
        for step in program.residuals
    ]


def _dense(program: Program, known: Known) -> list[Array]:
    """A linear system with array unknowns, or many of them: its matrix by differentiation, solved by LAPACK."""
    matrix, rest, unravel = _dense_system(program, known)
    return unravel(-jnp.linalg.solve(matrix, rest))


def _dense_system(program: Program, known: Known) -> tuple[Array, Array, Callable[[Array], list[Array]]]:
    """A and b of A x + b = 0, and x as tearing variables."""
    zeros = [jnp.zeros(program.shapes[i]) for i in _tear_indices(program)]
    flat, unravel = ravel_pytree(zeros)

    def residual(x: Array) -> Array:
        return ravel_pytree(residuals_at(program, known, unravel(x)))[0]

    return jax.jacfwd(residual)(flat), residual(flat), unravel


def _nonlinear(program: Program, known: Known, guesses: Sequence[Array]) -> list[Array]:
    """The tearing variables by `scaled_root` from the guesses, with all unknowns in their ranges.

    Unknowns are scaled by their nominal sizes, so one tolerance suits pascals and cubic millimetres.
    """
    unravel = ravel_pytree([jnp.asarray(guess[0], float) for guess in guesses])[1]
    starts = jnp.stack([ravel_pytree(guess)[0] for guess in zip(*guesses, strict=True)])
    block = _nonlinear_block(program, tuple(np.shape(guess[0]) for guess in guesses))
    values = [computed(value) for value in known.values]
    args = jax.tree_util.tree_map(jnp.asarray, (list(known.params), values, known.time, list(known.ahead)))
    root = scaled_root(block.residual, starts / block.sizes, args)
    return unravel(root * block.sizes)


@dataclasses.dataclass(frozen=True)
class _Nonlinear:
    """The equations of a nonlinear block, as functions of the scaled tearing variables."""

    program: Program
    shapes: tuple[tuple[int, ...], ...]  # of the tearing variables

    @property
    def sizes(self) -> np.ndarray:
        pairs = zip(self.shapes, self.program.sizes, strict=True)
        return np.concatenate([np.full(math.prod(shape), size) for shape, size in pairs])

    def residual(self, x: Array, args: PyTree) -> tuple[Array, Array]:
        """The residuals, and whether all unknowns are in their ranges."""
        known, tears = Known(*args), self._tears(x)
        unknowns = with_tears(self.program, known, tears)
        inside = [
            is_within(value, ranges) for value, ranges in zip(unknowns, self.program.ranges, strict=True) if ranges
        ]
        is_inside = jnp.all(jnp.stack([jnp.all(truth) for truth in inside])) if inside else jnp.asarray(True)
        return ravel_pytree(_remaining(self.program, known, unknowns))[0], is_inside

    def _tears(self, x: Array) -> list[Array]:
        return ravel_pytree([jnp.zeros(shape) for shape in self.shapes])[1](x * self.sizes)


@ft.lru_cache(maxsize=256)
def _nonlinear_block(program: Program, shapes: tuple[tuple[int, ...], ...]) -> _Nonlinear:
    """The same object for equal blocks, so that the search for their roots is traced once."""
    return _Nonlinear(program, shapes)
