"""Any solver, through events: located within a step, carried out, and the rest of the step taken anew."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ..crossing import Crossing
from ._pieces import PIECES, Held, pieces_of
from ._record import Record

Vector: TypeAlias = Float[Array, " n"]
# Shares of a piece at which conditions are looked at besides its end; closer where an event may just have been.
SAMPLES = (1 / 64, 1 / 16, 1 / 4, 1 / 2, 3 / 4)
INSTANT = 1e-10  # share of a step after which they are looked at first: what was zero up to rounding has a sign then


class Settled(NamedTuple):
    """What an instant of events leaves behind; `fired` marks the events, `flag` what went wrong, 0 if nothing."""

    y: Vector
    holds: Bool[Array, " events"]
    fired: Bool[Array, " events"]
    flag: Any


class Memory(eqx.Module):
    """What is carried from step to step: which conditions hold, and the events so far."""

    inner: Any
    holds: Bool[Array, " events"]
    record: Record


class _Ahead(eqx.Module):
    """What is left of a step: from `t` on, if it `is_open`; `y` is then the vector there, else that at its end."""

    t: Any
    y: Vector
    inner: Any
    holds: Any
    record: Record
    error: Any  # the largest of the pieces so far
    result: Any
    is_open: Any


class Switching(diffrax.AbstractAdaptiveSolver, diffrax.AbstractWrappedSolver):
    r"""Steps of `solver`, in pieces where events occur.

    The vector holds what events change (discrete variables, then a flag) at the places `start` to `stop`; `solver` sees
    the rest. `margins(t, y, args)` are the conditions, true above zero. `settle(t, y, holds, forced, instant, args)`
    carries out the events that have become true and those of `forced`. `bound(args, y)` are the arguments for the
    vector field.

    A step is taken as if there were no events. Where a condition becomes true in it, the first such moment $t^*$ is
    located on the dense output, and from there a second piece is taken. A step with two moments of events in it counts
    as failed, so that it is repeated in smaller ones. The moment's derivative is implicit, by one step of Newton's
    method: what follows, times included, has the exact derivative (that of the saltation matrix).
    """

    solver: Any
    holds: Bool[Array, " events"]  # which conditions hold at the start
    start: int = eqx.field(static=True)
    stop: int = eqx.field(static=True)
    n_records: int = eqx.field(static=True)
    keeps_vectors: bool = eqx.field(static=True)
    margins: Callable[[Any, Any, Any], Any] = eqx.field(static=True)
    settle: Callable[[Any, Any, Any, Any, Any, Any], Settled] = eqx.field(static=True)
    bound: Callable[[Any, Any], Any] = eqx.field(static=True)

    @property
    def term_structure(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_structure

    @property
    def term_compatible_contr_kwargs(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self) -> Any:
        return self.solver.root_finder

    @property
    def scan_kind(self) -> Any:
        return self.solver.scan_kind

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride, reportIncompatibleMethodOverride]
        return pieces_of(self.solver.interpolation_cls, self.start)

    def order(self, terms: Any) -> Any:
        return self.solver.order(terms)

    def error_order(self, terms: Any) -> Any:
        return self.solver.error_order(terms)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any) -> Memory:
        inner = self.solver.init(terms, t0, t1, self._core(y0), self.bound(args, y0))
        record = Record.empty(self.n_records, len(y0) if self.keeps_vectors else 0)
        return Memory(inner, self.holds, record)

    def func(self, terms: Any, t0: Any, y0: Vector, args: Any) -> Vector:
        rates = self.solver.func(terms, t0, self._core(y0), self.bound(args, y0))
        return self._joined(rates, jnp.zeros(self.stop - self.start))

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any, solver_state: Memory, made_jump: Any
    ) -> tuple[Vector, Vector, dict[str, Any], Memory, diffrax.RESULTS]:
        def piece(ahead: _Ahead, number: Any) -> tuple[_Ahead, Any]:
            bound, core = self.bound(args, ahead.y), self._core(ahead.y)
            jumped = made_jump | (number > 0)
            core, error, info, inner, result = self.solver.step(terms, ahead.t, t1, core, bound, ahead.inner, jumped)
            switched = self._switched(ahead.y)
            path = self.interpolation(ahead.t, t1, info, switched)
            fires, holds, lower, upper = self._look(path, ahead.t, t1, args, ahead.holds, INSTANT * (t1 - t0))
            error = jnp.maximum(jnp.abs(error), ahead.error)

            def through() -> _Ahead:
                when, forced = self._moment(path, args, fires, lower, upper)
                before = path.evaluate(when)
                # What has just ceased to hold may begin again at once.
                held = ahead.holds & (self.margins(when, before, args) > 0)
                settled = self.settle(when, before, held, forced, INSTANT * (t1 - t0), args)
                y = jnp.concatenate([settled.y[: self.stop - 1], settled.flag[None], settled.y[self.stop :]])
                record = ahead.record.noted(when, before, y, settled.fired)
                begun = self.solver.init(terms, when, t1, self._core(y), self.bound(args, y))
                return _Ahead(when, y, begun, settled.holds, record, error, result, jnp.asarray(True))

            def onward() -> _Ahead:
                y = self._joined(core, switched)
                return _Ahead(t1 + 0.0 * ahead.t, y, inner, holds, ahead.record, error, result, jnp.asarray(False))

            return jax.lax.cond(jnp.any(fires), through, onward), (ahead.t, info, switched)

        def next_piece(ahead: _Ahead, number: Any) -> tuple[_Ahead, Any]:
            kept = jax.eval_shape(piece, ahead, number)[1]
            idle = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), kept)
            # A piece that begins beyond the end of the step is never read.
            idle = (jnp.full_like(idle[0], jnp.inf), *idle[1:])
            return jax.lax.cond(ahead.is_open, lambda: piece(ahead, number), lambda: (ahead, idle))

        size = len(y0) - (self.stop - self.start)
        start = _Ahead(
            jnp.asarray(t0, float), y0, solver_state.inner, solver_state.holds, solver_state.record,
            jnp.zeros(size), diffrax.RESULTS.successful, jnp.asarray(True),
        )  # fmt: skip
        end, (begins, infos, switched) = jax.lax.scan(next_piece, start, jnp.arange(PIECES))
        error = jnp.where(end.is_open, jnp.inf, end.error)
        failed = (end.y[self.stop - 1] != 0) & jnp.all(jnp.isfinite(error))
        result = diffrax.RESULTS.where(failed, diffrax.RESULTS.internal_error, end.result)
        info = {"begins": begins, "infos": infos, "switched": switched}
        memory = Memory(end.inner, end.holds, end.record)
        return end.y, self._joined(error, jnp.zeros(self.stop - self.start)), info, memory, result

    def interpolation(self, t0: Any, t1: Any, info: Any, switched: Vector) -> Held:
        """Dense output of one piece."""
        return Held(t0, t1, self.solver.interpolation_cls(t0=t0, t1=t1, **info), switched, self.start)

    def _look(self, path: Held, t0: Any, t1: Any, args: Any, holds: Any, instant: Any) -> tuple[Any, Any, Any, Any]:
        """Which events fire first on a piece, which conditions hold at its end, and between which samples it is."""
        path, args, t0, t1 = jax.lax.stop_gradient((path, args, t0, t1))
        times = jnp.stack([t0 + instant, *(t0 + share * (t1 - t0) for share in SAMPLES), t1])
        found = jax.vmap(lambda t: self.margins(t, path.evaluate(t), args))(times) > 0
        fires, lower, upper = jnp.zeros_like(holds), t0, t0
        for i in range(len(found)):
            now = found[i] & ~holds & ~jnp.any(fires)
            began = jnp.any(now)
            lower = jnp.where(began, times[i - 1] if i else t0, lower)
            upper = jnp.where(began, times[i], upper)
            fires, holds = fires | now, found[i]
        return fires, holds, lower, upper

    def _moment(self, path: Held, args: Any, fires: Any, lower: Any, upper: Any) -> tuple[Any, Any]:
        """When the first of the events that fire does, and which one it is."""

        def margins(t: Any, path: Held, args: Any) -> Any:
            return jnp.where(fires, self.margins(t, path.evaluate(t), args), -jnp.inf)

        held = jax.lax.stop_gradient((path, args))
        options = {"lower": lower, "upper": upper}
        largest = lambda t, given: jnp.max(margins(t, *given))  # noqa: E731
        found = optx.root_find(largest, Crossing(), upper, held, options=options, max_steps=200, throw=False).value
        found = jax.lax.stop_gradient(found)
        value, rate = jax.jvp(lambda t: margins(t, path, args), (found,), (jnp.ones_like(found),))
        first = jnp.argmax(value)
        # Of no value, but with the derivative of the moment.
        missing, slope = value[first], jax.lax.stop_gradient(rate[first])
        missing = missing - jax.lax.stop_gradient(missing)
        when = found - jnp.where(slope != 0, missing / jnp.where(slope != 0, slope, 1.0), 0.0)
        return when, jnp.arange(len(fires)) == first

    def _core(self, y: Vector) -> Vector:
        return jnp.concatenate([y[: self.start], y[self.stop :]])

    def _switched(self, y: Vector) -> Vector:
        return y[self.start : self.stop]

    def _joined(self, core: Vector, switched: Vector) -> Vector:
        return jnp.concatenate([core[: self.start], switched, core[self.start :]])
