"""Published end values of the Test Set for IVP Solvers (Mazzia, Magherini, 2008), from models of the problems."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _ivp_models import (
    AKZO,
    AMPLIFIER,
    CAR_AXIS,
    RING_MODULATOR,
    Akzo,
    CarAxis,
    RingModulator,
    transistor_amplifier,
)

from acausal import Component, simulate, structure

pytestmark = pytest.mark.slow

RTOL = 1e-6  # of the end values, each relative to itself


def end(model: Component, t1: float, rtol: float) -> Any:
    return simulate(model, t1, save="end", rtol=rtol, max_steps=500_000)


def test_car_axis() -> None:
    """The multipliers and the vertical speed of the left end, small after nearly coming to rest, are hardest to get."""
    model = CarAxis(xl=0.0, yl=0.5, xr=1.0, yr=0.5, ul=-0.5, vl=0.0, ur=-0.5, vr=0.0)
    assert len(structure(model).invariants) == 4
    final = end(model, 3.0, 1e-11).final
    np.testing.assert_allclose([getattr(final, name) for name in CAR_AXIS], list(CAR_AXIS.values()), rtol=RTOL)
    assert abs((final.xl - final.xr) ** 2 + (final.yl - final.yr) ** 2 - 1.0) < 1e-13


def test_transistor_amplifier() -> None:
    """The published values are the potentials of the nodes at the capacitors."""
    C1, C2, C3, C4, C5 = end(transistor_amplifier(), 0.2, 1e-8).final.C
    nodes = (C1.p, C1.n, C2.p, C3.p, C3.n, C4.p, C5.p, C5.n)
    np.testing.assert_allclose([node.v for node in nodes], AMPLIFIER, rtol=RTOL)


def test_akzo_nobel() -> None:
    start = np.array([0.444, 0.00123, 0.0, 0.007, 0.0, 115.83 * 0.444 * 0.007])
    np.testing.assert_allclose(end(Akzo(y=start), 180.0, 1e-7).final.y, AKZO, rtol=RTOL)


def test_ring_modulator() -> None:
    """Tiny capacitances oscillate with small inductances: some 190,000 steps."""
    final = end(RingModulator(), 1e-3, 1e-8).final
    np.testing.assert_allclose(jnp.concatenate([final.v, final.h, final.i]), RING_MODULATOR, rtol=RTOL)
