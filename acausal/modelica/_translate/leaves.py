"""The leaves of a translated model."""

import dataclasses
import math
from typing import Any, Literal

from ..._declare.annotations import Limits
from ..._units.parsing import UnknownUnit, is_coherent
from .._syntax.flat import FlatVariable

Role = Literal["param", "var", "discrete", "time"]
_KINDS = {"Real": "real", "Boolean": "boolean"}


@dataclasses.dataclass
class ModelLeaf:
    """A leaf of the model. `value` is that of a parameter, or a start value that is given; None otherwise. `guess` is
    the start value of a variable that is not given.
    """

    path: str
    role: Role
    kind: str = "real"
    dims: tuple[int, ...] = ()
    unit: str = "1"
    is_discrete: bool = False
    is_positive: bool = False
    limits: Limits | None = None
    select: int = 0
    nominal: float | None = None
    guess: float | tuple[Any, ...] = 0.0
    value: Any = None
    is_followed: bool = False  # a start value that parameters determine unless the model has another one
    has_guess: bool = False  # whether the model states the guess
    start_level: float = math.inf  # how deep in the model the guess is stated
    in_port: bool = False
    variable: FlatVariable | None = None
    of: "ModelLeaf | None" = None  # whose previous value this leaf holds

    @property
    def title(self) -> str | None:
        """The name in printed models, empty for that of the attribute. None for a leaf that the text does not state."""
        if self.of is not None:
            return f"pre({self.of.path.rpartition('.')[2]})" if self.of.title is not None else None
        return "" if self.variable is not None and self.variable.place is not None else None


def kind_of(type_name: str) -> str:
    """ "real", "boolean", or "integer", which enumerations are too."""
    return _KINDS.get(type_name, "integer")


def known_unit(unit: str | None) -> str:
    """The unit, or "1" for one that is unknown here or not coherent."""
    if not unit:
        return "1"
    try:
        return unit if is_coherent(unit) else "1"
    except UnknownUnit:
        return "1"
