"""FMUs for model exchange: their states, events and derivatives are those of the model around them."""

from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
from jax import Array

from ..._declare.annotations import Discrete, Scalar
from ..._declare.component import Equations, Events, at, eq, refuse, when
from .calls import HostCall, call_of, differenced
from .component import ImportedFMU
from .description import placed
from .functions import Functions

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
