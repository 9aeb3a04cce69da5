"""Gear ratio and pump displacement of minimum opening time, from the derivative of the opening time."""

from ._main import Row as Row
from ._main import main as main
from ._minimise import NoMinimumError as NoMinimumError
from ._minimise import Point as Point
from ._minimise import minimise as minimise
from ._own import own as own
from ._problems import PROBLEMS as PROBLEMS
from ._problems import Problem as Problem
