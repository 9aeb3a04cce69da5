"""A notebook as a Markdown page: its text, its code and the saved outputs."""

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat


def rendered(path: Path) -> tuple[str, dict[str, bytes]]:
    """The text of the page, and its pictures by name."""
    pictures: dict[str, bytes] = {}
    cells = nbformat.read(path, as_version=4).cells
    parts = [part for cell in cells for part in _cell(cell, path.stem, pictures)]
    return "\n\n".join(parts) + "\n", pictures


def _cell(cell: Any, name: str, pictures: dict[str, bytes]) -> Iterator[str]:
    if cell.cell_type == "markdown":
        yield cell.source
        return
    yield f"```python\n{cell.source}\n```"
    for output in cell.get("outputs", []):
        data = output.get("data", {})
        if "image/svg+xml" in data:
            picture = f"{name}_{len(pictures) + 1}.svg"
            pictures[picture] = "".join(data["image/svg+xml"]).encode()
            yield f"![Output of the code above](pictures/{picture})"
        elif "image/png" in data:
            picture = f"{name}_{len(pictures) + 1}.png"
            pictures[picture] = base64.b64decode(data["image/png"])
            yield f"![Output of the code above](pictures/{picture})"
        else:
            yield f"```text\n{output.get('text', data.get('text/plain', '')).rstrip()}\n```"
