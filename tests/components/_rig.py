"""Any number of parts, connected as a test says."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from acausal import Component, Connections

if TYPE_CHECKING:
    Part = Any  # a test knows which parts it has put where
else:
    Part = Component


class Rig(Component):
    """Parts in a tuple, connected by a function of them that is defined at module level."""

    parts: tuple[Part, ...]
    wiring: Callable[..., Connections]

    def connections(self) -> Connections:
        return self.wiring(*self.parts)
