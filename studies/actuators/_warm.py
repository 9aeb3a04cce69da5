"""Temperature dependence of the winding and the magnets of a motor, both linear."""

from acausal import Scalar

T20 = 293.15  # K, reference temperature of the coefficients
SHEETS = 298.15  # K, reference temperature of motor data sheets
COPPER = 3.93e-3  # 1/K, of the resistance (IEC 60028)
NEODYMIUM = -1.1e-3  # 1/K, of the flux of NdFeB magnets (IEC 60404-8-1)


def winding(kelvin: Scalar, base: Scalar = SHEETS) -> Scalar:
    """Resistance of copper at a temperature in K, relative to a base temperature."""
    return _linear(COPPER, kelvin) / _linear(COPPER, base)


def magnets(kelvin: Scalar, base: Scalar = SHEETS) -> Scalar:
    """Flux of NdFeB magnets, and so the torque constant, at a temperature in K, relative to a base temperature."""
    return _linear(NEODYMIUM, kelvin) / _linear(NEODYMIUM, base)


def _linear(coefficient: Scalar, kelvin: Scalar) -> Scalar:
    return 1.0 + coefficient * (kelvin - T20)
