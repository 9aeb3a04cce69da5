"""Sequential control."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import Component, Discrete, Equations, Events, ParameterError, Scalar, eq, when

from ._interfaces import Input, Output


class StateMachine(Component):
    """States 0, 1, ... with one of them active, and transitions (sequential function chart, IEC 61131-3).

    `StateMachine(transitions=[(0, 1), (1, 2), (2, 0)])` has an input u[k] for each transition and an output y[i] for
    each state, 1 while it is active. A transition fires if its first state is active and its input exceeds 1/2; each is
    an event. If several can fire, the last in the list does. A transition out of a state that is entered while its
    input is 1 fires at the same instant. To wait in a state, feed its output to an `OnDelay`. A run begins in `state`,
    0 by default (MSL `StateGraph`).
    """

    transitions: tuple[tuple[int, int], ...]
    state: Discrete[Scalar, "1"]
    u: tuple[Input, ...]
    y: tuple[Output, ...]

    def __init__(self, *, transitions: list[tuple[int, int]], state: int = 0) -> None:
        self.transitions = tuple((int(a), int(b)) for a, b in transitions)
        numbers = {number for pair in self.transitions for number in pair}
        if numbers != set(range(len(numbers))) or not numbers:
            raise ParameterError(
                f"StateMachine.transitions must name each of the states 0, 1, ..., got {sorted(numbers)}. Number the "
                "states without gaps."
            )
        if state not in numbers:
            raise ParameterError(f"StateMachine.state must be one of the states of the transitions, got {state}.")
        self.state = float(state)
        self.u = tuple(Input() for _ in self.transitions)
        self.y = tuple(Output() for _ in numbers)

    def _is(self, number: int) -> Any:
        return jnp.abs(self.state - number) < 0.5

    def equations(self, d: Self) -> Equations:
        return {f"state_{i}": eq(y.value, jnp.where(self._is(i), 1.0, 0.0)) for i, y in enumerate(self.y)}

    def events(self) -> Events:
        pairs = zip(self.transitions, self.u, strict=True)
        return {
            f"transition_{k}": when(self._is(first) & (u.value > 0.5), state=float(second))
            for k, ((first, second), u) in enumerate(pairs)
        }
