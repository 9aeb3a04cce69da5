"""Design with models: parameters that are free within bounds."""

from ._free import Free as Free
from ._free import free_parameters as free_parameters
