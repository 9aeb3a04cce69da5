"""Losses that leave through an optional heat port, whose temperature is that of the liquid."""

from typing import Any

from acausal import Equations, Scalar, eq

from ..thermal import HeatPort


def heating(heat: HeatPort | None, loss: Scalar) -> Equations:
    """The equation by which a loss in W leaves through the heat port, if there is one."""
    return {} if heat is None else dict(heating=eq(heat.Q_flow, -loss))


def lost(heat: HeatPort | None, loss: Any) -> Any:
    """Dissipation of the component itself: the loss, or zero if it leaves through a heat port."""
    return loss if heat is None else 0.0


def temperature(heat: HeatPort | None) -> Any:
    """Temperature of the liquid in K, or None for the one stored in the liquid."""
    return None if heat is None else heat.T
