"""The front end rumoca, which runs in a process of its own, because some models end the process that reads them."""

import atexit
import os
import pickle
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType
from typing import Any

from ..._extras import needed
from .._errors import ModelicaError

SERIES = "0.10."  # of versions with the form of the flat model that is read here


class Refused(Exception):
    """The front end refuses a model."""


class Crashed(Exception):
    """The process of the front end has ended."""


def rumoca() -> ModuleType:
    """The front end. Raises `ModelicaError` if it is another version, and `ModelError` if it is not installed."""
    module = needed("rumoca", "modelica", "Modelica")
    if not module.version().startswith(SERIES):
        raise ModelicaError(
            f"rumoca {module.version()} is installed, but Modelica models are read by rumoca {SERIES}*. "
            f'Remedy: pip install "acausal[modelica]".'
        )
    return module


def flat(root: Path, text: str, model: str, file: str) -> dict[str, Any]:
    """The flat model of a model in a text, with the libraries in a folder. Raises `Refused` and `Crashed`."""
    return _asked("flat", str(root), text, model, file)


def errors(text: str, file: str) -> list[str]:
    """The errors of syntax in a text. Raises `Crashed`."""
    return _asked("errors", text, file)


_lock = threading.Lock()
_workers: dict[int, "subprocess.Popen[bytes]"] = {}  # of this process; a copy of a process starts its own


def _asked(*request: str) -> Any:
    with _lock:
        worker = _workers.get(os.getpid())
        if worker is None:
            worker = _workers[os.getpid()] = _started()
        assert worker.stdin is not None
        assert worker.stdout is not None
        try:
            pickle.dump((request[0], request[1:]), worker.stdin)
            worker.stdin.flush()
            kind, answer = pickle.load(worker.stdout)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            code = _ended()
            raise Crashed(signal.strsignal(-code) if code < 0 else f"exit status {code}") from None
        except BaseException:  # an interrupt leaves an answer behind
            worker.kill()
            _ended()
            raise
    if kind == "refused":
        raise Refused(answer)
    return answer


@atexit.register
def _ended() -> int:
    """Ends the process if there is one, and returns its exit status."""
    worker = _workers.pop(os.getpid(), None)
    if worker is None:
        return 0
    with worker:  # closes its input, at whose end it ends
        pass
    return worker.returncode


def _started() -> "subprocess.Popen[bytes]":
    rumoca()
    paths = os.pathsep.join(sys.path)
    command = [sys.executable, "-P", str(Path(__file__).with_name("worker.py"))]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": paths}
    )
