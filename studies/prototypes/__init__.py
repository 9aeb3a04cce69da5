"""The three prototypes of Meloni's thesis: what its measurements tell of them, and what they cannot tell."""

from ._main import main as main
from ._tables import as_text as as_text
from ._tables import stored as stored
