"""A cache for results that take seconds to make, shared by all threads."""

import functools as ft
import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class _Place:
    """The place of a result; `results` is empty until it is made."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.results: list[Any] = []


class MadeOnce(Generic[T]):
    """`functools.lru_cache`, except that threads that need the same result wait for the first one to make it."""

    def __init__(self, make: Callable[..., T], maxsize: int) -> None:
        ft.update_wrapper(self, make)
        self._make, self._lookup = make, threading.Lock()
        self._places = ft.lru_cache(maxsize)(lambda *args: _Place())

    def __call__(self, *args: Any) -> T:
        with self._lookup:
            place = self._places(*args)
        with place.lock:
            if not place.results:
                place.results.append(self._make(*args))
            return place.results[0]

    def cache_clear(self) -> None:
        self._places.cache_clear()


def made_once(maxsize: int) -> Callable[[Callable[..., T]], MadeOnce[T]]:
    """Decorate a function with `MadeOnce`."""
    return lambda make: MadeOnce(make, maxsize)
