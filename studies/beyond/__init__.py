"""Extensions of the thesis: load of a real clutch, line, temperature, passages, voltage profiles, series production.

Each is compared with the statements of the thesis, and lists its assumptions.
"""

from ._main import ITEMS as ITEMS
from ._main import main as main
from ._row import Row as Row
