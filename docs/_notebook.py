"""Notebooks that are run."""

import os
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from ._execute import ROOT


def executed(path: Path, timeout: float = 300.0) -> Any:
    """The notebook with fresh outputs; raises where a cell does."""
    notebook = nbformat.read(path, as_version=4)
    # A kernel is another process: it finds the packages as this one does.
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [before])])
    try:
        client = NotebookClient(
            notebook, timeout=timeout, kernel_name="python3", resources={"metadata": {"path": ROOT}}
        )
        return client.execute()
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before


def write(path: Path, notebook: Any) -> None:
    """Save without what changes from run to run: execution times, and the version of the interpreter."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    notebook.metadata = {"kernelspec": notebook.metadata.kernelspec, "language_info": {"name": "python"}}
    nbformat.write(notebook, path)
