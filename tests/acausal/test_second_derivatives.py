"""Second derivatives of smooth runs against differences of gradients."""

import equinox as eqx
import jax
import pytest

from acausal import Scalar, simulate
from docs.drive import drive


@pytest.mark.slow
@pytest.mark.parametrize(("result", "step"), [("time of a stop", 1e-3), ("end value", 1e-2)])
def test_hessian_against_differences_of_gradients(result: str, step: float) -> None:
    def value(ratio: Scalar) -> Scalar:
        model = eqx.tree_at(lambda m: m.gear.ratio, drive, ratio)
        if result == "end value":
            return simulate(model, 0.05, save="end", rtol=1e-8).final.load.w
        return simulate(model, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end", rtol=1e-8).t1

    slope, bend = jax.jit(jax.jacfwd(value)), jax.jacfwd(jax.jacfwd(value))
    once, twice = ((slope(20.0 + h) - slope(20.0 - h)) / (2.0 * h) for h in (step, 2.0 * step))
    assert float(bend(20.0)) == pytest.approx(float((4.0 * once - twice) / 3.0), rel=1e-6)
