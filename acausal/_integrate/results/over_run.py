"""Integrals and peaks of functions of the variables over a run, computed from its recorded steps."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._equinox_private import unvmap_any
from ..._evaluate.starts import Inputs
from ..._interpret.in_parts import in_parts
from ..._numbers import Numbers
from ..._tracing import are_traced
from ..events.extrema import CLOSE, Peak, Turn, located
from ..loop.carry import StepRecord
from ..setup.user_function import UserFunction
from .pieces import (
    AT_ONCE,
    CURVE,
    LEAST,
    N_NODES,
    NODES,
    PLACES,
    ROUGH_WEIGHTS,
    ROUNDING,
    TAIL,
    WEIGHTS,
    Pieces,
    filled_up,
    room_for,
    whole_steps,
)
from .reading import SHARES, Reading
from .trajectories import NUMBERS, trajectories

ROWS = NUMBERS[-1]  # number of rows in one evaluation of a function, if numbers are known
POINTS = 16 * SHARES  # places in each round of the search for a peak
ROUNDS = 5  # rounds that locate a peak to 1e-10 of a piece
NEAR = 1e-3  # fraction of a piece from whose ends rates show whether a peak is a kink
ROOM = 4  # pieces per step for which there is room
T = TypeVar("T")


class Integral(NamedTuple):
    """Integrals over a run, their estimated errors, and the integrals of the absolute values."""

    value: Any
    error: Any
    size: Any


class _Sum(NamedTuple):
    """State of the division for integrals: the pieces to examine, and the `count` of those that are `done`.

    The size of pieces without room is part of the error.
    """

    open: Pieces
    done: Pieces
    count: Any
    value: Any
    error: Any
    size: Any


class _Top(NamedTuple):
    """State of the search for peaks: the pieces to examine and, for each function, the largest value so far, its step,
    its place and the width of its piece, in shares of the step, and the range of all values.
    """

    open: Pieces
    best: Any
    step: Any
    place: Any
    width: Any
    least: Any
    largest: Any


@dataclasses.dataclass(frozen=True)
class OverRun:
    """A function of the variables over a run, with its `constants` and the `params` that it reads, by leaf.

    Steps are divided into pieces until the function is a polynomial on each, to a hundredth of the relative tolerance
    `rtol` of the run: at kinks, jumps and spikes that the steps do not resolve, because the run does not know the
    function.
    """

    reading: Reading
    function: UserFunction
    constants: list[Numbers]
    params: dict[int, Numbers]
    record: StepRecord
    inputs: Inputs
    forward: Any  # 1, or -1 for a run backwards in time
    rtol: Any

    def integral(self, *, alike: bool = False) -> Integral:
        """Integrals over time by Clenshaw-Curtis quadrature on pieces, and their errors.

        `alike` functions have one unit. Their errors are compared with the largest of their integrals.

        A piece is halved until its mean and that of the polynomial of half the degree agree, and the highest
        coefficients of the polynomial vanish. Derivatives are those at fixed pieces. At a kink, the last pieces are so
        short that first derivatives are exact within the tolerance.
        """
        held, n = self._held(), self.function.n_outputs
        whole = held._whole_steps()
        done = room_for(ROOM * len(whole.step), held._is_traced)
        nothing = held._xp.zeros(n)
        start = _Sum(whole, done, held._xp.asarray(0), nothing, nothing, nothing)
        found = _until_none_is_open(ft.partial(held._summed, alike), start, held._is_traced)
        value = found.value
        if self._is_traced:
            done = filled_up(found.done)
            means = self._by_block(lambda values: (_weighted(WEIGHTS, values),), done)[0]
            value = self._durations(done) @ means
        return Integral(self.forward * value, found.error, found.size)

    def _summed(self, alike: bool, state: _Sum) -> _Sum:
        """The sums after examining all open pieces."""
        xp, pieces = self._xp, state.open

        def summary(values: Any) -> tuple[Any, ...]:
            mean, sizes, xp = _weighted(WEIGHTS, values), abs(values), jnp if are_traced(values) else np
            # The means of a jump in the middle agree by symmetry. Its highest coefficients do not vanish.
            tail = abs(_weighted(TAIL, values)).max(1)
            error = xp.maximum(abs(mean - _weighted(ROUGH_WEIGHTS, values)), tail)
            return mean, error, _weighted(WEIGHTS, sizes), sizes.max(1)

        mean, error, size, largest = self._by_block(summary, pieces)
        widths, start = self._durations(pieces), self.record.ts[0]
        whole = state.size + widths @ size
        span = self.record.ts[self.record.n] - start
        allowed = 0.01 * self.rtol * (xp.max(whole) if alike else whole) / xp.where(span > 0.0, span, 1.0)
        is_rough = xp.any(error > allowed + ROUNDING * largest, axis=1) & (pieces.width > LEAST) & pieces.there
        is_rough &= xp.cumsum(is_rough) <= self._most // 2
        is_done = pieces.there & ~is_rough
        mine = xp.where(is_done, widths, 0.0)
        done, count, lost = state.done, state.count, 0.0
        if self._is_traced:
            is_left = is_done & (count + xp.cumsum(is_done) > len(done.step))
            lost = xp.where(is_left, widths, 0.0) @ size
        done, count = done.with_more(count, pieces, is_done), count + xp.sum(is_done)
        return _Sum(
            open=pieces.halves(is_rough),
            done=done,
            count=count,
            value=state.value + mine @ mean,
            error=state.error + mine @ error + lost,
            size=state.size + mine @ size,
        )

    def peak(self) -> Peak:
        """The maxima and their times.

        A piece is halved until its polynomial represents the function, or cannot exceed the largest value so far. The
        search then narrows the interval around the largest value. In traced runs, the peak has the derivatives of the
        extremum or the kink, as peaks of `simulate` do.
        """
        held, n = self._held(), self.function.n_outputs
        xp = held._xp
        nothing = xp.zeros(n)
        start = _Top(
            held._whole_steps(),
            nothing - xp.inf,
            xp.zeros(n, int),
            nothing,
            nothing + 1.0,
            nothing + xp.inf,
            nothing - xp.inf,
        )
        found = _until_none_is_open(held._topped, start, held._is_traced)

        def top(j: Any) -> Peak:
            step, start = found.step[j], (found.place[j], 0.1 * found.width[j])
            place = _repeated(ft.partial(held._narrowed, step, j), start, held._is_traced)[0]
            return self._refined(step, place, found.width[j], j)

        tops = jax.vmap(top)(jnp.arange(n)) if held._is_traced else _stacked([top(j) for j in range(n)])
        t, y = self.record.ts[self.record.n], self.record.ys[self.record.n]
        last = self.values(jnp.reshape(t, 1), y[None])[0]
        is_last = ~((self.record.n > 0) & (tops.value >= last))  # the value after an event at the end
        return Peak(jnp.where(is_last, last, tops.value), jnp.where(is_last, self.forward * t, tops.time))

    def _topped(self, state: _Top) -> _Top:
        """The largest values after examining all open pieces."""
        xp, pieces = self._xp, state.open

        def summary(values: Any) -> tuple[Any, ...]:
            curve, tail = _weighted(CURVE, values), abs(_weighted(TAIL, values)).max(1)
            on_curve = xp.asarray(PLACES)[curve.argmax(1)]
            at_node = xp.asarray(NODES)[values.argmax(1)]
            return values.max(1), at_node, curve.max(1), on_curve, N_NODES * tail, values.min(1)

        value, place, by_curve, on_curve, margin, least = self._by_block(summary, pieces)
        there = pieces.there[:, None]
        least = xp.minimum(state.least, xp.min(xp.where(there, least, xp.inf), axis=0))
        largest = xp.maximum(state.largest, xp.max(xp.where(there, value, -xp.inf), axis=0))
        allowed = 0.01 * self.rtol * (largest - least) + ROUNDING * xp.maximum(abs(least), abs(largest))
        is_above = by_curve > value
        upper = xp.where(is_above, by_curve, value)
        takes_curve = is_above & (margin <= allowed)
        value, place = xp.where(takes_curve, by_curve, value), xp.where(takes_curve, on_curve, place)
        value = xp.where(there, xp.where(xp.isnan(value), xp.inf, value), -xp.inf)
        row = xp.argmax(value, axis=0)
        own = row, xp.arange(len(row))
        is_higher = value[own] > state.best
        best = xp.where(is_higher, value[own], state.best)
        may_be_higher = (upper + margin > best) & (margin > allowed)
        is_open = xp.any(may_be_higher, axis=1) & (pieces.width > LEAST) & pieces.there
        is_open &= xp.cumsum(is_open) <= self._most // 2
        width = pieces.width[row]
        return _Top(
            open=pieces.halves(is_open),
            best=best,
            step=xp.where(is_higher, pieces.step[row], state.step),
            place=xp.where(is_higher, pieces.low[row] + width * place[own], state.place),
            width=xp.where(is_higher, width, state.width),
            least=least,
            largest=largest,
        )

    def lost(self) -> Array:
        """The decrease of the first function across the listed events at the end of each step."""
        record = self.record
        is_cut = jnp.isfinite(record.moments) & (record.moments > record.ts[0])
        rows = is_cut[:, None]
        before = jnp.where(rows, record.befores, record.ys[:1]), jnp.where(is_cut, record.moments, record.ts[0])
        after = jnp.where(rows, record.ys[1:], record.ys[:1]), jnp.where(is_cut, record.ts[1:], record.ts[0])
        high, low = (self.values(t, y)[:, 0] for y, t in (before, after))
        return jnp.where(is_cut, high - low, 0.0)

    def _narrowed(self, step: Array, j: Any, bracket: tuple[Any, Any]) -> tuple[Any, Any]:
        """The best of several places in a bracket, and the half width of the next bracket around it."""
        place, width = bracket
        theta = jnp.clip(place + width * jnp.linspace(-1.0, 1.0, POINTS), 0.0, 1.0)
        rows = theta.reshape(-1, SHARES)
        found = self._within(jnp.broadcast_to(step, len(rows)), rows)[1].reshape(POINTS, -1)[:, j]
        return theta[jnp.argmax(found)], width * 2.0 / (POINTS - 1)

    def _refined(self, step: Array, place: Array, width: Array, j: Any) -> Peak:
        """The peak near a place in a piece of a step, with its derivatives in traced runs.

        Without an extremum or a kink there, such as at the ends of the step, it stays at that place.
        """

        def along(over: OverRun) -> Callable[[Array], tuple[Array, Array]]:
            value = lambda theta: over._within(step[None], theta[None, None])[1][0, 0, j][None]  # noqa: E731
            return jax.vmap(lambda theta: jax.jvp(value, (theta,), (jnp.ones_like(theta),)))

        if not self._is_traced:
            times, values = self._within(step[None], place[None, None])
            return Peak(values[0, 0, j], self.forward * times[0, 0])
        reach = jnp.clip(width, NEAR, 1.0)
        close, near = jnp.asarray([-CLOSE, CLOSE]) * reach, jnp.asarray([-NEAR, NEAR]) * reach
        around = jnp.clip(place + jnp.concatenate([close, near]), 0.0, 1.0)
        rates = along(self._held())(around)[1][:, 0]
        fall, whole = rates[0] - rates[1], rates[2] - rates[3]
        gap, part = around[1] - around[0], around[3] - around[2]
        is_smooth = fall <= jnp.sqrt(gap / part) * whole
        bend = -fall / gap
        turns = jnp.where(is_smooth, abs(rates[0]) < NEAR * reach * fall / gap, (rates[0] > 0.0) & (rates[1] < 0.0))
        exists = turns & (fall > 0.0) & (place > 0.0) & (place < 1.0)
        turn = Turn(*(jnp.reshape(x, 1) for x in (around[0], around[1], bend, is_smooth, exists)))
        inside, there = located(turn, along(self), jnp.reshape(place, 1))
        start, end = self.record.infos["start"][step], self.record.ts[step + 1]
        time = start + jnp.where(exists, inside.time[0], place) * (end - start)
        return Peak(jnp.where(exists, inside.value[0], there[0, 0]), self.forward * time)

    def _by_block(self, summary: Callable[[Any], tuple[Any, ...]], pieces: Pieces) -> tuple[Any, ...]:
        """The summary of the values of the function on pieces, [pieces, nodes, functions], some pieces at once. Traced
        blocks without a piece are skipped.
        """

        def of_block(block: Pieces) -> tuple[Any, ...]:
            return summary(self._on_pieces(block))

        n = len(pieces.step)
        if not (self._is_traced or are_traced(pieces)):
            rows = [slice(i, i + AT_ONCE) for i in range(0, n, AT_ONCE)]
            blocks = [of_block(Pieces(*(x[some] for x in pieces))) for some in rows]
            return tuple(np.concatenate(parts) for parts in zip(*blocks, strict=True))
        folded = Pieces(*(x.reshape(-1, AT_ONCE) for x in pieces))

        def nothing(block: Pieces) -> tuple[Any, ...]:
            return jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(of_block, block))

        def unless_empty(block: Pieces) -> tuple[Any, ...]:
            return jax.lax.cond(unvmap_any(block.there), of_block, nothing, block)

        found = jax.lax.map(unless_empty, folded)
        return jax.tree.map(lambda x: jnp.where(_column(pieces.there, x), x.reshape(n, *x.shape[2:]), 0), found)

    def _on_pieces(self, pieces: Pieces) -> Any:
        """Values of the function at the nodes of pieces, [pieces, nodes, functions]."""
        if self._is_traced or are_traced(pieces):
            return self._within(pieces.step, pieces.shares)[1]
        rows = N_NODES // SHARES
        values = self._within(np.repeat(pieces.step, rows), pieces.shares.reshape(-1, SHARES))[1]
        return values.reshape(-1, N_NODES, values.shape[-1])

    def _durations(self, pieces: Pieces) -> Any:
        """The lengths of pieces in s; 0 for rows that are not used."""
        record = self.record
        lengths = record.ts[pieces.step + 1] - record.infos["start"][pieces.step]
        return self._xp.where(pieces.there, pieces.width * lengths, 0.0)

    def _whole_steps(self) -> Pieces:
        count = self.record.n if self._is_traced else int(self.record.n)
        return whole_steps(count, len(self.record.moments) if self._is_traced else max(int(count), 1), self._is_traced)

    @property
    def _most(self) -> int:
        """The largest number of open pieces."""
        if self._is_traced:
            return len(whole_steps(0, len(self.record.moments), True).step)
        return ROOM * (int(self.record.n) + AT_ONCE)

    @property
    def _xp(self) -> Any:
        return jnp if self._is_traced else np

    def _within(self, steps: Any, theta: Any) -> tuple[Any, Any]:
        """Times and values of the function at fractions [steps, shares] of some steps."""
        if self._is_traced or are_traced(steps, theta):
            return self._of_block(steps, theta)
        steps, theta = np.asarray(steps), np.asarray(theta)
        blocks = [slice(i, i + ROWS // SHARES) for i in range(0, len(steps), ROWS // SHARES)]
        ts, values = zip(*(self._of_block(steps[block], theta[block]) for block in blocks), strict=True)
        return np.concatenate(ts), np.concatenate(values)

    def _of_block(self, steps: Any, theta: Any) -> tuple[Any, Any]:
        ts, ys = self.reading.within(steps, theta, self.record, self.inputs, self.forward)
        values = self.values(ts.reshape(-1), ys.reshape(-1, ys.shape[-1]))
        return ts, values.reshape(*ts.shape, -1)

    def values(self, ts: Any, ys: Any) -> Any:
        """Values of the function at forward times and state vectors."""
        if self._is_traced or are_traced(ts, ys):
            return self._values(ts, ys)
        ts, ys = np.asarray(ts), np.asarray(ys)
        blocks = [np.arange(i, i + ROWS) for i in range(0, len(ts), ROWS)]
        rows = [np.minimum(block, len(ts) - 1) for block in blocks]
        return np.concatenate([np.asarray(self._values(ts[some], ys[some])) for some in rows])[: len(ts)]

    def _values(self, ts: Any, ys: Any) -> Array:
        system, layout = self.reading.system, self.reading.layout
        found = trajectories(system, 0, self.forward * ts, ys[:, layout.point], self.inputs)
        varying = {leaf: found[leaf] for leaf in self.function.leaves if leaf in found}
        return _evaluated(self.function, len(ts), self.constants, varying, self.params)

    def _held(self) -> "OverRun":
        numbers = (self.constants, self.params, self.record, self.inputs, self.forward, self.rtol)
        return OverRun(self.reading, self.function, *jax.lax.stop_gradient(numbers)) if self._is_traced else self

    @property
    def _is_traced(self) -> bool:
        return are_traced(self.constants, self.params, self.record, self.inputs, self.forward)


@ft.partial(in_parts, static_argnums=(0, 1))
def _evaluated(
    function: UserFunction, n: int, constants: list[Numbers], varying: dict[int, Any], fixed: dict[int, Any]
) -> Array:
    def at(varying: dict[int, Any], _: Array) -> Array:
        values = fixed | varying
        return jnp.stack(function(constants, [values[leaf] for leaf in function.leaves]))

    return jax.vmap(at)(varying, jnp.zeros(n))


def _weighted(weights: np.ndarray, values: Any) -> Any:
    """Sums over the nodes of values on pieces, [pieces, ..., functions], for each row of weights."""
    xp: Any = jnp if are_traced(values) else np
    return xp.moveaxis(xp.tensordot(weights, values, (-1, 1)), -2, 0)


def _column(mask: Array, like: Array) -> Array:
    """A mask of the pieces for an array of blocks of pieces."""
    return mask.reshape(-1, *[1] * (like.ndim - 2))


S = TypeVar("S", _Sum, _Top)


def _until_none_is_open(body: Callable[[S], S], start: S, is_traced: bool) -> S:
    """Applies `body` as long as there are open pieces, traced as a loop."""
    if is_traced:
        return jax.lax.while_loop(lambda state: jnp.any(state.open.there), body, start)
    while np.any(start.open.there):
        start = body(start)
    return start


def _repeated(body: Callable[[T], T], start: T, is_traced: bool) -> T:
    """Applies `body` for all rounds, traced as a loop."""
    if is_traced:
        return jax.lax.fori_loop(0, ROUNDS, lambda _, x: body(x), jax.tree.map(jnp.asarray, start))
    for _ in range(ROUNDS):
        start = body(start)
    return start


def _stacked(peaks: list[Peak]) -> Peak:
    return Peak(*(jnp.stack(parts) for parts in zip(*peaks, strict=True)))
