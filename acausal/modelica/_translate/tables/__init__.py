"""Tables with the meaning of the external objects of the Modelica Standard Library."""

from .by_time import TimeTable
from .curve import Table1D
from .surface import Table2D

__all__ = ["Table1D", "Table2D", "TimeTable"]
