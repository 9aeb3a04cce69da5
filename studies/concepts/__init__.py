"""The thesis' two concepts designed anew under its targets, with all free that it fixed by hand.

The least opening time within limits for each motor below 250 W that is on sale, under the 800 N of a worn clutch; and
how far the prototypes of 2012 were from it.
"""

from ._concepts import CONCEPTS as CONCEPTS
from ._concepts import MOTORS as MOTORS
from ._main import main as main
from ._rows import Row as Row
