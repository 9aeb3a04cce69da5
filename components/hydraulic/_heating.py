"""Losses that leave as heat: what takes an optional heat port, the liquid of which is as warm as that."""

from typing import Any

from acausal import Equations, Scalar, eq

from ..thermal import HeatPort


def heating(heat: HeatPort | None, loss: Scalar) -> Equations:
    """That a loss in W leaves through the port, where there is one."""
    return {} if heat is None else dict(heating=eq(heat.Q_flow, -loss))


def lost(heat: HeatPort | None, loss: Any) -> Any:
    """What of a loss is dissipated in the part itself."""
    return loss if heat is None else 0.0


def temperature(heat: HeatPort | None) -> Any:
    """That of the liquid in K, or None where it is the one that the liquid was made for."""
    return None if heat is None else heat.T
