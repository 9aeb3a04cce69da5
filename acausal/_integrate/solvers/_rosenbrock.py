"""Rosenbrock methods for stiff ODEs and index-1 DAEs, as diffrax solvers: everything but the coefficients."""

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
from ..._linear_solver import linear_solver
from ..._numbers import Numbers

if TYPE_CHECKING:
    from typing import ClassVar as AbstractClassVar
else:
    from equinox import AbstractClassVar

Scalar = Float[Array, ""]
State = Float[Array, " n"]
Matrix = Float[Array, "n n"]
Stages = Float[Array, "s n"] | list[State]
LARGEST_CONSTANT = 100
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
    error: np.ndarray  # [s], difference to the embedded method
    dense: np.ndarray  # [p, s], coefficients of `RosenbrockInterpolation`

    @property
    def step(self) -> np.ndarray:
        """[s], the step y1 - y0: the last stage is added to its own argument (stiffly accurate)."""
        return self.a[-1] + np.eye(len(self.a))[-1]


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
        theta = (t0 - self.t0) / jnp.where(width == 0, 1, width)
        bend = jnp.polyval(self.coeffs[::-1], theta)
        return (1 - theta) * self.y0 + theta * (self.y1 + (1 - theta) * bend)


def _optional_array(x: ArrayLike | Sequence[float] | None) -> Array | None:
    return None if x is None else jnp.asarray(x, dtype=float)


