"""Any solver, through events: located within a step, carried out, and the rest of the step taken anew."""

import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ..crossing import Crossing

Vector: TypeAlias = Float[Array, " n"]
# Shares of a step at which conditions are looked at besides its end; closer where an event may just have been.
SAMPLES = (1 / 64, 1 / 16, 1 / 4, 1 / 2, 3 / 4)
INSTANT = 1e-10  # share of a step after which a condition counts that is zero up to rounding
AT_ONCE = 8  # events of one instant that are recorded


class Settled(NamedTuple):
    """What an instant of events leaves behind; `fired` marks the events, `flag` what went wrong, 0 if nothing."""

    y: Vector
    holds: Bool[Array, " events"]
    fired: Bool[Array, " events"]
    flag: Any


class Record(eqx.Module):
    """The events so far: `times` and `numbers` of the first ones, and how many there were."""

    times: Float[Array, " records"]
    numbers: Any
    count: Any


class Memory(eqx.Module):
    """What is carried from step to step: which conditions hold, and the events so far."""

    inner: Any
    holds: Bool[Array, " events"]
    record: Record


class Switching(diffrax.AbstractAdaptiveSolver, diffrax.AbstractWrappedSolver):
    r"""Steps of `solver`, in pieces where events occur.

    The vector holds what events change (discrete variables, then a flag) at the places `start` to `stop`; `solver` sees
    the rest. `margins(t, y, args)` are the conditions, true above zero; `settle(t, y, holds, forced, args)` carries out
    the events that have become true, and those of `forced`; `bound(args, y)` are the arguments for the vector field.

    A step is taken as if there were no events. Where a condition becomes true in it, the first such moment $t^*$ is
    located on the dense output, and from there a second piece is taken. A step with two moments of events in it counts
    as failed, so that it is repeated in smaller ones. The moment's derivative is implicit, by one step of Newton's
    method: what follows, times included, has the exact derivative (that of the saltation matrix).
    """

    solver: Any
    start: int = eqx.field(static=True)
    stop: int = eqx.field(static=True)
    n_records: int = eqx.field(static=True)
    margins: Callable[[Any, Any, Any], Any] = eqx.field(static=True)
    settle: Callable[[Any, Any, Any, Any, Any], Settled] = eqx.field(static=True)
    bound: Callable[[Any, Any], Any] = eqx.field(static=True)

    @property
    def term_structure(self) -> Any:
        return self.solver.term_structure

    @property
    def term_compatible_contr_kwargs(self) -> Any:
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self) -> Any:
        return self.solver.root_finder

    @property
    def scan_kind(self) -> Any:
        return self.solver.scan_kind

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return _interpolation(self.solver.interpolation_cls, self.start)

    def order(self, terms: Any) -> Any:
        return self.solver.order(terms)

    def error_order(self, terms: Any) -> Any:
        return self.solver.error_order(terms)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any) -> Memory:
        inner = self.solver.init(terms, t0, t1, self._core(y0), self.bound(args, y0))
        record = Record(jnp.full(self.n_records, jnp.inf), jnp.full(self.n_records, -1), jnp.asarray(0))
        return Memory(inner, self.margins(t0, y0, args) > 0, record)

    def func(self, terms: Any, t0: Any, y0: Vector, args: Any) -> Vector:
        rates = self.solver.func(terms, t0, self._core(y0), self.bound(args, y0))
        return self._joined(rates, jnp.zeros(self.stop - self.start))

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any, solver_state: Memory, made_jump: Any
    ) -> tuple[Vector, Vector, dict[str, Any], Memory, diffrax.RESULTS]:
        def piece(t: Any, y: Vector, inner: Any, jumped: Any) -> Any:
            bound = self.bound(args, y)
            core, error, info, inner, result = self.solver.step(terms, t, t1, self._core(y), bound, inner, jumped)
            return self._joined(core, self._switched(y)), error, info, inner, result

        def whole() -> tuple[Any, Any, Any]:
            y1, error, info, inner, result = piece(t0, y0, solver_state.inner, made_jump)
            return (y1, error, inner, result), info, self.interpolation(t0, t1, info, y0)

        first, info, path = whole()
        fires, holds, lower, upper = self._look(path, t0, t1, args, solver_state.holds)

        def without() -> Any:
            y1, error, inner, _ = first
            return y1, error, info, t1, self._switched(y0), Memory(inner, holds, solver_state.record)

        def through() -> Any:
            when = self._moment(path, args, fires, lower, upper)
            y = path.evaluate(when)
            margins = jnp.where(fires, self.margins(when, y, args), -jnp.inf)
            settled = self.settle(when, y, solver_state.holds, margins == jnp.max(margins), args)
            after = settled.y.at[self.stop - 1].set(settled.flag)
            bound = self.bound(args, after)
            inner = self.solver.init(terms, when, t1, self._core(after), bound)
            y1, error, later, inner, _ = piece(when, after, inner, True)
            rest = self.interpolation(when, t1, later, after)
            soon = when + INSTANT * (t1 - t0)
            still = self.margins(soon, rest.evaluate(soon), args) > 0
            again, holds, _, _ = self._look(rest, when, t1, args, settled.holds & still)
            error = jnp.maximum(jnp.abs(error), jnp.abs(first[1]))
            error = jnp.where(jnp.any(again), jnp.inf, error)
            record = _noted(solver_state.record, when, settled.fired)
            return y1, error, later, when, self._switched(after), Memory(inner, holds, record)

        y1, error, later, when, switched, memory = jax.lax.cond(jnp.any(fires), through, without)
        infos = {"first": info, "later": later, "when": when, "before": self._switched(y0), "after": switched}
        failed = (switched[-1] != 0) & jnp.all(jnp.isfinite(error))
        result = diffrax.RESULTS.where(failed, diffrax.RESULTS.internal_error, first[3])
        return y1, self._joined(error, jnp.zeros(self.stop - self.start)), infos, memory, result

    def interpolation(self, t0: Any, t1: Any, info: Any, y: Vector) -> "Held":
        """Dense output of one piece, with what events change as it is in `y`."""
        return Held(t0, t1, self.solver.interpolation_cls(t0=t0, t1=t1, **info), self._switched(y), self.start)

    def _look(self, path: "Held", t0: Any, t1: Any, args: Any, holds: Any) -> tuple[Any, Any, Any, Any]:
        """Which events fire first on a piece, which conditions hold at its end, and between which samples it is."""
        path, args, t0, t1 = jax.lax.stop_gradient((path, args, t0, t1))
        times = jnp.stack([*(t0 + share * (t1 - t0) for share in SAMPLES), t1])
        found = jax.vmap(lambda t: self.margins(t, path.evaluate(t), args))(times) > 0
        fires, lower, upper = jnp.zeros_like(holds), t0, t0
        for i in range(len(found)):
            now = found[i] & ~holds & ~jnp.any(fires)
            began = jnp.any(now)
            lower = jnp.where(began, times[i - 1] if i else t0 + INSTANT * (t1 - t0), lower)
            upper = jnp.where(began, times[i], upper)
            fires, holds = fires | now, found[i]
        return fires, holds, lower, upper

    def _moment(self, path: "Held", args: Any, fires: Any, lower: Any, upper: Any) -> Any:
        """When the first of the events that fire does."""

        def largest(t: Any, given: Any) -> Any:
            path, args = given
            return jnp.max(jnp.where(fires, self.margins(t, path.evaluate(t), args), -jnp.inf))

        held = jax.lax.stop_gradient((path, args))
        options = {"lower": lower, "upper": upper}
        found = optx.root_find(largest, Crossing(), upper, held, options=options, max_steps=200, throw=False).value
        found = jax.lax.stop_gradient(found)
        slope = jax.lax.stop_gradient(jax.jvp(lambda t: largest(t, held), (found,), (jnp.ones_like(found),))[1])
        # Of no value, but with the derivative of the moment.
        missing = largest(found, (path, args))
        missing = missing - jax.lax.stop_gradient(missing)
        return found - jnp.where(slope != 0, missing / jnp.where(slope != 0, slope, 1.0), 0.0)

    def _core(self, y: Vector) -> Vector:
        return jnp.concatenate([y[: self.start], y[self.stop :]])

    def _switched(self, y: Vector) -> Vector:
        return y[self.start : self.stop]

    def _joined(self, core: Vector, switched: Vector) -> Vector:
        return jnp.concatenate([core[: self.start], switched, core[self.start :]])


