"""A cache that several threads share."""

import threading
import time

import pytest

from acausal._made_once import made_once


def test_threads_wait_for_the_first_one_to_make_a_result() -> None:
    calls: list[int] = []

    @made_once(maxsize=8)
    def squares(n: int) -> list[int]:
        calls.append(n)
        time.sleep(0.1)
        return [i**2 for i in range(n)]

    found: list[list[int]] = []
    threads = [threading.Thread(target=lambda: found.append(squares(3))) for _ in range(5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == 5 * [[0, 1, 4]]
    assert all(one is found[0] for one in found)
    assert squares(2) == [0, 1]
    assert calls == [3, 2]


def test_an_error_is_not_kept() -> None:
    tries: list[int] = []

    @made_once(maxsize=8)
    def second(n: int) -> int:
        tries.append(n)
        if len(tries) < 2:
            raise ValueError("first")
        return n

    with pytest.raises(ValueError, match="first"):
        second(7)
    assert second(7) == second(7) == 7
    assert tries == [7, 7]


def test_the_cache_is_bounded_and_can_be_emptied() -> None:
    calls: list[int] = []

    @made_once(maxsize=1)
    def noted(n: int) -> int:
        calls.append(n)
        return n

    for n in (1, 1, 2, 1):
        noted(n)
    assert calls == [1, 2, 1]
    noted.cache_clear()
    noted(1)
    assert calls == [1, 2, 1, 1]
