"""Events at the end of a run whose times move with differentiated parameters."""

import warnings
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from ..._errors import listed
from ..._evaluate.event_set import EventEntry
from ..._reduce.jumps import JumpWarning
from ..._tracing import are_traced, is_traced, known
from ..setup.schedule import last_before, tick

if TYPE_CHECKING:
    from .solution import Solution


def warn_of_jumps_at_end(solution: "Solution", t1: ArrayLike) -> None:
    """Warn of scheduled events at the end time whose times depend on differentiated parameters.

    An event at the end fires in the run that continues this one. A result that it changes is therefore a discontinuous
    function of the parameters that move its time, and the derivative is that of the run that ends before the event.
    """
    events, end = solution.system.events, known(solution._end[0])
    if events is None or not events.schedules or end is None or np.ndim(end) or is_traced(t1):
        return
    carried = solution.system.carried
    params = {leaf: solution._params[leaf] for leaf in events.times.leaves if leaf not in carried.discrete_places}
    if not are_traced(params):
        return
    values = params | carried.discrete_values(*jax.lax.stop_gradient((solution._end[1], solution._inputs)))
    found = events.times([values[leaf] for leaf in events.times.leaves])
    scheduled = [entry for entry in events.entries if entry.is_scheduled]
    names = [
        _label(entry, known(every))
        for entry, times, every in zip(scheduled, found[::2], found[1::2], strict=True)
        if entry.targets and are_traced(times, every) and _is_due(known(times), known(every), end)
    ]
    if names := list(dict.fromkeys(names)):
        warnings.warn(
            f"The run ends at the time of {listed(names)}, which depends on differentiated parameters. What these "
            "events change jumps with the parameters, and the derivatives are those of a run that ends just before the "
            "events. Remedy: another end time, between the events.",
            JumpWarning,
            stacklevel=4,  # skips this function, `simulate` and its decorator
        )


def _label(entry: EventEntry, every: np.ndarray | None) -> str:
    if not entry.is_internal or every is None:
        return entry.label(0)
    period = float(np.ravel(every)[0])
    return f"a sample every {period:.6g} s" if np.isfinite(period) else "an event of a clock"


def _is_due(times: np.ndarray | None, every: np.ndarray | None, end: np.ndarray) -> bool:
    if times is None or every is None:
        return False
    rows, period = jnp.ravel(times)[:, None], jnp.resize(jnp.ravel(every), (np.size(times),))[:, None]
    since = end - last_before(rows, period, end)
    return bool(jnp.any(jnp.abs(since) <= tick(end, rows[:, 0])))
