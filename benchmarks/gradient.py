"""The cost of a derivative of the opening time, relative to that of the opening time itself."""

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from acausal import Scalar
from studies import opening_time
from studies.actuators import ema_maxon

from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest

RTOL = 1e-6
LIMIT = 3.0


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """Forward mode for the ratio, reverse mode for all parameters at once."""
    model, rest = eqx.partition(ema_maxon(), eqx.is_array)

    def of_ratio(ratio: Scalar) -> Scalar:
        return opening_time(ema_maxon(ratio=ratio), rtol=RTOL)

    def of_model(model: Any) -> Any:
        return opening_time(eqx.combine(model, rest), rtol=RTOL)

    ratio = jnp.asarray(4.3)
    primal = {"forward": jax.jit(of_ratio), "reverse": jax.jit(of_model)}
    derivative = {
        "forward": jax.jit(lambda ratio: jax.jvp(of_ratio, (ratio,), (jnp.ones_like(ratio),))[1]),
        "reverse": jax.jit(jax.grad(of_model)),
    }
    np.testing.assert_allclose(derivative["forward"](ratio), derivative["reverse"](model).gearbox.ratio, rtol=1e-6)
    given = {"forward": ratio, "reverse": model}
    times = fastest(
        {f"{kind} {mode}": lambda f=f[mode], x=given[mode]: f(x)
         for kind, f in (("primal", primal), ("derivative", derivative)) for mode in given},
        effort.repeats,
    )  # fmt: skip
    return [
        compared(
            f"gradient: {name}", times[f"derivative {mode}"] * 1e3, "ms", times[f"primal {mode}"] * 1e3,
            "the simulation", limit,
        )
        for mode, name, limit in (
            ("forward", "forward, one parameter", LIMIT),
            ("reverse", "reverse, all parameters", None),
        )
    ]  # fmt: skip
