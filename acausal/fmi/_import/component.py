"""An FMU as a component: its class, with the FMU's variables as fields."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import jax.numpy as jnp
from jax import Array

from components.blocks import Output

from ..._declare.annotations import Discrete, Param, Scalar, Time, positive
from ..._declare.component import Component, Equation, Equations, Events, at, eq, refuse, when
from ..._errors import ModelError
from .description import Description, ImportedVariable, placed
from .functions import Functions, HostCall, SampledFMU, call_of, differenced


@dataclasses.dataclass(frozen=True)
class Key:
    """Key of the class of an imported FMU: its file and the options of the import."""

    path: Path
    digest: str  # of the content of the file
    outputs: tuple[str, ...]
    fixed: tuple[tuple[str, float], ...]  # values of whole numbers, by attribute
    differences: bool
    is_sampled: bool


class ImportedFMU(Component, partial=True):
    """Base class of imported FMUs, for model exchange and for co-simulation.

    The discrete states of an FMU have numbers; `reached` is that of the present one.
    """

    t: Time[Scalar, "s"] = 0.0
    ended: Discrete[Scalar, "1"] = 0.0  # 1 if the FMU has asked to end the simulation
    _key: ClassVar[Key]
    _of: ClassVar[Description]
    _calls: ClassVar[Any]  # the functions of the FMU in JAX

    def _inputs(self) -> Array:
        values = [getattr(self, variable.field) for variable in self._of.inputs]
        return joined([port.value for item in values for port in (item if isinstance(item, tuple) else (item,))])

    def _parameters(self) -> Array:
        return joined([getattr(self, variable.field) for variable in self._of.parameters])

    def _equals(self, variable: ImportedVariable, values: Array, place: int) -> Equation:
        """A variable of the component is a part of an array."""
        own = getattr(self, variable.field)
        if isinstance(own, tuple):
            own = jnp.stack([port.value for port in own])
        part = values[place : place + variable.count]
        right = part[0] if not variable.sizes else jnp.reshape(part, jnp.shape(own))
        return eq(own.value if isinstance(own, Output) else own, right, check_units=False)

    def __reduce__(self) -> Any:
        return blank, (self._key,), dict(vars(self))


def blank(key: Key) -> ImportedFMU:
    """A component without values, into which a pickle is restored."""
    from .fmu import class_of

    return object.__new__(class_of(key))


def joined(parts: Sequence[Any]) -> Array:
    """Scalars and arrays in one flat array."""
    return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(jnp.asarray(part, float)) for part in parts)])


BEGINNING = -1e300  # s, before any run: an event that is due happens at its start


class Calls:
    """The functions of an FMU for model exchange in JAX, with their derivatives."""

    def __init__(self, functions: Functions) -> None:
        of, n_point, n_parameters = functions.description, functions.n_point, functions.n_parameters
        sizes, values = (n_point, n_parameters), (functions.n_values,)
        event = (3 + of.n_indicators + of.n_states,)

        def values_by_point() -> HostCall:
            functions.check_point()
            return differenced(functions.by_point, (*values, n_point), sizes)

        def values_by_parameters() -> HostCall:
            functions.check_parameters()
            return differenced(functions.by_parameters, (*values, n_parameters), sizes)

        def first_by_parameters() -> HostCall:
            functions.check_parameters()
            return differenced(functions.first_by_parameters, (of.n_states, n_parameters), (0, n_parameters))

        self.values = call_of(functions.values, values, values_by_point, values_by_parameters)
        self.event = call_of(
            functions.event,
            event,
            lambda: differenced(lambda *at: functions.event_by(*at)[:, :n_point], (*event, n_point), sizes),
            lambda: differenced(lambda *at: functions.event_by(*at)[:, n_point:], (*event, n_parameters), sizes),
        )
        self.first_states = call_of(functions.first_states, (of.n_states,), _of_no_point, first_by_parameters)


def _of_no_point() -> HostCall:
    raise AssertionError("the first states do not depend on a point")


class ModelExchange(ImportedFMU, partial=True):
    """An FMU whose states, events and derivatives are those of the model around it.

    With the states x, the inputs u and the parameters p: dx/dt = f(t, x, u, p), y = g(t, x, u, p). A sign change of one
    of the event indicators z(t, x, u, p), and the time of the next event, are events, which the FMU handles.
    """

    reached: Discrete[Scalar, "1"] = 0.0
    next_event: Discrete[Scalar, "s"] = jnp.inf

    if TYPE_CHECKING:  # fields of the classes of FMUs that have states and event indicators
        states: Array
        signs: Array

    def equations(self, d: Any) -> Equations:
        of, values = self._of, self._values(self._inputs())
        rest = values if of.n_inputs == 0 else self._values(jnp.zeros(of.n_inputs))  # what no input affects
        found: Equations = {}
        if of.n_states:
            found["rates"] = eq(d.states, values[: of.n_states], check_units=False)
            found |= {v.field: self._equals(v, self.states, place) for v, place in placed(of.states)}
        for (variable, place), is_direct in zip(placed(of.outputs, of.n_states), of.direct, strict=True):
            if variable.field not in found:
                found[variable.field] = self._equals(variable, values if is_direct else rest, place)
        return found

    def initial_equations(self, d: Any) -> Equations:
        del d
        calculated = [(v, place) for v, place in placed(self._of.states) if not v.is_given]
        if not calculated:
            return {}
        first = self._calls.first_states(self.reached, jnp.zeros(0), self._parameters())
        return {v.field: self._equals(v, first, place) for v, place in calculated}

    def events(self) -> Events:
        of = self._of
        event = self._calls.event(self.reached, self._point(self._inputs()), self._parameters())
        changes = {"reached": event[0], "ended": event[1], "next_event": event[2]}
        if of.n_states:
            changes["states"] = self.states + event[3 + of.n_indicators :]
        state_event: Events = {}
        if of.n_indicators:
            changes["signs"] = event[3 : 3 + of.n_indicators]
            indicators = self._values(self._inputs())[-of.n_indicators :]
            rises = jnp.any((indicators > 0.0) & (self.signs < 0.5))
            falls = jnp.any((indicators <= 0.0) & (self.signs > 0.5))
            has_begun = self.reached > 0.5
            state_event["state_event"] = when(has_begun & (rises | falls), check_units=False, **changes)
        return {
            "_begin": at(BEGINNING, check_units=False, **changes),
            **state_event,
            "time_event": at(self.next_event, check_units=False, **changes),
            "_end": refuse(self.ended > 0.5, f"the FMU {self._key.path.name} ends the simulation"),
        }

    def _point(self, inputs: Array) -> Array:
        return jnp.concatenate([jnp.reshape(self.t, 1), self.states if self._of.n_states else jnp.zeros(0), inputs])

    def _values(self, inputs: Array) -> Array:
        return self._calls.values(self.reached, self._point(inputs), self._parameters())


class SampleCalls:
    """The samples of an FMU for co-simulation in JAX. They have no derivatives."""

    def __init__(self, samples: SampledFMU) -> None:
        def refused() -> HostCall:
            raise ModelError(
                f"{samples.path.name} is sampled, and co-simulation has no derivatives. Remedy: import it for model "
                "exchange, without step."
            )

        self.sample = call_of(samples.sample, (samples.n_values,), refused, refused)


class CoSimulation(ImportedFMU, partial=True):
    """An FMU that is sampled at start_time, start_time + step, ...

    At each sample the FMU advances by a step, with the inputs of the sample before. The outputs hold their values until
    the next sample. At the time of a sample, a solution has the outputs before it, as for all events.
    """

    step: Param[Scalar, "s", positive]  # communication step
    start_time: Param[Scalar, "s"] = 0.0  # time of the first sample
    reached: Discrete[Scalar, "1"] = -1.0
    since: Discrete[Scalar, "s"] = 0.0  # time of the last sample

    if TYPE_CHECKING:  # fields of the classes of FMUs that have outputs and inputs
        outputs: Array
        held: Array

    def equations(self, d: Any) -> Equations:
        del d
        return {v.field: self._equals(v, self.outputs, place) for v, place in placed(self._of.outputs)}

    def events(self) -> Events:
        inputs = self._inputs()
        is_first = self.reached < -0.5
        time = jnp.where(is_first, self.t, self.since + self.step)
        during = jnp.where(is_first, inputs, self.held) if self._of.n_inputs else inputs
        point = jnp.concatenate([jnp.stack([time, self.step]), during])
        sample = self._calls.sample(self.reached, point, self._parameters())
        changes = {"reached": sample[0], "ended": sample[1], "since": time}
        if self._of.outputs:
            changes["outputs"] = sample[2:]
        if self._of.n_inputs:
            changes["held"] = inputs
        return {
            "sample": at(self.start_time, every=self.step, check_units=False, **changes),
            "_end": refuse(self.ended > 0.5, f"the FMU {self._key.path.name} ends the simulation"),
        }