class AbstractRosenbrock(diffrax.AbstractAdaptiveSolver):
    r"""A Rosenbrock method for $M\,y' = f(t, y)$; $y$ is a flat vector, $M$ constant and singular for an index-1 DAE.

    A step of size $h$ linearises once, $J = \partial f/\partial y$ and $f_t = \partial f/\partial t$ at its start, and
    solves for the stages $u_i$ one after the other with one matrix:

    $$\left(\tfrac{1}{\gamma} M - hJ\right) u_i = h\,f\Big(t_0 + \alpha_i h,\; y_0 + \sum_{j<i} a_{ij} u_j\Big)
        + M \sum_{j<i} c_{ij} u_j + h^2 \gamma_i f_t,$$

    then $y_1 = y_0 + \sum_j a_{sj} u_j + u_s$. The last stage vanishes with the residual of stiff and of algebraic
    components, so these are met at the end of a step, and raise no spurious error estimate.

    The start must satisfy the algebraic equations of a DAE. A matrix that cannot be inverted, or a vector field that
    is not finite, makes a step of NaN: diffrax counts its error as infinite, and an adaptive controller retries with a
    smaller step, until `max_steps` or its `dtmin` ends the run with that result. Derivatives of a run of `simulate` are
    not touched by such steps. Where diffrax drives the method, those of forward mode are not either, but reverse mode,
    which multiplies by zero what was not used, gives NaN.

    **Fields:**

    - `mass`: $M$, as `[n, n]`, or `[n]` for a diagonal (zero in algebraic rows); `None` is the identity.
    - `nominal`: `[n]`, typical sizes of the components of $y$, with which the rows of the matrix are made comparable
        before pivots are chosen; `None` is ones. The tolerances, being the controller's, do not follow it.
    - `unroll`: compile the stages one by one. It runs a little faster, and compiles the vector field once per stage
        rather than twice.
    """

    tableau: AbstractClassVar[RosenbrockTableau]
    term_structure: ClassVar = diffrax.ODETerm
    interpolation_cls: ClassVar = RosenbrockInterpolation

    mass: State | Matrix | None = eqx.field(default=None, converter=_optional_array)
    nominal: State | None = eqx.field(default=None, converter=_optional_array)
    unroll: bool = eqx.field(default=False, static=True)

    def order(self, terms: Any) -> int:
        return self.tableau.order

    def func(self, terms: Any, t0: Numbers, y0: State, args: PyTree) -> State:
        """The right-hand side $f$, from which diffrax guesses the first step; with a mass matrix that is not $y'$."""
        return terms.vf(t0, y0, args)

    def init(self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree) -> None:
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
        tableau = self.tableau
        # Members of a batch that have ended are stepped on with h = 0, where the matrix of a DAE is singular.
        h = jnp.maximum(t1 - t0, jnp.sqrt(jnp.finfo(y0.dtype).tiny))

        # Diffrax integrates backwards by turning time round, which only the control of a term tells.
        direction = jnp.where(terms.contr(t0, t1) < 0, -1.0, 1.0)

        def f(t: Scalar, y: State) -> State:
            return direction * terms.vf(t, y, args)

        f0, f_t, jacobian = linearise(f, t0, y0)
        solve = linear_solver(self._mass_matrix(len(y0), t0) / tableau.gamma - h * jacobian, self.nominal)

        def stage(row: tuple, earlier: Stages) -> State:
            a, c, alpha, gamma = row
            slope = f(t0 + alpha * h, y0 + combine(a, earlier))
            return solve(h * slope + self._mass_times(combine(c, earlier)) + h**2 * gamma * f_t)

        u = self._stages(solve(h * f0 + h**2 * tableau.gamma_sums[0] * f_t), stage)
        y1 = y0 + combine(tableau.step, u)
        coeffs = jnp.stack([combine(row, u) for row in tableau.dense])
        return y1, combine(tableau.error, u), {"y0": y0, "y1": y1, "coeffs": coeffs}, None, diffrax.RESULTS.successful

    def _mass_matrix(self, n: int, t: Numbers) -> Matrix:
        if self.mass is None:
            return _unit_vectors(n, t)
        return self.mass[:, None] * _unit_vectors(n, t) if self.mass.ndim == 1 else self.mass

    def _mass_times(self, v: State) -> State:
        if self.mass is None:
            return v
        return self.mass * v if self.mass.ndim == 1 else self.mass @ v

    def _stages(self, first: State, stage: Callable[[tuple, Stages], State]) -> Stages:
        """All stages; `stage` makes one from its row of the tableau and the stages before it."""
        tableau = self.tableau
        rows = (tableau.a, tableau.c, tableau.alpha_sums, tableau.gamma_sums)
        if self.unroll:
            stages = [first]
            for row in list(zip(*rows, strict=True))[1:]:
                stages.append(stage(row, stages))
            return stages

        def body(stages, numbered):
            i, row = numbered
            return jax.lax.dynamic_update_index_in_dim(stages, stage(row, stages), i, axis=0), None

        stages = jnp.zeros((len(tableau.a), len(first)), first.dtype).at[0].set(first)
        later = jax.tree.map(lambda x: x[1:], (np.arange(len(tableau.a)), rows))
        return jax.lax.scan(body, stages, later)[0]


def combine(weights: np.ndarray | Float[Array, " s"], stages: Stages) -> State:
    """Weighted sum of stages, elementwise because XLA on CPU fuses that and is slower at matrix products this small."""
    if isinstance(stages, list):
        used = [w * u for w, u in zip(weights, stages, strict=False) if w != 0]
        return sum(used, jnp.zeros_like(stages[0]))
    return jnp.sum(jnp.asarray(weights)[:, None] * stages, axis=0)


def _unit_vectors(n: int, t: Numbers) -> Matrix:
    """The identity; a large one depends on `t` in form, lest XLA evaluate it, and what follows, while it compiles."""
    if n <= LARGEST_CONSTANT:
        return jnp.eye(n)
    index = jnp.arange(n)
    return (index[:, None] == index + jnp.isnan(t)).astype(float)


def linearise(f: VectorField, t: Numbers, y: State) -> tuple[State, State, Matrix]:
    r"""$f$, $\partial f/\partial t$ and $\partial f/\partial y$ at a point, in one batch of directional derivatives."""

    def directional(direction: Float[Array, " 1+n"]) -> tuple[State, State]:
        return jax.jvp(f, (t, y), (direction[0], direction[1:]))

    f0, columns = jax.vmap(directional, out_axes=(None, -1))(_unit_vectors(1 + len(y), t))
    return f0, columns[:, 0], columns[:, 1:]
