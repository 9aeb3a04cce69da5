"""Rosenbrock methods for stiff ODEs and index-1 DAEs, as diffrax solvers, independent of the coefficients."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PyTree

from ..._errors import ParameterError
from ..._linear_solver import Factors, factors_of, linear_solver
from ..._numbers import Numbers
from ..._sparse_matrix import Pattern, SparseFactors, SparseMatrix

if TYPE_CHECKING:
    from typing import ClassVar as AbstractClassVar
else:
    from equinox import AbstractClassVar

Scalar = Float[Array, ""]
State = Float[Array, " n"]
Matrix = Float[Array, "n n"]
Stages = Float[Array, "s n"] | list[State]
LARGEST_CONSTANT = 100
LARGEST_FUSED = 100  # length of stages above which XLA on CPU hands their sums to a library with threads
FILTERS = 4  # passes that remove the non-stiff part of a correction
SLOWLY, FAST = 8, 512  # decay exponents, within a step, of the corrections at its end and at its start
AT_ONCE = 2**30  # decay exponent of the rounding error at the start
Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
VectorField = Callable[[Scalar, State], State]


@dataclass(frozen=True, eq=False)
class RosenbrockTableau:
    r"""Coefficients of a stiffly accurate Rosenbrock method of $s$ stages, in the transformed form of Hairer & Wanner
    (Solving Ordinary Differential Equations II, section IV.7, eq. 7.25), which needs no products with the Jacobian.

    With $\alpha$ and $\Gamma$ the matrices of the original form: $a = \alpha\,\Gamma^{-1}$,
    $c = \mathrm{I}/\gamma - \Gamma^{-1}$, and $\alpha_i$, $\gamma_i$ are the row sums of $\alpha$ and $\Gamma$.
    """

    order: int
    gamma: float
    a: np.ndarray  # [s, s], strictly lower triangular
    c: np.ndarray  # [s, s], strictly lower triangular
    alpha_sums: np.ndarray  # [s], times of the stages
    gamma_sums: np.ndarray  # [s], weights of the time derivative
    error: np.ndarray  # [s], difference from the embedded method
    dense: np.ndarray  # [p, s], coefficients of `RosenbrockInterpolation`

    @property
    def step(self) -> np.ndarray:
        """[s], the step y1 - y0: the last stage is added to its own argument (stiffly accurate)."""
        return self.a[-1] + np.eye(len(self.a))[-1]

    @property
    def rows(self) -> Rows:
        """Coefficients of each stage: a, c, the time, and the weight of the time derivative."""
        return self.a, self.c, self.alpha_sums, self.gamma_sums

    @property
    def rows_with_defects(self) -> Rows:
        """The same with two extra stages: the defect of the dense output at the middle and at the end of the step,
        multiplied by the inverse matrix (see `AbstractRosenbrock.error_within`). No other stage depends on them.
        """
        n = np.arange(len(self.dense))
        powers = 0.5**n
        points = np.stack([0.5 * self.step + 0.25 * powers @ self.dense, self.step])
        rates = np.stack([self.step + 0.5 * (n * powers) @ self.dense, self.step - np.sum(self.dense, axis=0)])

        def square(rows: np.ndarray, last: np.ndarray) -> np.ndarray:
            return np.pad(np.vstack([rows, last]), ((0, 0), (0, 2)))

        times, weights = np.append(self.alpha_sums, [0.5, 1.0]), np.append(self.gamma_sums, [0.0, 0.0])
        return square(self.a, points), square(self.c, -rates), times, weights


class RosenbrockInterpolation(diffrax.AbstractLocalInterpolation):
    r"""Dense output of a step, with $\theta = (t - t_0)/(t_1 - t_0)$:

    $$y(t) = (1-\theta)\,y_0 + \theta\,(y_1 + (1-\theta)\,(D_1 + \theta D_2 + \theta^2 D_3 + \dots)).$$
    """

    t0: Scalar  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Scalar  # pyright: ignore[reportIncompatibleVariableOverride]
    y0: State
    y1: State
    coeffs: Float[Array, "p n"]  # D

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> State:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        width = self.t1 - self.t0
        return self.at((t0 - self.t0) / jnp.where(width == 0, 1, width))

    def at(self, theta: Any) -> State:
        """State at the relative position `theta` in the step."""
        bend = jnp.polyval(self.coeffs[::-1], theta)
        return (1 - theta) * self.y0 + theta * (self.y1 + (1 - theta) * bend)


def _optional_array(x: ArrayLike | Sequence[float] | None) -> Array | None:
    return None if x is None else jnp.asarray(x, dtype=float)


class Work(eqx.Module):
    """Data of a step for correcting its dense output: the factors of its matrix, and the raw corrections at its two
    ends, which are subtracted so that the correction vanishes there.
    """

    factors: Factors | SparseFactors
    at_start: State
    at_end: State


class AbstractRosenbrock(diffrax.AbstractAdaptiveSolver):
    r"""A Rosenbrock method for $M\,y' = f(t, y)$; $y$ is a flat vector, $M$ constant and singular for an index-1 DAE.

    A step of size $h$ evaluates $J = \partial f/\partial y$ and $f_t = \partial f/\partial t$ once, at its start, and
    solves for the stages $u_i$ one after the other with one matrix:

    $$\left(\tfrac{1}{\gamma} M - hJ\right) u_i = h\,f\Big(t_0 + \alpha_i h,\; y_0 + \sum_{j<i} a_{ij} u_j\Big)
        + M \sum_{j<i} c_{ij} u_j + h^2 \gamma_i f_t,$$

    then $y_1 = y_0 + \sum_j a_{sj} u_j + u_s$. The last stage vanishes with the residual of the stiff and algebraic
    components. The end of a step therefore satisfies their equations, and they cause no spurious error estimate.

    The start must satisfy the algebraic equations of a DAE. A singular matrix or a non-finite vector field gives a step
    of NaN. Diffrax treats its error as infinite, and an adaptive controller retries with a smaller step until
    `max_steps` or its `dtmin` ends the run with that result. Such steps do not affect the derivatives of `simulate`. If
    diffrax drives the method, they do not affect forward mode either, but reverse mode gives NaN because it multiplies
    the unused values by zero.

    **Fields:**

    - `mass`: $M$, as `[n, n]`, or `[n]` for a diagonal (zero in algebraic rows); `None` is the identity.
    - `nominal`: `[n]`, typical sizes of the components of $y$, which scale the rows of the matrix before pivoting;
        `None` is ones. The tolerances belong to the controller and do not depend on it.
    - `n_integrals`: number of integrals, the last components of $y$: $f$ does not read them, and $M$ is diagonal there.
        They need neither directional derivatives nor elimination.
    - `pattern`: the structure of $J$, if it is sparse and $M$ is diagonal without zeros; `None` for a dense one.
    - `unroll`: compile the stages one by one. The step runs slightly faster, but the vector field is compiled once per
        stage instead of twice.
    """

    tableau: AbstractClassVar[RosenbrockTableau]
    term_structure: ClassVar = diffrax.ODETerm
    interpolation_cls: ClassVar = RosenbrockInterpolation

    mass: State | Matrix | None = eqx.field(default=None, converter=_optional_array)
    nominal: State | None = eqx.field(default=None, converter=_optional_array)
    n_integrals: int = eqx.field(default=0, static=True)
    pattern: Pattern | None = eqx.field(default=None, static=True)
    unroll: bool = eqx.field(default=False, static=True)

    def order(self, terms: Any) -> int:
        """The order of convergence."""
        return self.tableau.order

    def func(self, terms: Any, t0: Numbers, y0: State, args: PyTree) -> State:
        """The right-hand side $f$, which diffrax uses to guess the first step. With a mass matrix it is not $y'$."""
        return terms.vf(t0, y0, args)

    def init(self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree) -> None:
        """The state of the solver, None. Raises `ParameterError` unless `y0` is one flat vector of real numbers."""
        if jax.tree.structure(y0) != jax.tree.structure(0) or jnp.ndim(y0) != 1 or not jnp.isrealobj(y0):
            raise ParameterError(
                f"{type(self).__name__} integrates one flat vector of real numbers, but the state is {y0}. "
                "Flatten it with `jax.flatten_util.ravel_pytree`."
            )
        n = len(jnp.asarray(y0))
        if self.mass is not None and self.mass.shape not in ((n,), (n, n)):
            raise ParameterError(
                f"The mass matrix of {type(self).__name__} has the shape {self.mass.shape}, but the state has {n} "
                f"entries: give it as ({n}, {n}), or its diagonal as ({n},)."
            )

    def step(
        self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree, solver_state: None, made_jump: Numbers
    ) -> tuple[State, State, dict[str, Array], None, diffrax.RESULTS]:
        """The end of a step, its error estimate, its dense output, the state of the solver and its result."""
        y1, error, info, _ = self._stepped(terms, t0, t1, y0, args, self.tableau.rows)
        return y1, error, info, None, diffrax.RESULTS.successful

    def no_step(self, y0: State) -> dict[str, Array]:
        """The dense output of a step without change."""
        return {"y0": y0, "y1": y0, "coeffs": jnp.zeros((len(self.tableau.dense), len(y0)))}

    def step_to_look_into(
        self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree
    ) -> tuple[State, State, dict[str, Array], Work]:
        """The end of a step, its error estimate, its dense output, and the data that correct this output.

        The error estimate is at least the error of the stiff components in the middle of the step.
        """
        y1, error, info, (f0, factors, stages) = self._stepped(terms, t0, t1, y0, args, self.tableau.rows_with_defects)
        first = self._defect_at_start(_width(t0, t1) * f0, **info)
        start, middle, end = (self.of_stiff(factors, x) for x in (factors.solve(first), stages[-2], stages[-1]))
        error = jnp.maximum(jnp.abs(error), jnp.where(jnp.isfinite(middle), jnp.abs(middle), 0.0))
        return y1, error, info, Work(factors, start, end)

    def _stepped(
        self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree, rows: Rows
    ) -> tuple[State, State, dict[str, Array], tuple[State, Factors | SparseFactors, Stages]]:
        tableau, h = self.tableau, _width(t0, t1)

        # Diffrax integrates backwards by reversing time, which only the control of a term shows.
        direction = jnp.where(terms.contr(t0, t1) < 0, -1.0, 1.0)

        def f(t: Scalar, y: State) -> State:
            return direction * terms.vf(t, y, args)

        f0, f_t, matrix = self._linearised(f, t0, y0, h)
        factors = factors_of(matrix, self.nominal, n_integrals=self.n_integrals)
        solve = linear_solver(matrix, factors=factors)

        def stage(row: tuple, earlier: Stages) -> State:
            a, c, alpha, gamma = row
            slope = f(t0 + alpha * h, y0 + combine(a, earlier))
            return solve(h * slope + self.mass_times(combine(c, earlier)) + h**2 * gamma * f_t)

        stages = self._stages(rows, solve(h * f0 + h**2 * tableau.gamma_sums[0] * f_t), stage)
        u = stages[: len(tableau.a)] if len(rows[0]) > len(tableau.a) else stages
        y1 = y0 + combine(tableau.step, u)
        coeffs = jnp.stack([combine(row, u) for row in tableau.dense])
        return y1, combine(tableau.error, u), {"y0": y0, "y1": y1, "coeffs": coeffs}, (f0, factors, stages)

    def _linearised(
        self, f: VectorField, t0: Numbers, y0: State, h: Numbers
    ) -> tuple[State, State, Matrix | SparseMatrix]:
        """f and its derivative with respect to time at the start of a step, and the matrix of the step."""
        if self.pattern is not None:
            f0, f_t, entries = linearise_sparse(f, t0, y0, self.pattern)
            diagonal = self.mass_times(jnp.ones_like(y0)) / self.tableau.gamma
            return f0, f_t, SparseMatrix(jnp.asarray(-h * entries), diagonal, self.pattern)
        f0, f_t, jacobian = linearise(f, t0, y0, len(y0) - self.n_integrals)
        return f0, f_t, self._mass_matrix(len(y0), t0) / self.tableau.gamma - h * jacobian

    def work(self, f: VectorField, path: RosenbrockInterpolation) -> Work:
        """Recomputes the correction data of a step from its dense output."""
        h = _width(path.t0, path.t1)
        f0, _, matrix = self._linearised(f, path.t0, path.y0, h)
        factors = factors_of(matrix, self.nominal, n_integrals=self.n_integrals)
        _, rate = jax.jvp(path.evaluate, (path.t1,), (jnp.ones_like(path.t1),))
        last = h * (f(path.t1, path.y1) - self.mass_times(rate))
        ends = (self._defect_at_start(h * f0, path.y0, path.y1, path.coeffs), last)
        return Work(factors, *(self.of_stiff(factors, factors.solve(defect)) for defect in ends))

    def _defect_at_start(self, step: State, y0: State, y1: State, coeffs: Array) -> State:
        """h times the defect at the start of a step; `step` is h f there."""
        return step - self.mass_times(y1 - y0 + coeffs[0])

    def error_within(
        self, path: RosenbrockInterpolation, work: Work, theta: Numbers, width: Numbers, rates: State
    ) -> State:
        r"""Correction of the dense output `path` at the relative position `theta`; `rates` is the vector field there.

        The error of the dense output is small relative to $y$, but quantities that depend on a small difference of
        states, such as the current through a small resistance, amplify it. The error $e$ of a stiff component follows
        from the defect $\delta = f - M p'$ of the interpolant $p$ and the matrix of the step,

        $$e = (I - D)^k A^{-1} h\,\delta, \qquad A = \tfrac{1}{\gamma} M - hJ, \qquad D = A^{-1} \tfrac{1}{\gamma} M.$$

        $D$ is nearly the identity for non-stiff components, so they remain unchanged. The correction is zero at the
        ends of the step: they are accurate, and the event just handled there determines what happens next.
        """
        _, slope = jax.jvp(path.at, (theta,), (jnp.ones_like(theta),))
        defect = jnp.asarray(width * rates - self.mass_times(slope))
        error = self.of_stiff(work.factors, work.factors.solve(defect))
        error -= _fading(1.0 - theta, SLOWLY) * work.at_end + _fading(theta, FAST) * work.at_start
        # Removes rounding just after the start, so that what is zero at the start stays zero; its rate remains.
        error -= jax.lax.stop_gradient(_fading(theta, AT_ONCE) * error)
        return jnp.where(jnp.all(jnp.isfinite(error)), error, 0.0)

    def of_stiff(self, factors: Factors | SparseFactors, error: State) -> State:
        """The stiff part of an error."""
        if isinstance(factors, SparseFactors):  # the loops of a solution are compiled once for all passes
            return jax.lax.fori_loop(0, FILTERS, lambda _, error: error - self._slow(factors, error), error)
        for _ in range(FILTERS):
            error = error - self._slow(factors, error)
        return error

    def _slow(self, factors: Factors | SparseFactors, error: State) -> State:
        """The non-stiff part of an error."""
        return factors.solve(self.mass_times(error)) / self.tableau.gamma

    def _mass_matrix(self, n: int, t: Numbers) -> Matrix:
        if self.mass is None:
            return _unit_vectors(n, t)
        return self.mass[:, None] * _unit_vectors(n, t) if self.mass.ndim == 1 else self.mass

    def mass_times(self, v: State) -> State:
        """The product M v."""
        if self.mass is None:
            return v
        return self.mass * v if self.mass.ndim == 1 else self.mass @ v

    def _stages(self, rows: Rows, first: State, stage: Callable[[tuple, Stages], State]) -> Stages:
        """All stages; `stage` computes one from its row and the earlier stages."""
        if self.unroll:
            stages = [first]
            for row in list(zip(*rows, strict=True))[1:]:
                stages.append(stage(row, stages))
            return stages

        def body(stages, numbered):
            i, row = numbered
            return jax.lax.dynamic_update_index_in_dim(stages, stage(row, stages), i, axis=0), None

        n = len(rows[0])
        stages = jnp.zeros((n, len(first)), first.dtype).at[0].set(first)
        later = jax.tree.map(lambda x: x[1:], (np.arange(n), rows))
        return jax.lax.scan(body, stages, later)[0]


