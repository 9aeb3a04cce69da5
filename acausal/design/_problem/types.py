"""Types of what users give: functions, values by path, and where batches run."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias, TypeVar

Value = TypeVar("Value")

Function: TypeAlias = Callable[[Any], Any]  # of a model, or of whatever a user's own run makes of it
One: TypeAlias = Function | tuple[Function, str]  # a result, with the unit to show it in
Key: TypeAlias = str | tuple[str, ...]  # a path, or several that share a value
ByPath: TypeAlias = Mapping[str, Value] | Mapping[tuple[str, ...], Value] | Mapping[Key, Value]
Progress: TypeAlias = Callable[[int, int], None]  # is told how many are done, of how many


class Executor(Protocol):
    """Where batches run: what the executors of `concurrent.futures`, of Dask and of submitit have in common."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Any:
        """Run a function of these arguments elsewhere; returns a future."""
        ...
