"""The three prototypes of Meloni's thesis: what its measurements tell of them, and what they cannot tell."""

from ._main import main as main
