"""Which of the unknowns of a system went wrong; for messages."""

from typing import Any

import numpy as np

from .._reduce.tear import Torn
from .plan import Pair
from .starts import Inputs
from .system import System


def first_not_finite(system: System, t: Any, y: Any, inputs: Inputs) -> Pair | None:
    """The first unknown, in the order of computation, that is not finite at a point."""
    store = system.evaluate_all(t, y, inputs)
    for pair, place in system.plan.places.items():
        value = store.flat(place.segment)[place.start : place.start + system.plan.size(pair[0])]
        if not np.all(np.isfinite(np.asarray(value))):
            return pair
    return None


def block_of(system: System, pair: Pair) -> Torn | None:
    """The simultaneous block that a pair is solved in; None where it is not."""
    unknowns = system.ordered.unknowns
    return next((torn for torn in system.torn if torn.tears and pair in [unknowns[u] for u in torn.unknowns]), None)
