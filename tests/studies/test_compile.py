"""Studies leave the process as it was."""

import gc

import jax

from studies._compile import SELDOM, compiled_quickly


def settings() -> tuple[object, ...]:
    return jax.config.read("jax_disable_most_optimizations"), gc.get_threshold()


def test_settings_come_back() -> None:
    before = settings()
    with compiled_quickly():
        assert settings() == (True, SELDOM)
    assert settings() == before
