"""Rodas5P, with explicit steps while the equations are not stiff."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Bool, Int, PyTree

from ..._equinox_private import unvmap_any
from ..._jax_private import jaxpr_as_fun
from ..._numbers import Numbers
from ..._tangents import masked
from ._dopri5 import ExplicitStep, dopri5_step
from ._rodas5p import Rodas5P
from ._rosenbrock import RosenbrockInterpolation, State, Work, step_size

STABLE = 2.5  # step size times dominant eigenvalue; DOPRI5 becomes unstable at 3.3 if it is real, at 1.0 if imaginary
RATIO = 5  # an implicit step pays if it is longer than an explicit step by this factor
PATIENCE = 15  # steps before the first trial of the other method
TRIAL = 4  # implicit steps of a trial, in which the step size grows


class MethodChoice(NamedTuple):
    """The method of the next steps.

    - `is_explicit`: whether explicit steps are in use.
    - `left`: the number of steps before the other method is tried; negative in a trial of implicit steps.
    - `patience`: the number of steps between the last trial and the next.
    - `n_explicit`: the number of accepted explicit steps.
    """

    is_explicit: Bool[Array, ""]
    left: Int[Array, ""]
    patience: Int[Array, ""]
    n_explicit: Int[Array, ""]

    @property
    def tries_explicit(self) -> Array:
        """Whether the next step tries to be explicit."""
        return jnp.where(self.is_explicit, (self.left > 0) | (self.left == -TRIAL), self.left == 0)

    def after(self, is_tried: Array, is_fit: Array) -> "MethodChoice":
        """The choice after a step. It was explicit if an explicit step `is_tried` and `is_fit`."""
        goes_on = self.is_explicit & (self.left > 0) & is_fit
        is_decided = is_tried & ~goes_on
        is_confirmed = is_fit == self.is_explicit
        patience = jnp.where(is_decided, jnp.where(is_confirmed, 2 * self.patience, PATIENCE), self.patience)
        return MethodChoice(
            is_explicit=jnp.where(is_tried, is_fit, self.is_explicit),
            left=jnp.where(is_decided, patience, self.left - 1),
            patience=patience,
            n_explicit=self.n_explicit + (is_tried & is_fit),
        )


class SwitchingWork(Work):
    """Data for the correction of an implicit step; an explicit step is not corrected."""

    is_explicit: Bool[Array, ""]


class SwitchingRodas5P(Rodas5P):
    """Rodas5P for large systems, with steps of DOPRI5 while these are about as long.

    An explicit step needs neither a Jacobian nor factors. It is fit if two conditions hold, otherwise an implicit step
    of the same size replaces it.

    - It is stable: the dominant eigenvalue times the step size is at most `STABLE`. The eigenvalue is estimated from
      two stages at the end of the step (E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, section
      IV.2, with a limit of 3.25 on the real axis).
    - Its error permits explicit steps of at least 1/`RATIO` of this size (L. Petzold, Automatic selection of methods
      for solving stiff and nonstiff systems, SIAM J. Sci. Stat. Comput. 4, 136, 1983).

    Implicit steps go on until an explicit step, tried after `PATIENCE` steps, is fit. Explicit steps go on until one is
    not fit. In addition, after `PATIENCE` steps, `TRIAL` implicit steps show whether the step size grows so far that
    explicit steps are no longer fit, because explicit steps of an oscillation with little damping are at the limit of
    stability long before the real one. A trial that confirms the method in use doubles the patience. A member of a
    batch takes implicit steps, since both kinds of steps would be evaluated for each.

    **Fields:** the tolerances of the step size controller.
    """

    rtol: Any = 1e-6
    atol: Any = 1e-6

    def init(self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree) -> MethodChoice:
        """The initial choice: the first step tries to be explicit."""
        super().init(terms, t0, t1, y0, args)
        return MethodChoice(jnp.asarray(False), jnp.asarray(0), jnp.asarray(PATIENCE), jnp.asarray(0))

    def step(
        self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree, solver_state: Any, made_jump: Numbers
    ) -> tuple[State, State, dict[str, Array], Any, diffrax.RESULTS]:
        """The end of a step, its error estimate, its dense output, the state of the solver and its result."""

        def implicit() -> tuple[State, State, dict[str, Array]]:
            return Rodas5P.step(self, terms, t0, t1, y0, args, None, made_jump)[:3]

        outcome, _, choice = self._chosen(terms, t0, t1, y0, args, solver_state, implicit)
        return *outcome, choice, diffrax.RESULTS.successful

    def step_to_look_into(
        self, terms: Any, t0: Numbers, t1: Any, y0: State, args: PyTree, solver_state: Any
    ) -> tuple[State, State, dict[str, Array], Work, Any]:
        """The same with the data that correct the dense output, without the result."""

        def implicit() -> tuple[State, State, dict[str, Array], Work]:
            return Rodas5P.step_to_look_into(self, terms, t0, t1, y0, args, None)[:4]

        (*outcome, work), is_explicit, choice = self._chosen(terms, t0, t1, y0, args, solver_state, implicit)
        return *outcome, SwitchingWork(work.factors, work.at_start, work.at_end, is_explicit), choice

    def _chosen(
        self,
        terms: Any,
        t0: Numbers,
        t1: Any,
        y0: State,
        args: PyTree,
        choice: MethodChoice,
        implicit: Callable[[], Any],
    ) -> tuple[Any, Array, MethodChoice]:
        """The outcome of a step, whether it is explicit, and the next choice."""

        def tried(
            solver: SwitchingRodas5P, t0: Numbers, t1: Any, y0: State, args: PyTree
        ) -> tuple[ExplicitStep, Array]:
            found = dopri5_step(solver.field(terms, t0, t1, args), t0, step_size(t0, t1), y0)
            return found, solver._is_fit(found, y0)

        def explicit() -> tuple[ExplicitStep, Array]:
            # States of an unstable step may leave their ranges: a step that is not fit has zero derivatives.
            return masked(tried, lambda _, outcome: outcome[1])(self, t0, t1, y0, args)

        is_tried = choice.tries_explicit & _is_alone(jax.lax.stop_gradient(jnp.asarray(t0)))
        explicit, nothing = _traced(explicit)
        found, is_fit = jax.lax.cond(unvmap_any(is_tried), explicit, nothing)
        is_explicit = is_tried & is_fit
        implicit, nothing = _traced(implicit)
        outcome = jax.lax.cond(unvmap_any(~is_explicit), implicit, lambda: (*found[:3], *nothing()[3:]))
        return outcome, is_explicit, choice.after(is_tried, is_fit)

    def _is_fit(self, step: ExplicitStep, y0: State) -> Array:
        """Whether an explicit step is stable and not much too long."""
        end, error, _, slopes, states = jax.lax.stop_gradient(step)
        y0 = jax.lax.stop_gradient(y0)
        scale = jax.lax.stop_gradient(self.atol + self.rtol * jnp.maximum(jnp.abs(y0), jnp.abs(end)))
        n = len(y0) - self.n_integrals  # no rate depends on integrals
        slopes, states = ((apart / scale)[:n] for apart in (slopes, states))
        is_stable = jnp.sum(slopes**2) <= STABLE**2 * jnp.sum(states**2)
        return is_stable & (jnp.mean((error / scale) ** 2) <= float(RATIO) ** (2 * self.tableau.order))

    def error_within(
        self, path: RosenbrockInterpolation, work: Work, theta: Numbers, width: Numbers, rates: State
    ) -> State:
        """Correction of the dense output; zero for an explicit step."""
        return self._unless_explicit(work, lambda: Rodas5P.error_within(self, path, work, theta, width, rates))

    def stiff_rates(self, work: Work, rates: State) -> State:
        """The stiff part of rates; zero for an explicit step."""
        return self._unless_explicit(work, lambda: Rodas5P.stiff_rates(self, work, rates))

    def _unless_explicit(self, work: Work, correction: Callable[[], State]) -> State:
        if not isinstance(work, SwitchingWork):
            return correction()
        return jax.lax.cond(work.is_explicit, lambda: jnp.zeros_like(work.at_start), correction)


def _traced(function: Callable[[], PyTree]) -> tuple[Callable[[], PyTree], Callable[[], PyTree]]:
    """A function after it is traced once, and a function that gives zeros of the same shapes."""
    closed, shapes = jax.make_jaxpr(function, return_shape=True)()
    structure = jax.tree.structure(shapes)
    zeros = lambda: jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)  # noqa: E731
    return lambda: structure.unflatten(jaxpr_as_fun(closed)()), zeros


@custom_vmap
def _is_alone(t: Array) -> Array:
    """Whether a time belongs to a single run, not to a batch."""
    del t
    return jnp.asarray(True)


@_is_alone.def_vmap
def _is_in_batch(size: int, batched: list[bool], t: Array) -> tuple[Array, bool]:
    del size, batched, t
    return jnp.asarray(False), False
