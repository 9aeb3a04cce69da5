"""Settings and fixtures of all tests."""

import ctypes
import gc
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from jax.experimental.compilation_cache import compilation_cache

from acausal._jax_private import trace_context
from acausal._jax_settings import programs

# Tests look into what is traced and change it.
programs.folder = None
# Compiling leaves millions of objects that stay, and the collector would walk them all again and again.
gc.set_threshold(100_000, 50, 1000)

LARGE = 1_500_000_000  # bytes that a worker may hold on to after a file of tests


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Most tests compile much and compute little: a program is made sooner, and runs for longer. Slow ones, and those
    marked `computing`, are compiled as for users.

    Quick tests interpret runs at first, as users do. Thorough ones compare many runs bit by bit, which needs one way of
    evaluation for all of them: XLA compiles them as a whole, as under `jax.jit`, unless they are marked `interpreted`.
    """
    is_quick = not any(item.get_closest_marker(mark) for mark in ("slow", "computing"))
    jax.config.update("jax_disable_most_optimizations", is_quick)
    is_whole = item.get_closest_marker("thorough") and not item.get_closest_marker("interpreted")
    programs.context = None if is_whole else trace_context()


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Python hears an interrupt, also in a process that was started to ignore it, as in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def without_jax_cache() -> Iterator[None]:
    """All is compiled anew, whatever jax's own cache holds of earlier test runs."""
    before = bool(jax.config.jax_enable_compilation_cache)  # pyright: ignore[reportAttributeAccessIssue]
    jax.config.update("jax_enable_compilation_cache", False)
    compilation_cache.reset_cache()  # jax remembers the setting
    yield
    jax.config.update("jax_enable_compilation_cache", before)
    compilation_cache.reset_cache()


@pytest.fixture(scope="module", autouse=True)
def forgotten_programs() -> Iterator[None]:
    """A worker forgets what it has compiled for earlier files, once that takes up much memory."""
    yield
    if sys.platform == "linux" and int(Path("/proc/self/statm").read_text().split()[1]) * 4096 > LARGE:
        jax.clear_caches()
        gc.collect()
        ctypes.CDLL("libc.so.6").malloc_trim(0)  # which the C library keeps for itself otherwise
