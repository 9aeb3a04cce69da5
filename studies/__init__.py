"""What people do with the library. `python -m studies --help` lists what can be run."""

from .actuators import opening as opening
from .actuators import opening_time as opening_time
