"""An FMU as functions of its discrete state, its point or sample, and parameters, with derivatives in both modes."""

import contextlib
import dataclasses
import functools as ft
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero

from ..._errors import ModelError, SimulationError
from .description import REAL, Description, ImportedVariable, placed, size_of
from .instance import FIRST, NONE, AfterEvent, Instance, Machine, Reached, StateKey, provides_directional

DISCARDED = 2  # status of a call of FMI outside the range of the model
STEP, SECOND_STEP = 6e-6, 1e-4  # steps of central differences, relative to the size, for first and second derivatives


class Functions(Machine[AfterEvent]):
    """The functions of an FMU. A point is an array: the time, the states and the inputs."""

    kind = "ModelExchange"

    def __init__(
        self, path: Path, digest: str, description: Description, fixed: Sequence[float], by_differences: bool
    ) -> None:
        super().__init__(path, digest, description, fixed)
        self._reached[FIRST] = Reached(NONE, np.zeros(0))  # of which `values` may be asked before any event
        self._by_differences = by_differences
        self._has_directional = provides_directional(self.folder)
        self._place: np.ndarray | None = None  # the point of the instance
        self._last: np.ndarray | None = None  # the values there

    @property
    def n_point(self) -> int:
        """The number of elements of a point."""
        return 1 + self.description.n_states + self.description.n_inputs

    @property
    def n_values(self) -> int:
        """The number of rates, outputs and event indicators."""
        of = self.description
        return of.n_states + size_of(of.outputs) + of.n_indicators

    def values(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The rates, the outputs and the event indicators; NaN where the FMU has none, for which a solver shortens its
        step.
        """
        return _or_nan(lambda: self._values(number, point, parameters), self.n_values)

    def _values(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        of = self.description
        with self._at(number, point, parameters) as instance:
            if self._last is None:
                parts = (
                    (instance.rates, of.n_states),
                    (lambda: instance.get(of.outputs), size_of(of.outputs)),
                    (instance.indicators, of.n_indicators),
                )
                self._last = np.concatenate([_or_nan(read, size) for read, size in parts])
            return self._last

    def first_states(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The states that the FMU calculates in its initialisation."""
        del number, point
        with self._lock:
            return self._go(FIRST, parameters).states

    def event(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """An event: the number of the new discrete state, whether the FMU ends the run, the time of the next event, the
        signs of the event indicators, and the jumps of the states. The first event is the initialisation.
        """
        states = slice(1, 1 + self.description.n_states)
        with self._lock:
            new, answer = self._next(NONE if number == FIRST else number, point, parameters)
            moved = point.copy()
            moved[states] = answer.states
            values = self.values(new, moved, parameters)
            signs = values[len(values) - self.description.n_indicators :] > 0.0
            return np.concatenate([[new, answer.terminates, answer.next_time], signs, moved[states] - point[states]])

    # derivatives

    def by_point(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The derivatives of `values` with respect to the point: those by states and inputs as the FMU gives them, the
        one by time by differences, since FMI has none.
        """
        if self._by_differences:
            return central(lambda v: self.values(number, v, parameters), point, STEP)
        time, rest = point[:1], point[1:]
        by_time = central(lambda t: self.values(number, np.concatenate([t, rest]), parameters), time, STEP)
        rows, unknowns = self._unknowns()
        knowns = [variable.reference for variable in (*self.description.states, *self.description.inputs)]
        found = np.zeros((self.n_values, len(rest)))
        with self._at(number, point, parameters) as instance:
            for column, seed in enumerate(np.eye(len(rest))):
                found[rows, column] = instance.directional(unknowns, knowns, seed, len(rows))
        return np.concatenate([by_time, found], axis=1)

    def by_parameters(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The derivatives of `values` with respect to the parameters, by differences."""
        return central(lambda p: self.values(number, point, p), parameters, STEP)

    def first_by_parameters(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The derivatives of `first_states` with respect to the parameters, by differences."""
        return central(lambda p: self.first_states(number, point, p), parameters, STEP)

    def event_by(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The derivatives of `event` with respect to the point and the parameters. FMI has none, so they are zero where
        the event moves no state and sets no time of a next event. Otherwise they are refused.
        """
        now = self.event(number, point, parameters)
        jumps, next_time = now[len(now) - self.description.n_states :], now[2]
        if np.any(jumps != 0.0) or np.isfinite(next_time):
            what = "states" if np.any(jumps != 0.0) else f"the time of its next event, {next_time:g} s,"
            raise SimulationError(
                f"{self.path.name} sets {what} at an event at {point[0]:g} s. FMI has no derivatives of that, so no "
                "gradient exists through this event. Remedy: model this part with components, or end the run earlier."
            )
        return np.zeros((len(now), self.n_point + self.n_parameters))

    def check_point(self) -> None:
        """Raises `ModelError` if `by_point` needs differences that were not asked for."""
        if not self._has_directional:
            self._need_differences("with respect to its states and inputs")
        if self.description.n_indicators and not self.description.indicators:
            self._need_differences("of its event indicators, as all FMUs of FMI 2.0")

    def check_parameters(self) -> None:
        """Raises `ModelError` if differences by parameters were not asked for."""
        self._need_differences("with respect to its parameters")

    def _need_differences(self, what: str) -> None:
        if not self._by_differences:
            raise ModelError(
                f"{self.path.name} gives no derivatives {what}. Remedy: FMU(..., differences=True) takes differences, "
                "and simulate(..., solver=diffrax.Tsit5()) integrates without derivatives."
            )

    def _unknowns(self) -> tuple[np.ndarray, list[int]]:
        """The rows of `values` that the FMU differentiates, and their value references."""
        of = self.description
        rows, references, place = [], [], 0
        for variable in (*of.rates, *of.outputs):
            if variable.kind in REAL:
                rows += range(place, place + variable.count)
                references.append(variable.reference)
            place += variable.count
        return np.array([*rows, *range(place, self.n_values)], int), [*references, *of.indicators]

    # the instance

    def _advance(self, to: Reached, parameters: list[tuple[ImportedVariable, np.ndarray]]) -> AfterEvent:
        of = self.description
        if to.before == NONE:
            if not to.point.size:
                experiment = of.raw.defaultExperiment
                self._instance.initialise(float((experiment and experiment.startTime) or 0.0), parameters)
                return self._instance.end_event()
            given = [(v, to.point[place : place + v.count]) for v, place in placed(of.states, 1) if v.is_given]
            inputs = [(v, to.point[place : place + v.count]) for v, place in placed(of.inputs, 1 + of.n_states)]
            self._instance.initialise(to.point[0], [*parameters, *given, *inputs])
            answer = self._instance.end_event()
            if all(v.is_given for v in of.states):
                return answer
        self._move(to.point)
        self._instance.fmu.enterEventMode()
        return self._instance.end_event()

    def _reach(self, key: StateKey, parameters: np.ndarray) -> None:
        leaves = key != self._current
        super()._reach(key, parameters)
        self._place = None if leaves else self._place

    @contextlib.contextmanager
    def _at(self, number: int, point: np.ndarray, parameters: np.ndarray) -> Iterator[Instance]:
        """The instance in a discrete state and at a point."""
        with self._lock:
            self._go(number, parameters)
            if self._place is None or not np.array_equal(self._place, point):
                self._move(point)
            yield self._instance

    def _move(self, point: np.ndarray) -> None:
        n = self.description.n_states
        self._place, self._last = None, None
        self._instance.fmu.setTime(point[0])
        if n:
            self._instance.set_states(np.ascontiguousarray(point[1 : 1 + n]))
        self._instance.set(self.description.inputs, point[1 + n :])
        self._place = point.copy()


def _or_nan(read: Callable[[], np.ndarray], size: int) -> np.ndarray:
    """Values of the FMU; NaN where it discards the point."""
    try:
        return read()
    except Exception as error:
        if getattr(error, "status", None) == DISCARDED:
            return np.full(size, np.nan)
        raise


def central(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: float) -> np.ndarray:
    """The derivatives by central differences; the last axis counts the arguments."""
    columns = []
    for i, size in enumerate(np.maximum(np.abs(at), 1.0)):
        change = np.zeros_like(at)
        change[i] = step * size
        columns.append((function(at + change) - function(at - change)) / (2.0 * step * size))
    return np.stack(columns, -1) if columns else np.zeros((*np.shape(function(at)), 0))


class AfterStep(NamedTuple):
    """Answer of an FMU at the end of a communication step."""

    ends: bool
    outputs: np.ndarray


class SampledFMU(Machine[AfterStep]):
    """The samples of an FMU. A point is an array: the time, the length of the step up to it, and the inputs during the
    step. At the first sample there is no step, and the FMU is initialised.
    """

    kind = "CoSimulation"

    @property
    def n_values(self) -> int:
        """The number of elements of a sample."""
        return 2 + size_of(self.description.outputs)

    def sample(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The number of the new discrete state, whether the FMU ends the run, and the outputs."""
        with self._lock:
            new, answer = self._next(number, point, parameters)
            return np.concatenate([[new, answer.ends], answer.outputs])

    def _advance(self, to: Reached, parameters: list[tuple[ImportedVariable, np.ndarray]]) -> AfterStep:
        (time, step), inputs = to.point[:2], to.point[2:]
        instance = self._instance
        if to.before == NONE:
            of_inputs = [(v, inputs[place : place + v.count]) for v, place in placed(self.description.inputs)]
            instance.initialise(time, [*parameters, *of_inputs])
        instance.set(self.description.inputs, inputs)
        ends = to.before != NONE and instance.step(time - step, step)
        return AfterStep(ends, instance.get(self.description.outputs))


Host: TypeAlias = Callable[[int, np.ndarray, np.ndarray], np.ndarray]  # of the discrete state, the point, parameters


@dataclasses.dataclass(frozen=True)
class HostCall:
    """A function of an FMU. The derivatives have one more axis, of the point or of the parameters.

    Raises `ModelError` where a derivative is needed that does not exist.
    """

    host: Host
    shape: tuple[int, ...]
    by_point: "Derivative"
    by_parameters: "Derivative"

    def __call__(self, number: Array, point: Array, parameters: Array) -> Array:
        return _function(self)(jnp.asarray(number, float), point, parameters)


@ft.cache
def _function(call: HostCall) -> Callable[[Array, Array, Array], Array]:
    result = jax.ShapeDtypeStruct(call.shape, jax.dtypes.canonicalize_dtype(float))

    def evaluate(number: Array, point: Array, parameters: Array) -> np.ndarray:
        arguments = float(number), np.asarray(point, float), np.asarray(parameters, float)
        if not all(np.all(np.isfinite(argument)) for argument in arguments):
            return np.full(call.shape, np.nan)  # a trial of the solver that failed elsewhere
        return np.asarray(call.host(int(arguments[0]), *arguments[1:]), result.dtype).reshape(call.shape)

    @jax.custom_jvp
    def function(number: Array, point: Array, parameters: Array) -> Array:
        return jax.pure_callback(evaluate, result, number, point, parameters, vmap_method="sequential")

    @ft.partial(function.defjvp, symbolic_zeros=True)
    def _(primals: tuple[Array, Array, Array], tangents: tuple) -> tuple[Array, Array]:
        change = jnp.zeros(call.shape)
        for derivative, tangent in zip((call.by_point, call.by_parameters), tangents[1:], strict=True):
            if not isinstance(tangent, SymbolicZero) and jnp.size(tangent):
                change = change + jnp.tensordot(derivative()(*primals), tangent, 1)
        return function(*primals), change

    return function


Derivative: TypeAlias = Callable[[], HostCall]


def call_of(host: Host, shape: tuple[int, ...], by_point: Derivative, by_parameters: Derivative) -> HostCall:
    """A function whose derivatives are made once, when they are first needed."""
    return HostCall(host, shape, ft.cache(by_point), ft.cache(by_parameters))


def differenced(host: Host, shape: tuple[int, ...], sizes: tuple[int, int]) -> HostCall:
    """A function whose derivatives are differences and have no derivatives themselves.

    It stands for first derivatives: those of the second order serve a solver in the derivatives of its Jacobian, which
    do not change to what its steps converge. `sizes` are those of the point and the parameters.
    """

    def by_point(number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        return central(lambda v: host(number, v, parameters), point, SECOND_STEP)

    def by_parameters(number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        return central(lambda p: host(number, point, p), parameters, SECOND_STEP)

    return call_of(
        host,
        shape,
        lambda: HostCall(by_point, (*shape, sizes[0]), _no_third, _no_third),
        lambda: HostCall(by_parameters, (*shape, sizes[1]), _no_third, _no_third),
    )


def _no_third() -> HostCall:
    raise ModelError("An FMU has derivatives up to the second, and the second serve the solver only.")
