"""Comparison of the figures of Meloni's thesis with the model, mismatches included."""

from .._vibrations import mode_frequencies as mode_frequencies
from ..actuators import Hold as Hold
from ..actuators import hold as hold
from ._linear import linear_actuator as linear_actuator
from ._linear import matrices as matrices
from ._linear import modes as modes
from ._linear import static_gains as static_gains
from ._main import as_text as as_text
from ._main import conflicts_as_text as conflicts_as_text
from ._main import counts as counts
from ._main import counts_as_text as counts_as_text
from ._main import main as main
from ._main import set_as_text as set_as_text
from ._main import stored as stored
from ._ratios import best_ratio as best_ratio
from ._ratios import least_ratio as least_ratio
from ._rows import Row as Row
