"""The hydraulic servo of the documentation: energy, pressures that exist, gradients in both modes."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import replace, simulate
from docs._execute import DOCS, namespace

NAMES: tuple[str, ...] = ("pump.displacement", "cylinder.chambers.bore", "controller.k", "line.diameter")


def reached(servo: Any, scales: jax.Array, rtol: float = 1e-6) -> jax.Array:
    """Position of the load after 0.4 s, with the parameters multiplied by these factors."""
    values: dict[str, Any] = dict(zip(NAMES, jnp.array([0.6e-6, 0.04, 20.0, 0.012]) * scales, strict=True))
    return jnp.asarray(simulate(replace(servo, values), 0.4, save="end", rtol=rtol).final.load.a.s)


@pytest.mark.slow
def test_servo() -> None:
    with namespace(DOCS / "servo.md", blocks=1) as page:
        servo = page.servo
        sol = simulate(servo, 1.5, save="steps", energy=True)
        assert abs(float(sol.energy.imbalance)) < -1e-6 * float(sol.energy.stored["battery"])
        for name in ("p_a", "p_b"):
            assert float(np.min(sol[f"cylinder.chambers.{name}"])) > -101325.0
        assert float(sol.final.load.a.s) == pytest.approx(0.2, abs=5e-3)
        here, along = jnp.ones(4), jnp.array([1.0, 0.1, 1.0, 1.0])
        forward = jax.jvp(lambda scales: reached(servo, scales), (here,), (along,))[1]
        reverse = jax.grad(lambda scales: reached(servo, scales))(here) @ along
        h = 1e-4
        ahead, behind = (reached(servo, here + sign * h * along, rtol=1e-9) for sign in (1.0, -1.0))
        assert float(forward) == pytest.approx(float(reverse), rel=1e-7)
        assert float(forward) == pytest.approx(float((ahead - behind) / (2.0 * h)), rel=1e-3)
