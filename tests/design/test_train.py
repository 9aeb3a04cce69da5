"""Training of weights by the optimisers of optax."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, ModelError, Param, Scalar, SimulationError, UnknownNameError
from acausal.design import train
from components.blocks import MonotoneCurve

optax: Any = pytest.importorskip("optax")


class Law(Component):
    """A curve and a scale."""

    curve: MonotoneCurve
    scale: Param[Scalar, "N"] = 2.0
    offset: Param[Scalar, "1"] = 0.0


X = jnp.linspace(-1.0, 1.0, 21)


def law() -> Law:
    return Law(curve=MonotoneCurve.of(3, jax.random.key(0)))


def loss(model: Law) -> Scalar:
    return jnp.mean((model.scale * jax.vmap(model.curve)(X) - 3.0 * jnp.sinh(X)) ** 2)


PATHS = ["curve.heights", "curve.slopes", "curve.offsets", "curve.linear"]


@pytest.mark.parametrize("optimiser", [None, "adam"])
def test_a_curve_learns_a_function(optimiser: str | None) -> None:
    steps = 60
    found = train(law(), PATHS, loss, steps=steps, optimiser=optax.adam(0.05) if optimiser else None)
    assert len(found.losses) == steps + 1
    assert found.losses[0] == pytest.approx(float(loss(law())))
    assert float(loss(found.model)) == pytest.approx(np.min(found.losses), rel=1e-9)
    assert np.min(found.losses) < (1e-1 if optimiser else 1e-4) * found.losses[0]
    assert found.model.scale == 2.0
    assert f"in {steps} steps" in str(found)


def test_unknown_paths_are_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"no parameter 'curve\.height'\. Did you mean curve\.heights"):
        train(law(), ["curve.height"], loss)


@pytest.mark.parametrize("free", ["scale", []])
def test_paths_are_a_list(free: Any) -> None:
    with pytest.raises(ModelError, match="train takes a list of paths of parameters"):
        train(law(), free, loss)


@pytest.mark.parametrize(
    "bad", [lambda m: loss(m) / jnp.zeros(()), lambda m: jnp.sqrt(m.offset)], ids=["loss", "slope"]
)
def test_a_loss_that_is_not_finite_is_said(bad: Any) -> None:
    with pytest.raises(SimulationError, match="The loss or its gradient is not finite before step 1"):
        train(law(), ["scale", "offset"], bad)


def test_an_interrupt_keeps_the_best_model(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def is_read(*_: Any) -> bool:
        calls.append(1)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return False

    monkeypatch.setattr("acausal.design._train.train.EVERY", -1.0)
    monkeypatch.setattr("acausal.design._train.train.is_read", is_read)
    found = train(law(), PATHS, loss)
    assert len(found.losses) == 4
    assert float(loss(found.model)) == pytest.approx(np.min(found.losses), rel=1e-9)
