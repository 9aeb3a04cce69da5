"""What happens at an event: new values for discrete variables and states, until no further event follows."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._evaluate.constraints import GIVEN, STATE, TOLERANCE, placed
from .._evaluate.happenings import Happenings
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .solvers import Settled

ROUNDS = 10  # of events that follow from one another at one instant
ENDLESS, CONTRADICTED = 1, 2  # flags
Read = Callable[[Any, Any, Any, Inputs], list[Any]]  # values of leaves by number, at (leaves, t, y, inputs)


@dataclasses.dataclass(frozen=True, eq=False)
class Switches:
    """The events of a system as functions of the vector [states, memory, discrete variables, energies lost, ...]."""

    system: System
    happenings: Happenings
    read: Read
    stored: Callable[[Any, Any, Inputs], Any] | None  # energy at (t, y, inputs)

    def margins(self, t: Any, y: Any, inputs: Inputs) -> Any:
        """How far each condition is above zero, where it is true."""
        values = self.read(self.happenings.conditions.leaves, t, y[: self.system.extended_size], inputs)
        return jnp.concatenate([jnp.ravel(value) for value in self.happenings.conditions(values)])

    def bound(self, inputs: Inputs, y: Any) -> Inputs:
        """The inputs with the discrete variables of a point."""
        start = len(self.system.nominals) + self.system.memory_size
        return dataclasses.replace(inputs, discrete=y[start : self.system.extended_size])

    def soon(self, t: Any, y: Any, instant: Any, inputs: Inputs) -> Any:
        """The conditions an instant later: what is zero but for rounding at an event has a sign then."""
        rates = self.system.vector_field(t, y[: self.system.extended_size], inputs)
        rates = jnp.where(jnp.isfinite(rates), rates, 0.0)
        ahead = jnp.concatenate([y[: len(rates)] + instant * rates, y[len(rates) :]])
        return self.margins(t + instant, ahead, inputs)

    def settle(self, t: Any, y: Any, holds: Any, forced: Any, instant: Any, inputs: Inputs) -> Settled:
        """Carry out what has become true and is not in `holds`, and what that makes true, until nothing more is."""

        def once(y: Any, holds: Any, last: Any, forced: Any, total: Any, flag: Any) -> tuple[Any, ...]:
            is_true = self.soon(t, y, instant, inputs) > 0
            # What became true by the last round's changes only now is left to this one.
            holds = is_true & (holds | last)
            fired = (is_true & ~holds) | forced
            changed, bad = self._changed(t, y, fired, inputs)
            changed = self._accounted(t, y, changed, fired, inputs)
            y = jnp.where(jnp.any(fired), changed, y)
            flag = jnp.where(jnp.any(fired) & bad, float(CONTRADICTED), flag)
            return y, holds, fired, jnp.zeros_like(forced), total | fired, flag

        def next_round(carry: tuple[Any, ...], is_first: Any) -> tuple[Any, None]:
            goes_on = is_first | jnp.any(carry[2])
            return jax.lax.cond(goes_on, once, lambda *same: same, *carry), None

        nothing = jnp.zeros_like(holds)
        start = (y, holds, nothing, forced, nothing, jnp.asarray(0.0))
        rounds = jnp.arange(ROUNDS + 1) == 0
        y, holds, last, _, fired, flag = jax.lax.scan(next_round, start, rounds)[0]
        return Settled(y, holds, fired, jnp.where(jnp.any(last), float(ENDLESS), flag))

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
            point = placed(point, places, jnp.where(here, value, point[places]))
        moved, bad = self._reset(t, point, wanted, inputs)
        return jnp.concatenate([moved, y[size:]]), bad

    def _accounted(self, t: Any, y: Any, changed: Any, fired: Any, inputs: Inputs) -> Any:
        """The vector with what stored energy became less added to the loss of the first event that fired."""
        if self.stored is None:
            return changed
        size = self.system.extended_size
        lost = self.stored(t, y[:size], inputs) - self.stored(t, changed[:size], inputs)
        first = fired & (jnp.cumsum(fired) == 1)
        losses = changed[size : size + len(fired)] + jnp.where(first, lost, 0.0)
        return jnp.concatenate([changed[:size], losses, changed[size + len(fired) :]])

    def _reset(self, t: Any, point: Any, wanted: dict[int, tuple[Any, Any]], inputs: Inputs) -> tuple[Any, Any]:
        """The point with new values of variables: those of states directly, others by way of the constraints."""
        system = self.system
        constraints, bad = system.constraints, jnp.asarray(False)
        if not wanted:
            return point, bad
        places = {leaf: system.constrained_places(leaf) for leaf in wanted}
        x = system.collected(t, point, inputs, constraints.pairs)
        x0, touched = x, jnp.zeros(len(x), bool)
        for leaf, (value, here) in wanted.items():
            where, signs = places[leaf]
            x = placed(x, where, jnp.where(here, signs * value, x[where]))
            touched = placed(touched, where, touched[where] | here)
        are_states = all(constraints.is_state[where].all() for where, _ in places.values())
        if system.ordered.invariants or not are_states:
            weight = jnp.where(touched, GIVEN, np.where(constraints.is_state, STATE, 1.0))
            aimed, params = x, system.with_discrete(inputs, point).params

            def project(x: Any, _: None) -> tuple[Any, None]:
                return constraints.projected(jnp.where(touched, aimed, x), weight, t, params, far=True), None

            # From the result of the first, new values put back, the second projection moves them no further.
            x = jax.lax.scan(project, x, None, length=2)[0]
            missed = jnp.abs(x - aimed) > TOLERANCE * (constraints.sizes + jnp.abs(aimed))
            bad = jnp.any(touched & missed) | ~jnp.all(jnp.isfinite(x))
        x = jnp.where(jnp.any(touched), x, x0)
        return placed(point, constraints.in_state_vector, x[constraints.states]), bad
