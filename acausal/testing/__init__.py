"""Checks of single components, the library's own and those of a user: law, power balance, units, gradients.

A component is checked by itself, its ports open: nothing has to be connected or simulated.
"""

from ._checks import check_component as check_component
from ._checks import check_gradients as check_gradients
from ._checks import check_law as check_law
from ._checks import check_power_balance as check_power_balance
from ._checks import check_units as check_units
from ._failed import CheckFailed as CheckFailed
from ._law import solved as solved
