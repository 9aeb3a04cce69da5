"""Comparison of clutch actuators: valve-controlled, hydrostatic and electromechanical, with equal sizes on one duty.

Each opens the clutch as fast as its controller can, holds it for 10 s, and closes it along a profile. The taxonomy is
that of Meloni's thesis (Politecnico di Torino, 2012, figure 1.2). All consist of library parts.
"""

from ._architecture import Architecture as Architecture
from ._duty import open_clutch as open_clutch
from ._duty import whole_duty as whole_duty
from ._families import ARCHITECTURES as ARCHITECTURES
from ._main import as_text as as_text
from ._main import conditions_as_text as conditions_as_text
from ._main import limits_as_text as limits_as_text
from ._main import main as main
from ._main import measured_as_text as measured_as_text
from ._main import stored as stored
from ._main import study as study
from ._rows import Row as Row
from ._rows import row_of as row_of
from ._words import SIZES as SIZES
from ._words import elasticities as elasticities
