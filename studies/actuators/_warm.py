"""What the temperature does to winding and magnets of a motor: both are linear in it."""

from acausal import Scalar

T20 = 293.15  # K, that coefficients are given for
SHEETS = 298.15  # K, that data sheets of motors are given for
COPPER = 3.93e-3  # 1/K, of the resistance (IEC 60028)
NEODYMIUM = -1.1e-3  # 1/K, of the flux of NdFeB magnets (IEC 60404-8-1)


def winding(kelvin: Scalar, base: Scalar = SHEETS) -> Scalar:
    """Resistance of copper at a temperature in K, over that at another one."""
    return _linear(COPPER, kelvin) / _linear(COPPER, base)


def magnets(kelvin: Scalar, base: Scalar = SHEETS) -> Scalar:
    """Flux of neodymium magnets, and with it the motor constant, at a temperature in K, over that at another one."""
    return _linear(NEODYMIUM, kelvin) / _linear(NEODYMIUM, base)


def _linear(coefficient: Scalar, kelvin: Scalar) -> Scalar:
    return 1.0 + coefficient * (kelvin - T20)
