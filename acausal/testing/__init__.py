"""Checks of single components, the library's own and those of a user: law, power balance, units, gradients.

A component is checked by itself, its ports open: nothing has to be connected or simulated.
"""

from ._checks import check_component, check_gradients, check_law, check_power_balance, check_units
from ._failed import CheckFailed
from ._law import solved

__all__ = [
    "CheckFailed",
    "check_component",
    "check_gradients",
    "check_law",
    "check_power_balance",
    "check_units",
    "solved",
]
