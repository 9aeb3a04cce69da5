"""The designs by name, and their opening time from a dictionary of keywords, compiled once for each family."""

import inspect
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from studies import opening_time
from studies.actuators import ehs_maxon, ema_fise, ema_maxon, sila
from studies.optimise._problems import time_and_slope

DESIGNS: dict[str, Callable[..., Any]] = {
    "sila": sila, "ema_fise": ema_fise, "ema_maxon": ema_maxon, "ehs_maxon": ehs_maxon,
}  # fmt: skip


def _compiled(build: Callable[..., Any]) -> Callable[[dict[str, Any]], tuple[Any, dict[str, Any]]]:
    return jax.jit(jax.value_and_grad(lambda keywords: opening_time(build(**keywords))))


_EMA = _compiled(ema_fise)  # with all keywords given, both electromechanical designs are this
_REVERSE = {"ema_fise": _EMA, "ema_maxon": _EMA, "ehs_maxon": _compiled(ehs_maxon)}


def numbers(design: str, **changes: float) -> dict[str, float]:
    """All keywords of a design."""
    given = {name: parameter.default for name, parameter in inspect.signature(DESIGNS[design]).parameters.items()}
    del given["inductance"]
    return {name: float(value) for name, value in (given | changes).items()}


def reverse(design: str, keywords: dict[str, float]) -> tuple[float, dict[str, float]]:
    """Opening time and its derivatives with respect to all keywords, by reverse mode."""
    time, gradient = _REVERSE[design](keywords)
    return float(time), {name: float(value) for name, value in gradient.items()}


def forward(design: str, keywords: dict[str, float], name: str) -> tuple[float, float]:
    """Opening time and its derivative with respect to one keyword, by forward mode."""
    # All keywords are arrays of one kind, so that one compiled program serves every keyword.
    given = {key: jnp.asarray(value, float) for key, value in keywords.items()}
    direction = {key: jnp.asarray(key == name, float) for key in keywords}
    model, change = jax.jvp(lambda given: DESIGNS[design](**given), (given,), (direction,))
    time, slope = time_and_slope(model, change, 1e-9)
    return float(time), float(slope)
