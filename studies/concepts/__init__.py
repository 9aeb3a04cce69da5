"""Redesign of the two concepts of the thesis for its targets, with all manually chosen sizes free.

The study minimises the opening time within limits for each catalogue motor below 250 W, under the 800 N of a worn
clutch, and compares the prototypes of 2012 with these optima.
"""

from ._concepts import CONCEPTS as CONCEPTS
from ._concepts import MOTORS as MOTORS
from ._main import main as main
from ._rows import Row as Row
