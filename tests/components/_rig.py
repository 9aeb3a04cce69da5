"""Any number of parts, connected as a test says."""

from collections.abc import Callable

from acausal import Component, Connections


class Rig(Component):
    """Parts in a tuple, connected by a function of them that is defined at module level."""

    parts: tuple[Component, ...]
    wiring: Callable[..., Connections]

    def connections(self) -> Connections:
        return self.wiring(*self.parts)
