"""Actuators optimised for the shortest opening time within limits, each with a certificate."""

from ._main import Row as Row
from ._main import main as main
from ._problems import PROBLEMS as PROBLEMS
from ._problems import Problem as Problem
