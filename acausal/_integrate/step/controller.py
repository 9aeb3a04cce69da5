"""Step size control on a grid of step sizes."""

from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._numbers import Numbers
from ..setup.field import RunArgs
from ..setup.settings import Settings

PER_OCTAVE = 4
SURE = 1e-6  # relative excess of an error over its tolerance that rounding cannot explain
LOST = 1e-14  # smallest step size, relative to the time since the start of the run
LEAP = 1e8  # a step fails if a state grows beyond this multiple of its size


class Control(NamedTuple):
    """State of the step size controller.

    - `wish`: size of the next step if no time event limits it.
    - `error`: error estimate of each element of the core in the last step, in tolerances; NaN after a non-finite step.
    - `largest` and `total`: largest absolute value and sum of the error estimates of each element, over all steps.
    """

    inner: Any
    wish: Any
    error: Array
    largest: Any
    total: Array


class StepSizes(eqx.Module):
    """Step sizes of `PIDController` of diffrax, rounded to powers of 2^(1/4).

    Reverse mode recomputes the steps with different rounding. Its derivative is correct only if the step sizes are the
    same. A step size that follows the last digits of the error estimate would differ; a step size on a grid is the
    same, except in the rare case that it lies half-way between two grid points.
    """

    pid: diffrax.PIDController
    sizes: Any
    run_start: Any
    shortest: Any  # None: `LOST` times the time since the start, or the time resolution if that is larger
    longest: Any

    def init(self, terms: Any, t0: Array, t1: Array, core: Array, dt0: Any, args: Any, solver: Any) -> Control:
        order = solver.error_order(terms)
        first, state = self.pid.init(terms, t0, t1, core, dt0, args, solver.func, order)
        nothing = jnp.zeros_like(core)
        return Control(state, self._allowed(first - t0), nothing, jax.lax.stop_gradient(jnp.abs(core)), nothing)

    def adapted(
        self, t0: Array, t1: Array, core0: Array, core1: Array, args: Any, error: Array, order: int, before: Control
    ) -> tuple[Array, Control, Array]:
        """Whether the step is accepted, the new controller state, and whether the next step would be too short."""
        # A non-finite error means that the step failed. It must not enter the step size.
        n = len(self.sizes)
        is_finite = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(core1))
        has_failed = ~is_finite | has_leapt(core0[:n], core1[:n], self.sizes)
        error = jnp.where(has_failed, jnp.inf, jnp.abs(error))
        y1 = jnp.where(jnp.isfinite(core1), core1, core0)
        keep, next_t0, next_t1, _, inner, _ = self.pid.adapt_step_size(
            t0, t1, core0, y1, args, error, order, before.inner
        )
        wish = self._allowed(next_t1 - next_t0)
        # A shortened step says little about the next step size, which is then at least the planned one.
        wish = jnp.where(keep & (t1 - t0 < before.wish), jnp.maximum(wish, before.wish), wish)
        scale, held = jnp.abs(core0) * self.pid.rtol + self.pid.atol, jax.lax.stop_gradient
        largest = jnp.maximum(before.largest, jnp.where(keep, jnp.abs(y1), 0.0))
        total = before.total + jnp.where(keep, error, 0.0)
        scaled_error = jnp.where(is_finite, error / scale, jnp.nan)
        control = Control(inner, held(wish), held(scaled_error), held(largest), held(total))
        lost = jnp.maximum(LOST * (t0 - self.run_start), args.tick(t0))
        shortest = lost if self.shortest is None else self.shortest
        return jnp.asarray(keep), control, wish < shortest

    def with_misfit(self, core0: Array, core1: Array, error: Array, misfit: Array) -> Array:
        """Adds an interpolation error, as a multiple of the tolerance, to the error of a step."""
        scale = self.pid.rtol * jnp.maximum(jnp.abs(core0), jnp.abs(core1)) + self.pid.atol
        return jax.lax.stop_gradient(jnp.hypot(error, misfit * scale))

    def _allowed(self, width: Numbers) -> Array:
        return jax.lax.stop_gradient(jnp.minimum(on_grid(width), self.longest))


def step_sizes(settings: Settings, args: RunArgs) -> StepSizes:
    """The step size controller, with absolute tolerances from the typical sizes of the variables."""
    numbers, nominals = args.numbers, settings.system.nominals
    pid = diffrax.PIDController(numbers.rtol, numbers.rtol * sizes_of(settings), norm=root_mean_square)
    begin = args.forward * numbers.t0
    return StepSizes(pid, nominals, begin, numbers.dtmin, jnp.inf if numbers.dtmax is None else numbers.dtmax)


def has_leapt(y0: Array, y1: Array, sizes: Array | np.ndarray) -> Array:
    """Whether a state grows out of all proportion in a step of the linearised equations. Such a step has failed, even
    if its error is small relative to its end.
    """
    return jnp.any(jnp.abs(y1) > LEAP * (jnp.abs(y0) + sizes))


def sizes_of(settings: Settings) -> np.ndarray:
    """Typical sizes of the elements of the core. The size of an integral, such as an energy, is 1."""
    return np.concatenate([settings.system.nominals, np.ones(settings.n_extra)])


def is_rejected(settings: Settings, rtol: Numbers, core0: Array, core1: Array, error: Array) -> Array:
    """Whether a step is certainly rejected: it has failed, or its `error` is too large by more than rounding."""
    scale = rtol * (sizes_of(settings) + jnp.maximum(jnp.abs(core0), jnp.abs(core1)))
    return ~(root_mean_square(error / scale) < 1.0 + SURE)


def root_mean_square(error: PyTree) -> Array:
    return jnp.sqrt(jnp.mean(error**2))


def on_grid(width: Numbers) -> Array:
    """The nearest step size on the grid."""
    width = jnp.maximum(width, jnp.finfo(jnp.float64).tiny)
    return jnp.exp2(jnp.round(PER_OCTAVE * jnp.log2(width)) / PER_OCTAVE)
