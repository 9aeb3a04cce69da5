"""Signals: ports without power, sources of time, and simple operations."""

from ._interfaces import Input as Input
from ._interfaces import Output as Output
from ._interfaces import Signal as Signal
from ._interfaces import SignalSource as SignalSource
from ._math import Gain as Gain
from ._math import Sum as Sum
from ._sources import Clock as Clock
from ._sources import Constant as Constant
from ._sources import Ramp as Ramp
from ._sources import Sine as Sine
from ._sources import Step as Step
from ._sources import TimeFunction as TimeFunction
from ._time_series import TimeSeries as TimeSeries
