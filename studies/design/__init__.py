"""Actuators designed for the least opening time within limits, each optimum with its certificate."""

from ._main import Row as Row
from ._main import main as main
from ._problems import PROBLEMS as PROBLEMS
from ._problems import Problem as Problem
