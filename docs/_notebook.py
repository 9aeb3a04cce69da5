"""Execution of notebooks."""

import os
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from ._execute import ROOT


def executed(path: Path, timeout: float = 300.0, *, compile_fast: bool = False) -> Any:
    """The notebook with new outputs; raises if a cell raises. With `compile_fast`, XLA skips most optimisations."""
    notebook = nbformat.read(path, as_version=4)
    # The kernel is another process and needs the import path of this one.
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    # The kernel uses its own matplotlib backend, independent of this process.
    inherited = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    env = inherited | {"PYTHONPATH": paths, "ACAUSAL_PROGRESS": "off"}
    env |= {"JAX_DISABLE_MOST_OPTIMIZATIONS": "1"} if compile_fast else {}
    where = {"metadata": {"path": ROOT}}
    return NotebookClient(notebook, timeout=timeout, kernel_name="python3", resources=where).execute(env=env)


def write(path: Path, notebook: Any) -> None:
    """Save without data that change from run to run: execution times and interpreter version."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    notebook.metadata = {"kernelspec": notebook.metadata.kernelspec, "language_info": {"name": "python"}}
    nbformat.write(notebook, path)