def _noted(record: Record, when: Any, fired: Any) -> Record:
    """The record with the events that have fired."""
    size = min(AT_ONCE, len(fired))
    numbers = jnp.nonzero(fired, size=size, fill_value=-1)[0]
    count = jnp.minimum(jnp.sum(fired), size)
    places = jnp.where(numbers >= 0, record.count + jnp.arange(size), len(record.times))
    return Record(
        record.times.at[places].set(when, mode="drop"),
        record.numbers.at[places].set(numbers, mode="drop"),
        record.count + count,
    )


class Held(diffrax.AbstractLocalInterpolation):
    """Dense output of the inner solver, with what events change held constant."""

    t0: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    inner: diffrax.AbstractLocalInterpolation
    switched: Vector
    start: int = eqx.field(static=True)

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        core = self.inner.evaluate(t0, left=left)
        return jnp.concatenate([core[: self.start], self.switched, core[self.start :]])


class Pieces(diffrax.AbstractLocalInterpolation):
    """Dense output of a step in two pieces, the second from `when` on; at that moment, the values before the event."""

    t0: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    when: Any
    before: Held
    after: Held

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        is_before = (t0 <= self.when) if left else (t0 < self.when)
        return jnp.where(is_before, self.before.evaluate(t0, left=left), self.after.evaluate(t0, left=left))


@ft.cache
def _interpolation(inner: Any, start: int) -> Any:
    """One function for each kind of inner interpolation, since jax compiles anew for another one."""

    def make(*, t0: Any, t1: Any, first: Any, later: Any, when: Any, before: Vector, after: Vector) -> Pieces:
        return Pieces(
            t0, t1, when,
            Held(t0, t1, inner(t0=t0, t1=t1, **first), before, start),
            Held(when, t1, inner(t0=when, t1=t1, **later), after, start),
        )  # fmt: skip

    return make
