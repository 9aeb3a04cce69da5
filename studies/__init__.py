"""Studies of clutch actuators. `python -m studies --help` lists them."""

from .actuators import opening as opening
from .actuators import opening_time as opening_time
