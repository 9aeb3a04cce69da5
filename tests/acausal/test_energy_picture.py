"""The energy account as a picture."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from _models import rc

from acausal import EnergyAccount, ModelError, simulate
from acausal._integrate.results.energy_plot import Flow, flows

ACCOUNT = EnergyAccount(
    supplied={"source": 10.0, "brake": -1.0, "spring": 0.0, "small": 0.0, "tiny": 0.0},
    stored={"source": 0.0, "brake": 0.0, "spring": -2.0, "small": 0.01, "tiny": 0.02},
    dissipated={"source": 0.0, "brake": 8.97, "spring": 0.0, "small": 0.0, "tiny": 0.0},
    events={"stop.impact": 2.0},
)


def test_flows_are_sorted_by_where_they_come_from_and_go_to() -> None:
    came, went = flows(ACCOUNT)
    assert came == [Flow("source", "supplied", 10.0), Flow("spring", "released", 2.0)]
    assert went[:3] == [
        Flow("brake", "dissipated", 8.97),
        Flow("stop.impact", "lost at events", 2.0),
        Flow("brake", "taken up", 1.0),
    ]
    assert [flow[:2] for flow in went[3:]] == [("2 others", "stored")]
    assert sum(flow.amount for flow in came) == pytest.approx(sum(flow.amount for flow in went))


@pytest.mark.thorough
def test_bands_are_as_wide_as_their_amounts() -> None:
    account = simulate(rc(), 0.5, energy=True).energy
    ax = account.plot()
    texts = [text.get_text() for text in ax.texts]
    assert any(text.startswith("source: supplied") for text in texts)
    assert any(text.startswith("c: stored") for text in texts)
    (_, *bands, _) = ax.collections  # what was supplied, where it went, the bar in the middle
    heights = [
        np.ptp(vertices[vertices[:, 0] == 1.0, 1])
        for vertices in (np.asarray(b.get_paths()[0].vertices) for b in bands)
    ]
    went = np.array([account.dissipated["r"], account.stored["c"]])
    np.testing.assert_allclose(heights, went / max(went.sum(), account.supplied["source"]), rtol=1e-6)
    plt.close("all")


@pytest.mark.thorough
def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ModelError, match="nothing to draw"):
        EnergyAccount({"a": 0.0}, {"a": 0.0}, {"a": 0.0}).plot()
    batch = jax.vmap(lambda R: simulate(rc(R=R), 0.1, save="end", energy=True).energy.imbalance)(jnp.ones(2))
    with pytest.raises(ModelError, match="belongs to a batch"):
        EnergyAccount({"a": batch}, {"a": batch}, {"a": batch}).plot()
