"""The saturating coil: its law, its derivatives, and its current on a constant voltage."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy import optimize

from acausal import Connections, ParameterError, Scalar, connect, simulate
from components import electrical
from components.electrical import ConstantVoltage, Ground, Resistor

COIL: dict[str, Any] = {"Lnom": 1.0, "Inom": 1.0, "Lzer": 2.0, "Linf": 0.5}


def wire_series(source: Any, first: Any, second: Any, ground: Any) -> Connections:
    return (
        connect(source.p, first.p),
        connect(first.n, second.p),
        connect(second.n, source.n, ground.p),
    )


@pytest.mark.parametrize("Lnom", [0.500001, 0.6, 1.0, 1.8, 1.999999])
def test_saturating_inductor_has_its_nominal_inductance(Lnom: float) -> None:
    """The knee Ipar solves Psi(Inom) = Lnom Inom, from an almost square curve to an almost straight one."""
    coil = electrical.SaturatingInductor(**{**COIL, "Lnom": Lnom, "Inom": 3.0})
    knee = coil.knee()
    psi = 0.5 * 3.0 + 1.5 * knee * jnp.arctan(3.0 / knee)
    np.testing.assert_allclose(psi / 3.0, Lnom, rtol=1e-10)


@pytest.mark.thorough
def test_knee_of_saturating_inductor_is_differentiable() -> None:
    """First and second derivative by the implicit function theorem, against the traced Newton steps."""

    def knee(Lnom: Scalar) -> Scalar:
        return electrical.SaturatingInductor(**{**COIL, "Lnom": Lnom}).knee()

    slope = jax.grad(knee)
    x, share_slope = knee(1.0), lambda x: jnp.arctan(1.0 / x) - x / (1.0 + x**2)
    np.testing.assert_allclose(slope(1.0), 1.0 / (1.5 * share_slope(x)), rtol=1e-9)
    np.testing.assert_allclose(jax.grad(slope)(1.0), (slope(1.0 + 1e-5) - slope(1.0 - 1e-5)) / 2e-5, rtol=1e-6)


@pytest.mark.parametrize("bad", [{"Lnom": 0.4}, {"Lnom": 2.5}])
def test_nominal_inductance_has_to_lie_between_the_limits(bad: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match=r"SaturatingInductor\.(Linf must be smaller than Lnom|Lnom must)"):
        electrical.SaturatingInductor(**{**COIL, **bad})


@pytest.mark.thorough
def test_saturating_inductor_on_a_constant_voltage() -> None:
    """The flux grows as V t, and the gradient of the current with respect to Inom is that of the implicit law."""

    def current_and_flux(Inom: Scalar) -> tuple[Scalar, Scalar]:
        coil = electrical.SaturatingInductor(**{**COIL, "Inom": Inom})
        parts = (ConstantVoltage(V=2.0), Resistor(R=0.0), coil, Ground())
        end = simulate(Rig(parts=parts, wiring=wire_series), 2.0, save="end", rtol=1e-10).final.parts[2]
        return end.i, end.Psi

    def exact(Inom: float) -> Any:
        knee = float(electrical.SaturatingInductor(**{**COIL, "Inom": Inom}).knee())
        return optimize.brentq(lambda i: 0.5 * i + 1.5 * knee * np.arctan(i / knee) - 4.0, 0.0, 20.0, xtol=1e-13)

    found = jnp.asarray(current_and_flux(1.0))
    np.testing.assert_allclose(found, [exact(1.0), 4.0], rtol=1e-8)
    slope = jax.jacfwd(lambda Inom: current_and_flux(Inom)[0])(1.0)
    np.testing.assert_allclose(slope, (exact(1.0 + 1e-5) - exact(1.0 - 1e-5)) / 2e-5, rtol=1e-6)
