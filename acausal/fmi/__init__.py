"""Functional mock-up units (FMI 2.0 and 3.0): models as FMUs, and FMUs as components.

export_fmu    Write a model as an FMU.
FMU           A component that an FMU describes.
FMUWarning    An FMU that cannot be run as its author meant it.
"""

from ._export.fmu import export_fmu
from ._import.fmu import FMU, FMUWarning

__all__ = ["FMU", "FMUWarning", "export_fmu"]
