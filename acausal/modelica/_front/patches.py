"""What differs in our view of a library from the library itself.

HIDDEN lists functions whose bodies the last pass of the front end refuses (`hide.py`). PATCHES lists other texts that
it refuses. A patch changes how something is written, never what it computes. What does not occur in a file, as in
another version of the library, is left as it is.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from .hide import hidden

HIDDEN = {
    "Modelica": {
        "Math/BooleanVectors.mo": ("firstTrueIndex",),
    },
}


@dataclass(frozen=True)
class Patch:
    """A substitution in a file of a library."""

    library: str
    file: str
    pattern: str
    text: str
    why: str


PATCHES: tuple[Patch, ...] = ()


def patched(library: Path) -> dict[Path, str]:
    """The texts that differ, by their paths in the folder of the library."""
    name = library.stem.partition(" ")[0]
    found = HIDDEN.get(name, {})
    files = {*found, *(patch.file for patch in PATCHES if patch.library == name)}
    texts: dict[Path, str] = {}
    for file in sorted(files):
        if (library / file).is_file():
            text = (library / file).read_text("utf-8-sig")
            for function in found.get(file, ()):
                text = hidden(text, function, re.sub(r"\W", "_", file))
            for patch in PATCHES:
                if (patch.library, patch.file) == (name, file):
                    text = re.sub(patch.pattern, patch.text, text)
            texts[Path(file)] = text
    return texts
