"""Parameters of the three prototypes of Meloni's thesis from its measurements, and what the data leave open."""

from ._main import main as main
from ._tables import as_text as as_text
from ._tables import stored as stored
