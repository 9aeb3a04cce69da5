"""A circuit made twice: of our components, and of the classes of the Modelica Standard Library."""

import dataclasses
from collections.abc import Mapping

from acausal import Component


@dataclasses.dataclass(frozen=True)
class Twin:
    """A circuit: its Modelica text, our component, the duration of a run, and the names of signals in both."""

    name: str
    text: str
    ours: Component
    stop: float
    signals: Mapping[str, str]  # ours by Modelica name
