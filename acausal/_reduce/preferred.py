"""Derivatives of variables that are preferred as states and that no equation differentiates."""

import numpy as np

from .cancel import is_singular
from .graph import sharing
from .incidence import Incidence
from .index import Reduced, with_least_orders
from .states import select_states


def with_preferred(reduced: Reduced) -> Reduced:
    """The index reduction with additional differentiations that make states of preferred variables.

    The derivative of a preferred variable becomes an unknown even if no equation contains it, as in Modelica
    (section 4.9.7.1), so that the choice of states can take it. Exceptions are variables that

    - are tied to others by equations that read the time or discrete variables, since they may jump at events,
    - are tied to no state, or to one by a coefficient that may vanish.
    """
    table = reduced.incidence
    wished = (table.selects > 0) & (reduced.orders == 0)
    while np.any(wished):
        trial = with_least_orders(table, wished)
        refused = wished & _refused(reduced, trial)
        if not np.any(refused):
            return reduced if is_singular(trial) else trial
        wished &= ~refused
    return reduced


def _refused(reduced: Reduced, trial: Reduced) -> np.ndarray:
    """The variables that do not become states in the trial, or that are tied to others by unfit equations."""
    table, chosen = reduced.incidence, select_states(trial)
    added = trial.differentiations > reduced.differentiations
    unfit = chosen.moving | _reads_jumps(table)
    use = added[table.row] & (trial.orders > reduced.orders)[table.variable]
    sets, label = sharing(np.flatnonzero(added).tolist(), table.row[use], table.variable[use])
    is_unfit = np.array([np.any(unfit[members]) for members in sets], bool)
    refused = chosen.dummies == trial.orders
    refused[table.variable[use][is_unfit[label]]] = True
    return refused


def _reads_jumps(table: Incidence) -> np.ndarray:
    """The equations that read the time or discrete variables."""
    reads = [any(one.source in ("time", "discrete") for one in f.template.inputs) for f in table.families]
    return np.array(reads, bool)[table.family_of_row]
