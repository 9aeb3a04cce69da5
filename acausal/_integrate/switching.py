"""What happens at an event: new values for discrete variables and states, until no further event follows."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._evaluate.constraints import STATE
from .._evaluate.happenings import Happenings
from .._evaluate.initial import GIVEN, TOLERANCE
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .solvers import Settled

ROUNDS = 10  # of events that follow from one another at one instant
ENDLESS, CONTRADICTED = 1, 2  # flags
Read = Callable[[Any, Any, Any, Inputs], list[Any]]  # values of leaves by number, at (leaves, t, y, inputs)


@dataclasses.dataclass(frozen=True, eq=False)
class Switches:
    """The events of a system as functions of the vector [states, memory, discrete variables, flag, ...]."""

    system: System
    happenings: Happenings
    read: Read

    def margins(self, t: Any, y: Any, inputs: Inputs) -> Any:
        """How far each condition is above zero, where it is true."""
        values = self.read(self.happenings.conditions.leaves, t, y[: self.system.extended_size], inputs)
        return jnp.concatenate([jnp.ravel(value) for value in self.happenings.conditions(values)])

    def bound(self, inputs: Inputs, y: Any) -> Inputs:
        """The inputs with the discrete variables of a point."""
        start = len(self.system.nominals) + self.system.memory_size
        return dataclasses.replace(inputs, discrete=y[start : self.system.extended_size])

    def settle(self, t: Any, y: Any, holds: Any, forced: Any, inputs: Inputs) -> Settled:
        """Carry out what has become true and is not in `holds`, and what that makes true, until nothing more is."""

        def once(carry: Any, _: None) -> tuple[Any, None]:
            y, holds, forced, total, flag = carry
            fired = ((self.margins(t, y, inputs) > 0) & ~holds) | forced
            changed, bad = self._changed(t, y, fired, inputs)
            y = jnp.where(jnp.any(fired), changed, y)
            flag = jnp.where(jnp.any(fired) & bad, float(CONTRADICTED), flag)
            holds = (self.margins(t, y, inputs) > 0) | forced
            return (y, holds, jnp.zeros_like(forced), total | fired, flag), None

        start = (y, holds, forced, jnp.zeros_like(holds), jnp.asarray(0.0))
        (y, holds, _, fired, flag), _ = jax.lax.scan(once, start, None, length=ROUNDS)
        endless = jnp.any((self.margins(t, y, inputs) > 0) & ~holds)
        return Settled(y, holds, fired, jnp.where(endless, float(ENDLESS), flag))

    def _changed(self, t: Any, y: Any, fired: Any, inputs: Inputs) -> tuple[Any, Any]:
        """The vector after these events, and whether its constraints forbid it; of several values the last one counts.

        Values are computed from those before.
        """
        system, size = self.system, self.system.extended_size
        point = y[:size]
        new = iter(self.happenings.actions(self.read(self.happenings.actions.leaves, t, point, inputs)))
        wanted: dict[int, tuple[Any, Any]] = {}
        start = 0
        for item in self.happenings.items:
            here = fired[start : start + item.count]
            start += item.count
            for leaf in item.targets:
                value = jnp.ravel(next(new))
                old, was = wanted.get(leaf, (value, jnp.zeros_like(here)))
                wanted[leaf] = (jnp.where(here, value, old), was | here)
        for leaf in [leaf for leaf in wanted if leaf in system.discrete_places]:
            value, here = wanted.pop(leaf)
            places = system.discrete_places[leaf]
            point = point.at[places].set(jnp.where(here, value, point[places]))
        moved, bad = self._reset(t, point, wanted, inputs)
        return jnp.concatenate([moved, y[size:]]), bad

    def _reset(self, t: Any, point: Any, wanted: dict[int, tuple[Any, Any]], inputs: Inputs) -> tuple[Any, Any]:
        """The point with new values of variables: those of states directly, others by way of the constraints."""
        system = self.system
        if not wanted:
            return point, jnp.asarray(False)
        constraints = system.constraints
        x = system.collected(t, point, inputs, constraints.pairs)
        x0, touched = x, jnp.zeros(len(x), bool)
        for leaf, (value, here) in wanted.items():
            places, signs = system.constrained_places(leaf)
            x = x.at[places].set(jnp.where(here, signs * value, x[places]))
            touched = touched.at[places].set(touched[places] | here)
        bad = jnp.asarray(False)
        if constraints.groups:
            weight = jnp.where(touched, GIVEN, np.where(constraints.is_state, STATE, 1.0))
            aimed = x
            x = constraints.projected(x, weight, t, system.with_discrete(inputs, point).params, far=True)
            missed = jnp.abs(x - aimed) > TOLERANCE * (constraints.sizes + jnp.abs(aimed))
            bad = jnp.any(touched & missed) | ~jnp.all(jnp.isfinite(x))
        x = jnp.where(jnp.any(touched), x, x0)
        return point.at[constraints.in_state_vector].set(x[constraints.states]), bad
