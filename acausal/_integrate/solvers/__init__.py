"""Rosenbrock solvers for diffrax."""

from ._rodas import Rodas3P as Rodas3P
from ._rodas import Rodas5P as Rodas5P
from ._rosenbrock import AbstractRosenbrock as AbstractRosenbrock
