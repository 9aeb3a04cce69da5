"""What the thesis left open: the load of a real clutch, the line, temperatures, passages, courses of voltage, series.

Each as far as components and design tools go, beside what the thesis states; what had to be assumed is said there.
"""

from ._main import ITEMS as ITEMS
from ._main import main as main
from ._row import Row as Row
