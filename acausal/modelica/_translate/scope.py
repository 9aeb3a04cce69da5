"""The scope in which expressions are evaluated."""

import contextlib
import dataclasses
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import jax

from ..._errors import ModelError
from .._errors import ModelicaError
from .values import Value


class NotKnown(Exception):
    """An expression that is not known while equations are translated; it names what is missing."""


@contextlib.contextmanager
def located(place: object) -> Iterator[None]:
    """Names a place of the text in an error of what is evaluated."""
    try:
        yield
    except ModelicaError:
        raise
    except NotKnown as error:
        raise ModelicaError(f"{place}: {error} is not known before a run.") from error
    except RecursionError as error:
        raise ModelicaError(f"{place}: a function calls itself, and the number of calls is not known.") from error
    except jax.errors.ConcretizationTypeError as error:
        raise ModelicaError(f"{place}: a size, or the range of a loop, is not known before a run.") from error
    except (ModelError, TypeError, ValueError, IndexError) as error:
        raise ModelicaError(f"{place}: {error}") from error


class FunctionLibrary(Protocol):
    """Calls of functions of the model by name, with all their results."""

    def call(self, name: str, args: Sequence[Value]) -> tuple[Value, ...]: ...


class _Inner(ChainMap[str, Value]):
    """Local names, which hide outer names that begin with one of them: `a.x` is a field of a local `a`."""

    def __contains__(self, name: object) -> bool:
        return not self._is_hidden(str(name)) and super().__contains__(name)

    def __getitem__(self, name: str) -> Value:
        if self._is_hidden(name):
            raise KeyError(name)
        return super().__getitem__(name)

    def _is_hidden(self, name: str) -> bool:
        first, dot, _ = name.partition(".")
        return bool(dot) and first in self.maps[0]


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

    def knowing(self, /, **names: Value) -> "Scope":
        return dataclasses.replace(self, locals=_Inner(names, self.locals))  # pyright: ignore[reportArgumentType]
