"""Messages about long compilations: their text, their readers, and the cases without a message."""

import io
import re
import sys
import time
import types
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest
from _models import rc
from jax import monitoring

from acausal import Scalar, _progress, initialise, linearise, simulate


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True

    def lines(self) -> list[str]:
        """The readable lines written since the last call, without the seconds."""
        text = re.sub(r" in \d+ s", " in N s", self.getvalue())
        self.seek(0)
        self.truncate()
        return [line.rpartition("\r")[2] for line in text.split("\n") if line]


def redirect(stream: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not of the process, since pytest takes its standard error for itself."""
    monkeypatch.setattr(_progress, "sys", types.SimpleNamespace(stderr=stream, exc_info=sys.exc_info))


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Standard error is a terminal, nothing is compiled yet, and every compilation takes long."""
    stream = Terminal()
    jax.clear_caches()
    monkeypatch.delenv("ACAUSAL_PROGRESS", raising=False)
    monkeypatch.setattr(_progress, "DELAY", 0.0)
    redirect(stream, monkeypatch)
    return stream


def said(of: str) -> str:
    return f"Compiled {of} in N s."


def final(R: Scalar, **options: Any) -> Any:
    return simulate(rc(R=R), 1.0, save="end", **options).final.c.v


# jax compiles small programs of its own for most of these calls, too; some before it differentiates anything.
CALLS: dict[str, tuple[Callable[[], Any], str]] = {
    "run": (lambda: final(100.0), "a run of RC"),
    "batch": (lambda: jax.vmap(final)(jnp.array([50.0, 100.0])), "a run of RC"),
    "reverse": (lambda: eqx.filter_grad(lambda m: simulate(m, 1.0).final.c.v)(rc()), "the gradient of a run of RC"),
    "forward": (lambda: jax.jvp(final, (100.0,), (1.0,)), "the gradient of a run of RC"),
    "start": (lambda: initialise(rc(), steady=True), "the start of RC"),
    "linearisation": (lambda: linearise(rc()), "the linearisation of RC"),
}


@pytest.mark.thorough
@pytest.mark.parametrize("call", CALLS)
def test_what_is_compiled_is_said_the_first_time(terminal: Terminal, call: str) -> None:
    function, subject = CALLS[call]
    function()
    lines = terminal.lines()
    assert said(subject) in lines
    assert set(lines) <= {said(subject), said("a run of RC")}
    function()
    assert terminal.lines() == []


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("function", "subject"),
    [(final, "a run of RC"), (jax.grad(lambda R: 2.0 * final(R)), "the gradient of a run of RC")],
)
def test_a_program_of_the_user_is_named_after_what_it_runs(
    terminal: Terminal, function: Callable[[Any], Any], subject: str
) -> None:
    jax.jit(function)(100.0)
    assert terminal.lines() == [said(subject)]


@pytest.mark.thorough
def test_nothing_is_said_of_other_programs(terminal: Terminal) -> None:
    def run(x: Any) -> Any:  # the name of the library's own
        return jnp.sin(x) + 1.0

    jax.make_jaxpr(final)(100.0)  # which is never compiled
    final(100.0)
    terminal.lines()
    for function in (run, lambda x: run(x) - 1.0):
        jax.jit(function)(1.0)
    assert terminal.lines() == []


def test_a_line_is_ended_before_an_error(terminal: Terminal) -> None:
    def failing(R: Scalar) -> Scalar:
        v = final(R)
        while not terminal.getvalue():
            time.sleep(0.001)
        raise ZeroDivisionError(v)

    with pytest.raises(ZeroDivisionError):
        jax.jit(failing)(100.0)
    assert terminal.getvalue() == "Compiling a run of RC ...\n"


def takes(*phases: tuple[str, float]) -> None:
    """As jax does for one program."""
    for event, seconds in phases:
        monitoring.record_scalar(event, time.time(), fun_name="f")
        time.sleep(seconds)
        monitoring.record_event_duration_secs(event, seconds, fun_name="f")


def test_only_what_takes_long_is_announced_and_once(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_progress, "DELAY", 0.5)
    with _progress.compiling("a run", rc(), takes):
        takes((_progress.TRACING, 0.0), (_progress.LOWERING, 0.0), (_progress.COMPILING, 0.0))
        assert terminal.lines() == []
        takes((_progress.TRACING, 0.3), (_progress.LOWERING, 0.3), (_progress.COMPILING, 0.2))
    assert re.fullmatch(r"Compiling a run of RC \.\.\.\rCompiled a run of RC in \d s\.\n", terminal.getvalue())


def test_what_is_interrupted_is_not_said_to_be_compiled(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_progress, "DELAY", 0.05)

    def interrupted() -> None:
        with _progress.compiling("a run", rc(), takes):
            monitoring.record_scalar(_progress.COMPILING, time.time(), fun_name="f")
            try:
                time.sleep(0.2)
                raise KeyboardInterrupt
            finally:  # as jax does
                monitoring.record_event_duration_secs(_progress.COMPILING, 0.2, fun_name="f")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert terminal.getvalue() == "Compiling a run of RC ...\n"


@pytest.mark.parametrize(
    ("chosen", "wanted", "is_terminal", "is_said"),
    [
        (None, None, True, True),
        (None, None, False, False),
        (None, True, False, True),
        (None, False, True, False),
        ("off", None, True, False),
        ("0", True, True, False),
        ("on", None, False, True),
        ("on", False, True, False),
    ],
)
def test_who_is_told(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch,
    chosen: str | None, wanted: bool | None, is_terminal: bool, is_said: bool,
) -> None:  # fmt: skip
    monkeypatch.setattr(terminal, "isatty", lambda: is_terminal)
    if chosen is not None:
        monkeypatch.setenv("ACAUSAL_PROGRESS", chosen)
    with _progress.compiling("a run", rc(), takes, wanted):
        takes((_progress.COMPILING, 0.1))
    assert terminal.lines()[-1:] == ([said("a run of RC")] if is_said else [])


def test_a_log_has_a_line_before_and_after(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study reports the runs in its program, too, which have no wish of their own."""
    monkeypatch.setattr(terminal, "isatty", lambda: False)

    def run() -> None:
        with _progress.compiling("a run", rc(), takes):
            takes((_progress.COMPILING, 0.1))

    run()
    assert terminal.getvalue() == ""
    monkeypatch.setattr(_progress, "DELAY", 0.05)
    with _progress.compiling("the results", rc(), takes, True):
        monitoring.record_scalar(_progress.TRACING, time.time(), fun_name="f")
        run()
        monitoring.record_event_duration_secs(_progress.TRACING, 0.1, fun_name="f")
        takes((_progress.COMPILING, 0.1))
    assert re.fullmatch(r"Compiling a run of RC \.\.\.\nCompiled a run of RC in \d s\.\n", terminal.getvalue())


def test_a_notebook_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    class OutStream(io.StringIO):
        """As that of a notebook, which is no terminal."""

        __module__ = "ipykernel.iostream"

    stream = OutStream()
    redirect(stream, monkeypatch)
    monkeypatch.setattr(_progress, "DELAY", 0.0)
    with _progress.compiling("a run", rc(), takes):
        takes((_progress.COMPILING, 0.1))
    assert stream.getvalue().startswith("Compiling a run of RC ...")


def test_a_run_may_be_silent(terminal: Terminal) -> None:
    final(100.0, progress=False)
    assert terminal.lines() == []