def _width(t0: Numbers, t1: Any) -> Array:
    """Step size. Finished members of a batch would step with size 0, for which the matrix of a DAE is singular."""
    width = jnp.asarray(t1 - t0)
    return jnp.maximum(width, jnp.sqrt(jnp.finfo(width.dtype).tiny))


def _fading(theta: Numbers, fast: int) -> Numbers:
    """Decay from 1 with zero slope at the start of a step to 0 at its end."""
    rest = jnp.clip(1.0 - theta, 0.0, 1.0)
    return rest**fast * (1.0 + fast * (1.0 - rest))


def combine(weights: np.ndarray | Float[Array, " s"], stages: Stages) -> State:
    """Weighted sum of stages. It is elementwise because XLA on CPU fuses it; such small matrix products are slower."""
    if isinstance(stages, list):
        used = [w * u for w, u in zip(weights, stages, strict=False) if w != 0]
        return sum(used, jnp.zeros_like(stages[0]))
    if stages.shape[1] > LARGEST_FUSED:
        return sum((w * u for w, u in zip(weights[1:], stages[1:], strict=True)), weights[0] * stages[0])
    return jnp.sum(jnp.asarray(weights)[:, None] * stages, axis=0)


def _unit_vectors(n: int, t: Numbers) -> Matrix:
    """Identity matrix. A large one depends formally on `t`, so that XLA does not constant-fold it and its uses."""
    if n <= LARGEST_CONSTANT:
        return jnp.eye(n)
    index = jnp.arange(n)
    return (index[:, None] == index + jnp.isnan(t)).astype(float)


