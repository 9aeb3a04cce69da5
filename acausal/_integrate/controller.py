"""Step sizes: from the error, on a grid, and up to the next thing that is known to happen."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._numbers import Numbers
from .settings import Settings
from .state_vector import StateVector

PER_OCTAVE = 4
SURE = 1e-6  # share by which an error is too large for certain, however it is rounded
LEAP = 1e8  # a step in which a state grows to more than this many times its size has failed
# A rejected step that would have been cut before this share of it ends there: a bend may be all its error, and then the
# step may be longer than the error alone would allow.
BENT = 0.5
FAR = 100.0  # the step after an event is at most this many times as long as the way to the event


class Control(NamedTuple):
    """What is carried from step to step.

    - `wish`: how long the next step would be if nothing were known to happen before its end.
    - `error`: of each element in the last step, in tolerances.
    - `largest` and `total`: of each element, its largest absolute value and the sum of its errors, over all steps.
    """

    inner: Any
    wish: Any
    error: Array
    largest: Any
    total: Array


class Steps(diffrax.PIDController):
    """Step sizes rounded to powers of 2^(1/4), and cut short where something is known to happen.

    Reverse mode computes steps once more, with other rounding than the first time, and its derivative is that of the
    run only if they are the same steps. A step size that varies in its last digits with the error estimate would go
    astray; on a grid it comes out the same, but for the rare one that lies half-way between two of its points.
    """

    layout: StateVector = eqx.field(kw_only=True, static=True)
    shortest: Any = eqx.field(kw_only=True)  # the smallest step that an error estimate may lead to

    def init(self, terms: Any, t0: Numbers, t1: Any, y0: Array, *others: Any, **named: Any) -> Any:
        first, state = super().init(terms, t0, t1, y0, *others, **named)
        wish = on_grid(first - t0)
        return self._up_to_instant(t0 + wish, y0), Control(
            state, wish, jnp.zeros_like(y0), jax.lax.stop_gradient(jnp.abs(y0)), jnp.zeros_like(y0)
        )

    def adapt_step_size(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, t0: Numbers, t1: Any, y0: Array, y1_candidate: Array, args: Any, y_error: Array, error_order: int,
        controller_state: Control,
    ) -> Any:  # fmt: skip
        # What is not finite is a step that failed, and must not become a step size.
        scale, states = jnp.abs(y0) * self.rtol + self.atol, self.layout.states
        has_failed = ~(jnp.all(jnp.isfinite(y_error)) & jnp.all(jnp.isfinite(self.layout.core(y1_candidate))))
        if not self.layout.has_status:  # with events this is told before they set states
            has_failed |= has_leapt(y0[states], y1_candidate[states], jnp.asarray(self.atol)[states] / self.rtol)
        error = jnp.where(has_failed, jnp.inf, jnp.abs(y_error))
        y1 = jnp.where(jnp.isfinite(y1_candidate), y1_candidate, y0)
        keep, next_t0, next_t1, jump, inner, result = super().adapt_step_size(
            t0, t1, y0, y1, args, error, error_order, controller_state.inner
        )
        wish = on_grid(next_t1 - next_t0)
        # A step that was cut short says little of how long the next one may be.
        wish = jnp.where(keep & (t1 - t0 < controller_state.wish), jnp.maximum(wish, controller_state.wish), wish)
        wish = jax.lax.stop_gradient(self._no_farther(wish, keep, t0, t1, y1_candidate, controller_state))
        result = diffrax.RESULTS.where(wish < self.shortest, diffrax.RESULTS.dt_min_reached, result)
        held = jax.lax.stop_gradient
        largest = jnp.maximum(controller_state.largest, jnp.where(keep, jnp.abs(y1), 0.0))
        total = controller_state.total + jnp.where(keep, error, 0.0)
        control = Control(inner, wish, held(error / scale), held(largest), held(total))
        if not self.layout.has_status:
            return keep, next_t0, next_t0 + wish, jump, control, result
        cut = y1_candidate[self.layout.cut]
        is_cut = keep & (cut < jnp.inf)
        has_ended = keep & ~is_cut & (y1_candidate[self.layout.outcome] != 0)
        result = diffrax.RESULTS.where(has_ended, diffrax.RESULTS.event_occurred, result)
        next_t0 = jnp.where(is_cut, t0, jnp.where(keep, y1_candidate[self.layout.moment], t0))
        status = jnp.where(keep & ~is_cut, y1_candidate, y0)
        is_next = is_cut | (~keep & ~has_failed & (cut - t0 < BENT * (t1 - t0)))
        next_t1 = jnp.where(is_next, cut, self._up_to_instant(next_t0 + wish, status))
        return keep & ~is_cut, next_t0, jax.lax.stop_gradient(next_t1), jump, control, result

    def _no_farther(self, wish: Array, keep: Numbers, t0: Numbers, t1: Array, y: Array, before: Control) -> Array:
        """The wish, which after an event grows to no more than `FAR` times the way to it.

        Where solutions between events are polynomials, error estimates vanish. Steps would grow until they are so much
        longer than the time to the next event that errors of rounding count.
        """
        if not self.layout.has_status:
            return wish
        moment = y[self.layout.moment]
        most = jnp.maximum(before.wish, FAR * (moment - t0))
        return jnp.where(keep & (moment < t1), jnp.minimum(wish, most), wish)

    def _up_to_instant(self, t1: Numbers, y: Array) -> Numbers:
        """The end of a step, or the instant before it at which something is known to happen."""
        if not self.layout.has_status:
            return t1
        return jnp.minimum(t1, y[self.layout.next_instant])


def has_leapt(y0: Array, y1: Array, sizes: Array | np.ndarray) -> Array:
    """Whether a step of the linearised equations throws a state out of all proportion. It has failed then, however
    small its error is beside where it ends.
    """
    return jnp.any(jnp.abs(y1) > LEAP * (jnp.abs(y0) + sizes))


def sizes_of(settings: Settings) -> np.ndarray:
    """The typical sizes of the elements of the vector; what is not a state counts as of size 1."""
    return np.concatenate([settings.system.nominals, np.ones(settings.layout.size - settings.layout.n_states)])


def is_rejected(settings: Settings, rtol: Numbers, y0: Array, y1: Array, error: Array) -> Array:
    """Whether a step from y0 to y1 surely does not count: it has failed, its `error` is too large by more than
    rounding, or it has to be repeated up to an event.
    """
    layout = settings.layout
    scale = rtol * (sizes_of(settings) + jnp.maximum(jnp.abs(y0), jnp.abs(y1)))
    is_kept = core_norm(layout)(error / scale) < 1.0 + SURE
    if layout.has_status:
        is_kept &= ~(y1[layout.cut] < jnp.inf)
    return ~is_kept


def core_norm(layout: StateVector) -> Callable[[PyTree], PyTree]:
    """The root mean square of what is integrated; what is only carried along has no error."""

    def norm(error: Array) -> Array:
        core = error if len(error) == layout.n_core else layout.core(error)
        return jnp.sqrt(jnp.mean(core**2))

    return norm


def on_grid(width: Numbers) -> Array:
    """The nearest step size on the grid."""
    width = jnp.maximum(width, jnp.finfo(jnp.float64).tiny)
    return jnp.exp2(jnp.round(PER_OCTAVE * jnp.log2(width)) / PER_OCTAVE)
