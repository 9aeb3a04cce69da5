"""Progress messages for slow compilations.

jax reports the begin and the end of tracing, lowering and compiling a program. The functions of the library register
the purpose of the program.
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

DELAY = 1.0  # s; a longer compilation is announced
PAUSE = 0.2  # s; phases of one program follow each other faster
TRACING, LOWERING, COMPILING = (
    f"/jax/core/compile/{phase}_duration" for phase in ("jaxpr_trace", "jaxpr_to_mlir_module", "backend_compile")
)


@dataclasses.dataclass
class Subject:
    """The purpose of a program with the name `function`.

    `wanted` enables or disables its message, True also in logs. None enables it in terminals and notebooks.
    """

    text: str
    function: str
    wanted: bool | None
    is_gradient: bool = False

    def __str__(self) -> str:
        return f"the gradient of {self.text}" if self.is_gradient else self.text


@dataclasses.dataclass
class Compilation:
    """State of the compilation in one thread: depth of nested programs, start time and purpose."""

    depth: int = 0
    calls: int = 0  # running calls of the library outside of all programs
    since: float = 0.0
    ended: float = 0.0  # 0 after the end of a program
    error: BaseException | None = None  # that was already being handled at the start
    subject: Subject | None = None
    last: Subject | None = None
    timer: threading.Timer | None = None
    said: TextIO | None = None  # stream with an open message

    def start(self, event: str, name: object) -> None:
        self.depth += 1
        if self.depth > 1:
            return
        now = time.monotonic()
        if now - self.ended > PAUSE and self.said is None:
            self.since = now
        if not self.calls:
            self._identify(event, name)
        self.error = sys.exc_info()[1]
        self.watch()

    def _identify(self, event: str, name: object) -> None:
        """Identify a program outside of all calls of the library: a foreign one, or a transpose of one of ours."""
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
        if sys.exc_info()[1] is not self.error:  # such as an interrupt
            self._close("\n")
        elif event == COMPILING:
            self.close()
        if event == COMPILING:
            self.ended = 0.0
            if not self.calls:
                self.subject = None

    def close(self) -> None:
        """Tell the time from the first event to the last one, if the message is open."""
        self._close(f"Compiled {self.subject} in {self.ended - self.since:.0f} s.\n", is_again=True)

    def watch(self) -> None:
        """Announce the compilation if it takes longer than `DELAY`."""
        stream = sys.stderr
        if self.subject is None or self.said or self.timer or not is_read(stream, self.subject.wanted):
            return
        self.timer = threading.Timer(max(self.since + DELAY - time.monotonic(), 0.0), self._say, [stream])
        self.timer.daemon = True
        self.timer.start()

    def _say(self, stream: TextIO) -> None:
        _write(stream, f"Compiling {self.subject} ..." + ("" if is_terminal(stream) else "\n"))
        self.said = stream

    def _close(self, text: str, *, is_again: bool = False) -> None:
        """End an open message. If the text says it again, it replaces the message in a terminal, and is a line of its
        own in a log. Other texts only end the line in a terminal.
        """
        if self.said is not None:
            if not is_terminal(self.said):
                text = text if is_again else ""
            elif is_again:
                text = f"\r{text}"
            _write(self.said, text)
            self.said = None


class _Threads(threading.local):
    def __init__(self) -> None:
        self.work = Compilation()


_here = _Threads()


def announce_compilation() -> None:
    """Register the messages about compilations that take longer than `DELAY`."""
    monitoring.register_scalar_listener(_start)
    monitoring.register_event_duration_secs_listener(_end)


def _start(event: str, value: float, **names: object) -> None:
    if event in (TRACING, LOWERING, COMPILING):
        _here.work.start(event, names.get("fun_name"))


def _end(event: str, duration_secs: float, **names: object) -> None:
    if event in (TRACING, LOWERING, COMPILING):
        _here.work.end(event)


@contextlib.contextmanager
def compiling(text: str, model: object, function: Callable[..., object], wanted: bool | None = None) -> Iterator[None]:
    """Register the purpose of the next compilation: `text` of `model`, such as "a run", or a user's program around it.

    `function` is the function called. jax may compile its transpose later.
    """
    work, name = _here.work, getattr(function, "__name__", "")
    if wanted is None and work.calls and work.subject is not None:
        wanted = work.subject.wanted  # of the study around a run
    work.subject = work.last = Subject(f"{text} of {type(model).__name__}", f"jit({name})", wanted)
    is_whole = work.depth == 0
    work.calls += is_whole
    if not is_whole:
        work.watch()
    try:
        with seldom_collected():
            yield
        if is_whole:  # a function may only be traced, and then interpreted
            work.close()
    finally:
        work.calls -= is_whole
        if is_whole:
            work.subject = None


def differentiating() -> None:
    """Register that the compiled program is a gradient."""
    work = _here.work
    if work.subject is not None and not work.subject.is_gradient:
        work.subject.is_gradient = True
        if work.said is not None and is_terminal(work.said):
            _write(work.said, f"\rCompiling {work.subject} ...")


def _write(stream: TextIO, text: str) -> None:
    with contextlib.suppress(OSError, ValueError):  # a closed stream
        stream.write(text)
        stream.flush()


def is_read(stream: TextIO | None, wanted: bool | None) -> bool:
    """Whether to print messages: as the environment variable `ACAUSAL_PROGRESS` or `wanted` says, a prohibition first;
    otherwise in terminals and notebooks.
    """
    if stream is None or is_silent(stream, wanted):
        return False
    return _chosen() in ON or wanted is True or is_terminal(stream)


def is_silent(stream: TextIO | None, wanted: bool | None) -> bool:
    """Whether all messages are forbidden, even in a log."""
    return stream is None or _chosen() in OFF or wanted is False


def is_terminal(stream: TextIO) -> bool:
    """Whether a stream belongs to a terminal or a notebook."""
    return stream.isatty() or "ipykernel" in type(stream).__module__


def _chosen() -> str:
    return os.environ.get("ACAUSAL_PROGRESS", "").lower()
