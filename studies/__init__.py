"""What people do with the library. `python -m studies --help` lists what can be run."""

from ._opening import opening as opening
from ._opening import opening_time as opening_time