def linearise(f: VectorField, t: Numbers, y: State, n_read: int) -> tuple[State, State, Matrix]:
    r"""$f$, $\partial f/\partial t$ and $\partial f/\partial y$ at a point, from one batch of directional derivatives.
    $f$ reads only the first `n_read` components.
    """
    f0, columns = _along(f, t, y, _unit_vectors(1 + n_read, t))
    return f0, columns[:, 0], jnp.pad(columns[:, 1:], ((0, 0), (0, len(y) - n_read)))


def linearise_sparse(f: VectorField, t: Numbers, y: State, pattern: Pattern) -> tuple[State, State, Array]:
    r"""$f$, $\partial f/\partial t$, and the entries of $\partial f/\partial y$ in a pattern, from one batch of
    directional derivatives: with respect to time, and along the sum of the columns of each colour.
    """
    directions = np.pad(pattern.seeds, ((1, 0), (1, 0)))
    directions[0, 0] = 1.0
    f0, columns = _along(f, t, y, jnp.asarray(directions))
    return f0, columns[:, 0], columns[pattern.rows, 1 + pattern.colours[pattern.columns]]


def _along(f: VectorField, t: Numbers, y: State, directions: Float[Array, "k m"]) -> tuple[State, Float[Array, "n k"]]:
    """f and its derivatives along directions in time and the first m - 1 components of y."""

    def directional(direction: Float[Array, " m"]) -> tuple[State, State]:
        unread = len(y) - len(direction) + 1
        return jax.jvp(f, (t, y), (direction[0], jnp.pad(direction[1:], (0, unread))))

    return jax.vmap(directional, out_axes=(None, -1))(directions)
