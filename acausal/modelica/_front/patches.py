"""What differs in our view of a library from the library itself, besides hidden equations.

HIDDEN lists functions whose bodies the last pass of the front end refuses (`functions.py`). PATCHES lists other texts
that it refuses. A patch changes how something is written, never what it computes. What does not occur in a file, as in
another version of the library, is left as it is.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from . import comprehensions, equations, functions, outer_marks, part_marks, redeclared

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


_INLINE = "The front end does not find what a nested class gives to the class around it, so it is written out there."

PATCHES = (
    Patch(
        "Modelica/Math/Random.mo",
        r"\bimpure\s+function\b",
        "function",
        "The pass allows no calls of impure functions in pure ones. Our own random generators take their places.",
    ),
    Patch(
        "Modelica/Mechanics/Translational/Components/MassWithStopAndFriction.mo",
        r"extends PartialFrictionWithStop;",
        "",
        _INLINE,
    ),
    Patch(
        "Modelica/Mechanics/Translational/Components/MassWithStopAndFriction.mo",
        r'encapsulated partial model PartialFrictionWithStop\s*"[^"]*"\s*import Modelica;',
        "\n\n\n",
        _INLINE,
    ),
    Patch(
        "Modelica/Mechanics/Translational/Components/MassWithStopAndFriction.mo",
        r'annotation \(Documentation\(info="[^"]*"\)\);(\s*)end PartialFrictionWithStop;\s*equation',
        r"\1",
        _INLINE,
    ),
    Patch(
        "Modelica/Mechanics/Rotational/Components/LossyGear.mo",
        r"interpolation_result = \[1, 1, 0, 0\];",
        "interpolation_result[1, 1] = 1; interpolation_result[1, 2] = 1; "
        "interpolation_result[1, 3] = 0; interpolation_result[1, 4] = 0;",
        "The front end counts this as one equation, but those of the other branch as four.",
    ),
)


def changed(text: str, name: Path, hides: equations.Hidden) -> str:
    """The text of a file as the front end gets it. `name` is its path, which begins with the name of the library;
    `hides` says what is hidden, besides bodies of functions.
    """
    file = name.as_posix()
    text = functions.hidden(restated(text), HIDDEN.get(file, ()), re.sub(r"\W", "_", file))
    for patch in PATCHES:
        if patch.file == file:
            text = re.sub(patch.pattern, patch.text, text)
    return marked(text, file, hides)


def restated(text: str) -> str:
    """A text with array constructors and redeclarations in the forms that the front end reads right."""
    return redeclared.written_out(comprehensions.nested(text))


def marked(text: str, file: str, hides: equations.Hidden) -> str:
    """A text without what is hidden, and with marks of what the flat model does not show."""
    return part_marks.marked(outer_marks.marked(equations.hidden(text, file, hides)))
