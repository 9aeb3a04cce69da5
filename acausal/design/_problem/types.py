"""Types of arguments: functions, values by path and executors."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias, TypeVar

Value = TypeVar("Value")

Function: TypeAlias = Callable[[Any], Any]  # of a model, or of the result of a user's run
One: TypeAlias = Function | tuple[Function, str]  # a result, possibly with its display unit
Key: TypeAlias = str | tuple[str, ...]  # a path, or several paths that share a value
ByPath: TypeAlias = Mapping[str, Value] | Mapping[tuple[str, ...], Value] | Mapping[Key, Value]
Progress: TypeAlias = Callable[[int, int], None]  # takes the numbers of finished and of all members


class Executor(Protocol):
    """Common interface of the executors of `concurrent.futures`, Dask and submitit."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Any:
        """Runs a function in another thread or process; returns a future."""
        ...
