"""What is being compiled, said where it takes longer than a moment.

jax tells when it begins and ends to trace, to lower and to compile a program; what the program is for is noted by the
functions of the library that need it.
"""

import contextlib
import dataclasses
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TextIO

from jax import monitoring

from ._garbage import seldom_collected
from ._jax_settings import OFF, ON

DELAY = 1.0  # s after which a compilation is announced
PAUSE = 0.2  # s between compilations; after a longer pause the next one is that of another program
TRACING, LOWERING, COMPILING = (
    f"/jax/core/compile/{phase}_duration" for phase in ("jaxpr_trace", "jaxpr_to_mlir_module", "backend_compile")
)


@dataclasses.dataclass
class Subject:
    """What a program computes, by `function`; `wanted` says whether to speak of it, None: where somebody reads it."""

    text: str
    function: str
    wanted: bool | None
    is_gradient: bool = False

    def __str__(self) -> str:
        return f"the gradient of {self.text}" if self.is_gradient else self.text


@dataclasses.dataclass
class Work:
    """What jax does in a thread: how deep in programs within programs it is, since when, and what for."""

    depth: int = 0
    calls: int = 0  # of the library that are under way outside of all programs
    since: float = 0.0
    ended: float = 0.0  # or 0, where that was the end of a program
    error: BaseException | None = None  # that was being handled then already
    subject: Subject | None = None
    last: Subject | None = None
    timer: threading.Timer | None = None
    said: TextIO | None = None  # where it was said that the program is being compiled

    def begin(self, event: str, name: object) -> None:
        self.depth += 1
        if self.depth > 1:
            return
        now = time.monotonic()
        if now - self.ended > PAUSE:
            self.since = now
        if not self.calls:
            self._identify(event, name)
        self.error = sys.exc_info()[1]
        self.watch()

    def _identify(self, event: str, name: object) -> None:
        """A program that begins outside of all calls of the library: somebody else's, or a transpose of one of ours."""
        if event == TRACING:
            self.subject = None
            if self.last is not None and self.last.function == f"jit({name})":
                self.last = None
        elif self.subject is None and self.last is not None and self.last.function == name:
            self.subject = self.last

    def end(self, event: str) -> None:
        self.depth = max(self.depth - 1, 0)
        if self.depth:
            return
        self.ended = time.monotonic()
        if self.timer is not None:
            self.timer.cancel()
            self.timer.join()
            self.timer = None
        if sys.exc_info()[1] is not self.error:  # it was interrupted, for one
            self._close("\n")
        elif event == COMPILING:
            self._close(f"\rCompiled {self.subject} in {self.ended - self.since:.0f} s.\n")
        if event == COMPILING:
            self.ended = 0.0
            if not self.calls:
                self.subject = None

    def watch(self) -> None:
        """Speak of it unless it is over by then."""
        stream = sys.stderr
        if self.subject is None or self.said or self.timer or not is_read(stream, self.subject.wanted):
            return
        self.timer = threading.Timer(max(self.since + DELAY - time.monotonic(), 0.0), self._say, [stream])
        self.timer.daemon = True
        self.timer.start()

    def _say(self, stream: TextIO) -> None:
        _write(stream, f"Compiling {self.subject} ...")
        self.said = stream

    def _close(self, text: str) -> None:
        """End the line, where there is one."""
        if self.said is not None:
            _write(self.said, text)
            self.said = None


class _Threads(threading.local):
    def __init__(self) -> None:
        self.work = Work()


_here = _Threads()


def announce_compilation() -> None:
    """Say what is being compiled wherever that takes longer than `DELAY`."""
    monitoring.register_scalar_listener(_begin)
    monitoring.register_event_duration_secs_listener(_end)


def _begin(event: str, value: float, **names: object) -> None:
    if event in (TRACING, LOWERING, COMPILING):
        _here.work.begin(event, names.get("fun_name"))


def _end(event: str, duration_secs: float, **names: object) -> None:
    if event in (TRACING, LOWERING, COMPILING):
        _here.work.end(event)


@contextlib.contextmanager
def compiling(text: str, model: object, function: Callable[..., object], wanted: bool | None = None) -> Iterator[None]:
    """What is compiled from here on is `text` of `model`, as in "a run", or a program of the user's that holds it.

    `function` is what is called; jax may compile its transpose later.
    """
    work, name = _here.work, getattr(function, "__name__", "")
    work.subject = work.last = Subject(f"{text} of {type(model).__name__}", f"jit({name})", wanted)
    is_whole = work.depth == 0
    work.calls += is_whole
    if not is_whole:
        work.watch()
    try:
        with seldom_collected():
            yield
    finally:
        work.calls -= is_whole
        if is_whole:
            work.subject = None


def differentiating() -> None:
    """What is compiled is a gradient."""
    work = _here.work
    if work.subject is not None and not work.subject.is_gradient:
        work.subject.is_gradient = True
        if work.said is not None:
            _write(work.said, f"\rCompiling {work.subject} ...")


def _write(stream: TextIO, text: str) -> None:
    with contextlib.suppress(OSError, ValueError):  # closed by now
        stream.write(text)
        stream.flush()


def is_read(stream: TextIO | None, wanted: bool | None) -> bool:
    """Whether to speak: not where the environment variable `ACAUSAL_PROGRESS` or `wanted` forbids it; where one of them
    asks for it; else to a terminal or a notebook.
    """
    if stream is None or is_silent(stream, wanted):
        return False
    return _chosen() in ON or wanted is True or is_terminal(stream)


def is_silent(stream: TextIO | None, wanted: bool | None) -> bool:
    """Whether nothing may be said, not even in a log."""
    return stream is None or _chosen() in OFF or wanted is False


def is_terminal(stream: TextIO) -> bool:
    """Whether somebody reads what is written as it comes."""
    return stream.isatty() or "ipykernel" in type(stream).__module__


def _chosen() -> str:
    return os.environ.get("ACAUSAL_PROGRESS", "").lower()
