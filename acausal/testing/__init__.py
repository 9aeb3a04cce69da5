"""Checks of single components, of the library or of users: law, power balance, units, gradients.

The checks need only the component, with open ports, without connections or simulation.
"""

from ._checks import check_component, check_gradients, check_law, check_power_balance, check_units
from ._law import CheckFailed, solved

__all__ = [
    "CheckFailed",
    "check_component",
    "check_gradients",
    "check_law",
    "check_power_balance",
    "check_units",
    "solved",
]
