"""What differs in our view of a library from the library itself, besides hidden equations.

HIDDEN lists functions whose bodies the last pass of the front end refuses (`functions.py`). PATCHES lists other texts
that it refuses. A patch changes how something is written, never what it computes. What does not occur in a file, as in
another version of the library, is left as it is.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from . import equations, functions

HIDDEN = {
    "Modelica/Blocks/Continuous.mo": ("findInterval", "normalizationFactor"),
    "Modelica/Electrical/Spice3.mo": functions.ALL,
    "Modelica/Math/BooleanVectors.mo": ("firstTrueIndex",),
    "Modelica/Math/Polynomials.mo": ("fitting",),
    "Modelica/Math/isPowerOf2.mo": ("isPowerOf2",),
}


@dataclass(frozen=True)
class Patch:
    """A substitution in a file of a library."""

    file: str
    pattern: str
    text: str
    why: str


PATCHES = (
    Patch(
        "Modelica/Math/Random.mo",
        r"\bimpure\s+function\b",
        "function",
        "The pass allows no calls of impure functions in pure ones. Our own random generators take their places.",
    ),
    Patch(
        "Modelica/Mechanics/Translational/Components/MassWithStopAndFriction.mo",
        r"extends PartialRigid\((s\([^()]*\))\);",
        "Modelica.Mechanics.Translational.Interfaces.Flange_a flange_a; "
        "Modelica.Mechanics.Translational.Interfaces.Flange_b flange_b; "
        r"Modelica.Units.SI.Position \1; parameter Modelica.Units.SI.Length L(start=0); "
        "equation flange_a.s = s - L/2; flange_b.s = s + L/2; public",
        "In a nested class, the front end does not find what it inherits, so the base classes are written out.",
    ),
)


def changed(text: str, name: Path, hides_equations: bool) -> str:
    """The text of a file as the front end gets it. `name` is its path, which begins with the name of the library;
    its equations are hidden if `hides_equations`.
    """
    file = name.as_posix()
    text = functions.hidden(text, HIDDEN.get(file, ()), re.sub(r"\W", "_", file))
    for patch in PATCHES:
        if patch.file == file:
            text = re.sub(patch.pattern, patch.text, text)
    return equations.hidden(text, file) if hides_equations else text
