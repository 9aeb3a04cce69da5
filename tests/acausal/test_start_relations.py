"""A run from the result of `initialise` holds the relations of `ifelse` as a run of the model does."""

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, initialise, simulate
from components import blocks

TIMES = jnp.linspace(0.05, 2.95, 30)


class Followed(Component):
    """A signal in pieces, which a lag follows."""

    signal: blocks.Ramp | blocks.Trapezoid
    lag: blocks.FirstOrder

    def connections(self) -> Connections:
        return (connect(self.signal.y, self.lag.u),)


SIGNALS = {
    "ramp": blocks.Ramp(height=1.0, duration=1.0, start_time=0.3),
    "wave": blocks.Trapezoid(amplitude=1.0, period=2.5, start_time=0.3, rising=0.3, width=0.6, falling=0.3),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", SIGNALS)
def test_a_searched_start_changes_no_law_in_pieces(name: str) -> None:
    model = Followed(signal=SIGNALS[name], lag=blocks.FirstOrder(k=1.0, T=0.5))
    expected = simulate(model, 3.0, save=TIMES)
    once = initialise(model)
    for start in (once, initialise(once)):
        found = simulate(start, 3.0, save=TIMES)
        for path in ("signal.y.value", "lag.y.value"):
            np.testing.assert_allclose(found[path], expected[path], atol=1e-6)
