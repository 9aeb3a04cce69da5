"""The actuators of Meloni's thesis: what it states beside what the model gives, mismatches included."""

from ._main import main as main
from ._rows import Row as Row
from ._statics import Hold as Hold
from ._statics import hold as hold
from ._statics import mode_frequencies as mode_frequencies
