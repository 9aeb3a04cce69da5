"""The process that runs rumoca, which can end a process. It imports nothing else, so that it starts quickly.

It reads requests from its input and writes answers to its output, as pickles. The library starts it.
"""

import os
import pickle
import signal
import sys
from typing import Any

import rumoca  # pyright: ignore[reportMissingImports]


def flat(sessions: dict[str, Any], root: str, text: str, model: str, file: str) -> dict[str, Any]:
    """The flat model of a model in a text. `sessions` are by the folder of libraries, which each parses once."""
    if root not in sessions:
        sessions[root] = rumoca.Session(roots=[root])
    return sessions[root].loads(text, model=model, filename=file).to_dict("flat")


def errors(text: str, file: str) -> list[str]:
    """The errors of syntax in a text."""
    return [error.message for error in rumoca.validate_source(text, filename=file) if error.level == "error"]


def _answer(sessions: dict[str, Any], name: str, args: tuple[str, ...]) -> tuple[str, Any]:
    try:
        return "found", flat(sessions, *args) if name == "flat" else errors(*args)
    except rumoca.RumocaError as error:
        return "refused", str(error)
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # the class, which is no `Exception`, has no public name
            raise
        return "refused", f"todae panicked: {error}"


def main() -> None:
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what rumoca prints is no answer
    sessions: dict[str, Any] = {}
    while True:
        try:
            request = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(_answer(sessions, *request), answers)
        answers.flush()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one ends it
    main()
