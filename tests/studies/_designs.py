"""The designs by name, and their opening time from a dictionary of keywords, compiled once for each family."""

from collections.abc import Callable
from typing import Any

import jax

from studies import opening_time
from studies.actuators import ehs_maxon, ema_fise, ema_maxon, sila
from studies.optimise._problems import time_and_slope

DESIGNS: dict[str, Callable[..., Any]] = {
    "sila": sila, "ema_fise": ema_fise, "ema_maxon": ema_maxon, "ehs_maxon": ehs_maxon,
}  # fmt: skip

_time_and_gradient = jax.jit(jax.value_and_grad(lambda model: opening_time(model)))


def reverse(build: Callable[..., Any], keywords: dict[str, float]) -> tuple[float, dict[str, float]]:
    """Opening time and its derivatives with respect to the keywords, by reverse mode."""
    model, pull = jax.vjp(lambda keywords: build(**keywords), keywords)
    time, gradient = _time_and_gradient(model)
    return float(time), {name: float(value) for name, value in pull(gradient)[0].items()}


def forward(build: Callable[..., Any], keywords: dict[str, float], name: str) -> tuple[float, float]:
    """Opening time and its derivative with respect to one keyword, by forward mode."""

    def model(value: float) -> Any:
        return build(**(keywords | {name: value}))

    time, slope = time_and_slope(*jax.jvp(model, (keywords[name],), (1.0,)), 1e-9)
    return float(time), float(slope)
