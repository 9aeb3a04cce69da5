"""The frequency of garbage collection is restored, also for nested contexts and after errors."""

import gc

import pytest

from acausal._garbage import SELDOM, seldom_collected


def failing(meanwhile: tuple[int, ...]) -> None:
    with seldom_collected():
        with seldom_collected():
            assert gc.get_threshold() == meanwhile
        assert gc.get_threshold() == meanwhile
        raise ValueError("within")


@pytest.mark.parametrize(
    ("chosen", "meanwhile"), [((700, 10, 10), SELDOM), ((0, 10, 10), (0, 10, 10)), ((10**6, 5, 5), (10**6, 5, 5))]
)
def test_thresholds_come_back(chosen: tuple[int, ...], meanwhile: tuple[int, ...]) -> None:
    before = gc.get_threshold()
    try:
        gc.set_threshold(*chosen)
        with pytest.raises(ValueError, match="within"):
            failing(meanwhile)
        assert gc.get_threshold() == chosen
    finally:
        gc.set_threshold(*before)
