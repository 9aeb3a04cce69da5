"""Notebooks that are run."""

import os
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from ._execute import ROOT


def executed(path: Path, timeout: float = 300.0, *, compile_fast: bool = False) -> Any:
    """The notebook with fresh outputs; raises where a cell does. `compile_fast`: XLA leaves out most optimisations."""
    notebook = nbformat.read(path, as_version=4)
    # A kernel is another process: it finds the packages as this one does.
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    # The kernel shows pictures in its own way, whichever backend this process draws with.
    inherited = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    env = inherited | {"PYTHONPATH": paths, "ACAUSAL_PROGRESS": "off"}
    env |= {"JAX_DISABLE_MOST_OPTIMIZATIONS": "1"} if compile_fast else {}
    where = {"metadata": {"path": ROOT}}
    return NotebookClient(notebook, timeout=timeout, kernel_name="python3", resources=where).execute(env=env)


def write(path: Path, notebook: Any) -> None:
    """Save without what changes from run to run: execution times, and the version of the interpreter."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    notebook.metadata = {"kernelspec": notebook.metadata.kernelspec, "language_info": {"name": "python"}}
    nbformat.write(notebook, path)
