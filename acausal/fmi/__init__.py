"""Functional mock-up units (FMI 2.0 and 3.0): FMUs as components.

FMU    A component that an FMU describes.
"""

from ._fmu import FMU

__all__ = ["FMU"]
