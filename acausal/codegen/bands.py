"""The hysteresis of the relations of a model."""

import diffrax
import jax.numpy as jnp
import numpy as np

from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._integrate.events.run_events import RunEvents
from .._integrate.setup.field import RunArgs
from .._integrate.setup.settings import RunNumbers, Settings
from .._integrate.solvers import Rodas5P


def bands(system: System, inputs: Inputs) -> np.ndarray:
    """For each relation, the size of its event indicator below which it keeps its truth, as in `simulate`."""
    settings = Settings(
        system, None, None, None, None, None, "end", Rodas5P(), None, 1, 1, diffrax.NoProgressMeter()
    )  # fmt: skip
    one = jnp.asarray(1.0)
    args = RunArgs(inputs, RunNumbers(jnp.asarray(0.0), one, None, None, one, None, [], [], [], []))
    events = RunEvents(settings, settings.layout, is_reversible=False)
    return np.asarray(events.bands(args)[0])[: system.events.n_relations if system.events else 0]
