"""The fast Fourier transform of ModelicaFFT."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..values import is_known


def _real_fft(u: Any) -> tuple[int, Any, Any]:
    """0, and the amplitudes divided by their number and the phases of a signal with an even number of samples."""
    xp, count = np if is_known(u) else jnp, len(u) // 2 + 1
    if len(u) % 2:
        return 1, xp.zeros(count), xp.zeros(count)
    found = xp.fft.rfft(xp.asarray(u, float))
    return 0, xp.abs(found) / count, xp.angle(found)


FUNCTIONS: dict[str, Callable[..., Any]] = {"ModelicaFFT_kiss_fftr": _real_fft}
