"""The scope in which expressions are evaluated."""

import dataclasses
from collections import ChainMap
from collections.abc import Mapping, Sequence
from typing import Protocol

from .values import Value


class NotKnown(Exception):
    """An expression that is not known while equations are translated; it names what is missing."""


class FunctionLibrary(Protocol):
    """Calls of functions of the model by name, with all their results."""

    def call(self, name: str, args: Sequence[Value]) -> tuple[Value, ...]: ...


@dataclasses.dataclass(frozen=True)
class Scope:
    """Values of the slots and of local names. `holds`: relations are held between events, as in `ifelse`.
    `in_condition`: relations are conditions of events.
    """

    functions: FunctionLibrary
    values: Sequence[Value] = ()
    rates: Sequence[Value] = ()
    locals: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    holds: bool = False
    in_condition: bool = False

    def without_events(self) -> "Scope":
        return dataclasses.replace(self, holds=False)

    def knowing(self, **names: Value) -> "Scope":
        return dataclasses.replace(self, locals=ChainMap(names, self.locals))  # pyright: ignore[reportArgumentType]
