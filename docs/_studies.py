"""Execution of the commands on study pages, with their outputs and pictures.

A block that opens with ```` ```console ```` contains a command; the ```` ```text ```` block right after it is its
output. A study takes minutes: `python -m docs` runs only the commands of named pages, and slow tests run those of all
pages.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from ._execute import ROOT, PageError

_BLOCK = re.compile(
    r"^```console\n(?P<command>[^\n]*)\n```\n(?P<output>\n```text\n.*?^```\n)?", re.DOTALL | re.MULTILINE
)


def commands(page: Path) -> list[str]:
    """The commands of a page."""
    return [match["command"] for match in _BLOCK.finditer(page.read_text())]


def studied(page: Path, pictures: Path | None = None) -> str:
    """Runs the commands of a page and returns its text with new outputs; copies the pictures it shows to a folder."""
    text = page.read_text()

    def block(match: re.Match[str]) -> str:
        output = _output(match["command"], text, page, pictures)
        return f"```console\n{match['command']}\n```\n\n```text\n{output}\n```\n"

    return _BLOCK.sub(block, text)


def _output(command: str, text: str, page: Path, pictures: Path | None) -> str:
    """The output of a command, without the names of the written files."""
    program, *arguments = shlex.split(command)
    if program != "python":
        raise PageError(f"{page.name}: a command begins with python, got {command!r}.")
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = os.environ | {"PYTHONPATH": paths, "MPLBACKEND": "Agg", "ACAUSAL_PROGRESS": "off"}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=folder, env=env, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise PageError(f"{page.name}: {command!r} ends with {done.returncode}.\n{done.stderr}")
        if pictures is not None:
            _keep(Path(folder), text, pictures)
    lines = [line.rstrip() for line in done.stdout.splitlines() if not line.startswith("wrote ")]
    return "\n".join(lines).strip("\n")


def _keep(folder: Path, text: str, pictures: Path) -> None:
    """Copies the pictures in a folder that the text refers to."""
    for picture in folder.rglob("*.png"):
        if f"/{picture.name})" in text:
            (pictures / picture.name).write_bytes(picture.read_bytes())
